#include "sim_server/scene/mesh_import.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "sim_server/scene/mesh_mend.h"
#include "sim_server/scene/mesh_process.h"
#include "sim_server/scene/self_intersection.h"
#include "sim_server/wrap/wrap.h"

namespace sectio {
namespace {

constexpr double kFillSizes = 2;  // radius of the ball that fills what can't be wrapped as it is, in edges

// Files that say their unit themselves.
void check_unit(const std::string& path, double unit_m) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  const bool is_gltf = extension == ".gltf" || extension == ".glb";
  const bool is_nifti = extension == ".nii" || path.ends_with(".nii.gz");
  if (unit_m == 1 || !(is_gltf || is_nifti)) return;
  throw InputError(path + (is_gltf ? ": glTF files are in metres" : ": NIfTI files say their unit") +
                   ": the unit must be m");
}

std::string not_a_surface(const SurfaceReport& report) {
  std::string text = report.manifold ? "not closed: " : "not a manifold surface: ";
  text += report.first_defect;
  if (report.defects > 1) text += ", and " + std::to_string(report.defects - 1) + " more such places";
  return text;
}

// The first triangle without a plane of its own: thinner than rounding can tell.
void refuse_slivers(const TriangleSoup& soup, const std::string& path) {
  constexpr double kThinnest = 1e-7;  // height over longest edge
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    const Vec3& a = soup.vertices_body_m[soup.triangles[t][0]];
    const Vec3 u = soup.vertices_body_m[soup.triangles[t][1]] - a, v = soup.vertices_body_m[soup.triangles[t][2]] - a;
    const double longest2 = std::max({u.squaredNorm(), v.squaredNorm(), (u - v).squaredNorm()});
    if (u.cross(v).norm() > kThinnest * longest2) continue;
    throw InputError(path + formatted(": triangle %zu at (%.6g, %.6g, %.6g) m has no area", t, a.x(), a.y(), a.z()));
  }
}

std::string goes_through_itself(const SelfIntersections& found) {
  if (found.pairs.empty()) return "triangles crowd so closely that self-intersections can't be searched for";
  const TrianglePair& first = found.pairs.front();
  return formatted("goes through itself: %s%zu pairs of triangles, the first %u and %u at (%.6g, %.6g, %.6g) m",
                   found.complete ? "" : "at least ", found.pairs.size(), first.a, first.b, first.point.x(),
                   first.point.y(), first.point.z());
}

}  // namespace

ImportedMesh import_wrapped(const std::string& path, double unit_m, const WrapRequest& request,
                            const ImportLimits& limits) {
  const auto refuse = [&](const std::string& why) { throw InputError(path + ": " + why); };
  check_unit(path, unit_m);
  TriangleSoup given = read_mesh_file(path, limits, {.part = request.part, .any_format = true});
  for (Vec3& p : given.vertices_body_m) p *= unit_m;
  ImportedMesh mesh;
  mesh.mended = mend(given);
  std::string why;
  for (const double fill_sizes : {0.0, kFillSizes}) {
    try {
      const Wrapped wrapped = wrap(given, request.size_m, fill_sizes);
      const SelfIntersections found = find_self_intersections(wrapped.soup);
      if (!found.pairs.empty() || !found.complete)
        throw InputError("wrapped, it " + goes_through_itself(found) + "; another size may help");
      mesh.mended.push_back(to_string(wrapped));
      if (fill_sizes > 0) mesh.mended.push_back("filled up, since as it is it can't be wrapped: " + why);
      mesh.soup = wrapped.soup;
      mesh.report = check_soup(mesh.soup);
      return mesh;
    } catch (const InputError& error) {
      if (why.empty()) why = error.what();
    }
  }
  refuse(why);
  return mesh;
}

ImportedMesh import_mesh(const std::string& path, double unit_m, const ImportLimits& limits) {
  const auto refuse = [&](const std::string& why) { throw InputError(path + ": " + why); };
  check_unit(path, unit_m);

  ImportedMesh mesh;
  mesh.soup = read_mesh_file(path, limits);
  for (Vec3& p : mesh.soup.vertices_body_m) p *= unit_m;
  mesh.mended = mend(mesh.soup);
  if (mesh.soup.triangles.empty()) refuse("all triangles are degenerate");
  mesh.report = check_soup(mesh.soup);
  if (!mesh.report.valid()) refuse(not_a_surface(mesh.report));
  refuse_slivers(mesh.soup, path);
  if (const SelfIntersections found = find_self_intersections(mesh.soup); !found.pairs.empty() || !found.complete) {
    refuse(goes_through_itself(found));
  }
  return mesh;
}

}  // namespace sectio
