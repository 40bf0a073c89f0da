// An organ: a geodesic sphere is put on the implicit shape; then vertices move to the middle of their neighbourhood and
// back to the surface, and edges flip as Delaunay's do, until triangles are even. A bar or sheet: a grid on each side.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "common/mesh/check.h"
#include "common/mesh/obj_text.h"
#include "deploy/meshes/paper_box.h"
#include "deploy/meshes/shapes.h"

namespace sectio {
namespace {

struct Recipe {
  const char* name;
  std::function<std::string(const char* name)> text;  // the file's text; empty when the mesh is broken
  const char* ending = ".obj";
};

using Corners = std::array<VertexId, 3>;

TriangleSoup geodesic_sphere(int n) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  const std::array<Vec3, 12> corner{{{-1, g, 0},
                                     {1, g, 0},
                                     {-1, -g, 0},
                                     {1, -g, 0},
                                     {0, -1, g},
                                     {0, 1, g},
                                     {0, -1, -g},
                                     {0, 1, -g},
                                     {g, 0, -1},
                                     {g, 0, 1},
                                     {-g, 0, -1},
                                     {-g, 0, 1}}};
  constexpr std::array<std::array<std::size_t, 3>, 20> kFaces{
      {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
       {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
       {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
  TriangleSoup soup;
  std::map<std::array<long, 3>, VertexId> known;
  const auto vertex = [&](const Vec3& p) {
    const auto grid = [](double x) { return std::lround(x * 1e7); };
    const auto [entry, is_new] =
        known.try_emplace({grid(p.x()), grid(p.y()), grid(p.z())}, static_cast<VertexId>(soup.vertices_body_m.size()));
    if (is_new) soup.vertices_body_m.push_back(p.normalized());
    return entry->second;
  };
  for (const auto& face : kFaces) {
    const auto at = [&](int i, int j) {
      const Vec3 &a = corner[face[0]], &b = corner[face[1]], &c = corner[face[2]];
      return vertex(a + (b - a) * (double(i) / n) + (c - a) * (double(j) / n));
    };
    for (int i = 0; i < n; ++i) {
      for (int j = 0; i + j < n; ++j) {
        soup.triangles.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
        if (i + j + 1 < n) soup.triangles.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
      }
    }
  }
  return soup;
}

class Relaxation {
 public:
  Relaxation(TriangleSoup& soup, const ImplicitShape& shape)
      : p_(soup.vertices_body_m), triangles_(soup.triangles), shape_(shape) {}

  void put_on_shape() {
    for (Vec3& p : p_) p = first_hit(shape_, 0.3 * p, Vec3::Zero());
  }

  // Each vertex goes to the mean of the centres of its triangles, weighted by area, which evens out areas.
  void smooth() {
    std::vector<Vec3> sum(p_.size(), Vec3::Zero()), normal(p_.size(), Vec3::Zero());
    std::vector<double> weight(p_.size(), 0);
    for (const Corners& t : triangles_) {
      const Vec3 centre = (p_[t[0]] + p_[t[1]] + p_[t[2]]) / 3;
      const Vec3 area = (p_[t[1]] - p_[t[0]]).cross(p_[t[2]] - p_[t[0]]);
      for (const VertexId v : t) {
        sum[v] += area.norm() * centre;
        weight[v] += area.norm();
        normal[v] += area;
      }
    }
    for (VertexId v = 0; v < p_.size(); ++v) {
      const Vec3 n = normal[v].normalized(), move = sum[v] / weight[v] - p_[v];
      p_[v] = projected(shape_, p_[v] + 0.9 * (move - n * n.dot(move)));
    }
  }

  // Flips each edge whose opposite angles add up to more than half a turn.
  void flip() {
    struct HalfEdge {
      VertexId low, high;
      std::uint32_t triangle;
      std::size_t apex;
    };
    std::vector<HalfEdge> edges;
    std::vector<int> valence(p_.size(), 0);
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      for (std::size_t i = 0; i < 3; ++i) {
        const VertexId a = triangles_[t][i], b = triangles_[t][(i + 1) % 3];
        edges.push_back({std::min(a, b), std::max(a, b), t, (i + 2) % 3});
        ++valence[a];
      }
    }
    std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
      return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
    });
    const auto exists = [&](VertexId a, VertexId b) {
      const std::pair key(std::min(a, b), std::max(a, b));
      const auto at = std::lower_bound(edges.begin(), edges.end(), key,
                                       [](const HalfEdge& e, const auto& k) { return std::pair(e.low, e.high) < k; });
      return at != edges.end() && std::pair(at->low, at->high) == key;
    };
    std::vector<std::uint8_t> touched(p_.size(), 0);
    for (std::size_t i = 0; i + 1 < edges.size(); i += 2) {
      const std::uint32_t s = edges[i].triangle, t = edges[i + 1].triangle;
      const VertexId c = triangles_[s][edges[i].apex], d = triangles_[t][edges[i + 1].apex];
      const VertexId a = triangles_[s][(edges[i].apex + 1) % 3], b = triangles_[s][(edges[i].apex + 2) % 3];
      if (touched[a] || touched[b] || touched[c] || touched[d]) continue;
      if (valence[a] <= 4 || valence[b] <= 4 || cotangent(c, a, b) + cotangent(d, a, b) > -1e-9) continue;
      if (exists(c, d) || normal(a, d, c).dot(normal(d, b, c)) <= 0) continue;
      triangles_[s] = {a, d, c};
      triangles_[t] = {d, b, c};
      for (const VertexId v : {a, b, c, d}) touched[v] = 1;
    }
  }

 private:
  double cotangent(VertexId at, VertexId a, VertexId b) const {
    const Vec3 u = p_[a] - p_[at], v = p_[b] - p_[at];
    return u.dot(v) / std::max(u.cross(v).norm(), 1e-30);
  }
  Vec3 normal(VertexId a, VertexId b, VertexId c) const { return (p_[b] - p_[a]).cross(p_[c] - p_[a]); }

  std::vector<Vec3>& p_;
  std::vector<Corners>& triangles_;
  const ImplicitShape& shape_;
};

double least_angle_deg(const TriangleSoup& soup) {
  double greatest_cosine = -1;
  for (const Corners& t : soup.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3& a = soup.vertices_body_m[t[i]];
      const Vec3 u = soup.vertices_body_m[t[(i + 1) % 3]] - a, v = soup.vertices_body_m[t[(i + 2) % 3]] - a;
      greatest_cosine = std::max(greatest_cosine, u.dot(v) / (u.norm() * v.norm()));
    }
  }
  return std::acos(greatest_cosine) * 180 / M_PI;
}

TriangleSoup organ(const ImplicitShape& shape, int frequency, int rounds) {
  TriangleSoup soup = geodesic_sphere(frequency);  // 20 frequency^2 triangles
  Relaxation relaxation(soup, shape);
  relaxation.put_on_shape();
  for (int round = 0; round < rounds; ++round) {
    relaxation.smooth();
    if (round % 4 == 0 || round + 1 == rounds) relaxation.flip();
  }
  return soup;
}

// A box around the origin; the diagonals of neighbouring cells mirror each other.
TriangleSoup bar(const std::array<int, 3>& cells, double cell_m) {
  TriangleSoup soup;
  std::map<std::array<int, 3>, VertexId> known;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const bool far : {false, true}) {
      const std::size_t u = (axis + (far ? 1 : 2)) % 3, w = (axis + (far ? 2 : 1)) % 3;  // u, w, outwards: right-handed
      for (int i = 0; i < cells[u]; ++i)
        for (int j = 0; j < cells[w]; ++j) {
          const auto at = [&](int di, int dj) {
            std::array<int, 3> c{};
            c[axis] = far ? cells[axis] : 0;
            c[u] = i + di;
            c[w] = j + dj;
            const auto [entry, is_new] = known.try_emplace(c, static_cast<VertexId>(soup.vertices_body_m.size()));
            if (is_new)
              soup.vertices_body_m.push_back(cell_m *
                                             Vec3(c[0] - 0.5 * cells[0], c[1] - 0.5 * cells[1], c[2] - 0.5 * cells[2]));
            return entry->second;
          };
          const VertexId a = at(0, 0), b = at(1, 0), c = at(1, 1), d = at(0, 1);
          if ((i + j) % 2 == 0)
            soup.triangles.insert(soup.triangles.end(), {{a, b, c}, {a, c, d}});
          else
            soup.triangles.insert(soup.triangles.end(), {{a, b, d}, {b, c, d}});
        }
    }
  return soup;
}

std::string described(const char* name, const TriangleSoup& soup) {
  const SurfaceReport report = check_soup(soup);
  Eigen::AlignedBox3d box;
  for (const Vec3& p : soup.vertices_body_m) box.extend(p);
  const Vec3 size_mm = 1000 * box.sizes();
  std::printf("%s: %u triangles, %.0f x %.0f x %.0f mm, %.4f L, least angle %.1f deg%s%s\n", name, report.triangles,
              size_mm.x(), size_mm.y(), size_mm.z(), 1000 * report.volume_m3, least_angle_deg(soup),
              report.valid() ? "" : ", BROKEN: ", report.first_defect.c_str());
  return report.valid() ? obj_text(soup, std::string(name) + ", made by make_meshes; unit: m") : "";
}

std::string described(const char* name, const TetMesh& mesh) {
  const TetReport report = check(mesh);
  std::printf("%s: %u vertices, %u tetrahedra, %.4f L, least dihedral angle %.1f deg%s%s\n", name, report.vertices,
              report.tetrahedra, 1000 * report.volume_m3, report.smallest_dihedral_deg,
              report.valid ? "" : ", BROKEN: ", report.first_defect.c_str());
  return report.valid ? msh(mesh) : "";
}

// A tray for pieces, open above, 64 mm long, 20 mm high, 4 mm thick: the outside of the solid cells of a grid.
TriangleSoup tray(const std::vector<double>& across_mm) {
  const std::array<std::vector<double>, 3> lines_mm{
      {{-32, -28, -20, -12, -4, 4, 12, 20, 28, 32}, across_mm, {0, 4, 12, 20}}};
  using Cell = std::array<int, 3>;
  const auto cells = [&](std::size_t axis) { return static_cast<int>(lines_mm[axis].size()) - 1; };
  const auto solid = [&](const Cell& c) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (c[axis] < 0 || c[axis] >= cells(axis)) return false;
    return c[2] == 0 || c[0] == 0 || c[0] + 1 == cells(0) || c[1] == 0 || c[1] + 1 == cells(1);
  };
  TriangleSoup soup;
  std::map<Cell, VertexId> known;
  const auto vertex = [&](const Cell& c) {
    const auto [entry, is_new] = known.try_emplace(c, static_cast<VertexId>(soup.vertices_body_m.size()));
    const auto at = [&](std::size_t axis) { return 1e-3 * lines_mm[axis][static_cast<std::size_t>(c[axis])]; };
    if (is_new) soup.vertices_body_m.emplace_back(at(0), at(1), at(2));
    return entry->second;
  };
  for (int i = 0; i < cells(0); ++i)
    for (int j = 0; j < cells(1); ++j)
      for (int k = 0; k < cells(2); ++k)
        for (std::size_t axis = 0; axis < 3; ++axis)
          for (const int far : {0, 1}) {
            const Cell cell{i, j, k};
            Cell beyond = cell, corner = cell;
            beyond[axis] += 2 * far - 1;
            corner[axis] += far;
            if (!solid(cell) || solid(beyond)) continue;
            const std::size_t u = (axis + (far ? 1 : 2)) % 3, w = (axis + (far ? 2 : 1)) % 3;
            Cell b = corner, c = corner, d = corner;
            ++b[u], ++c[u], ++c[w], ++d[w];
            soup.triangles.push_back({vertex(corner), vertex(b), vertex(c)});
            soup.triangles.push_back({vertex(corner), vertex(c), vertex(d)});
          }
  return soup;
}

// A round cord along the upper half of an ellipse in the plane y = 0, 70 mm wide and 30 mm high; its ends are flat.
TriangleSoup arch(double radius_m, int along, int around) {
  TriangleSoup soup;
  std::vector<VertexId> ring, last;
  const auto add = [&](const Vec3& p) {
    soup.vertices_body_m.push_back(p);
    return static_cast<VertexId>(soup.vertices_body_m.size() - 1);
  };
  for (int i = 0; i <= along; ++i) {
    const double s = M_PI * i / along;
    const Vec3 middle(-0.035 * std::cos(s), 0, 0.030 * std::sin(s));
    const Vec3 ahead = Vec3(0.035 * std::sin(s), 0, 0.030 * std::cos(s)).normalized();
    const Vec3 out = ahead.cross(Vec3::UnitY());
    ring.clear();
    for (int k = 0; k < around; ++k) {
      const double turn = 2 * M_PI * (k + 0.5 * (i % 2)) / around;
      ring.push_back(add(middle + radius_m * (std::cos(turn) * Vec3::UnitY() - std::sin(turn) * out)));
    }
    const auto at = [&](const std::vector<VertexId>& of, int k) {
      return of[static_cast<std::size_t>((k + around) % around)];
    };
    if (i > 0)
      for (int k = 0; k < around; ++k) {
        const int shift = i % 2 == 0 ? 1 : 0;  // the ring before is half a vertex ahead
        soup.triangles.push_back({at(last, k), at(ring, k + shift), at(last, k + 1)});
        soup.triangles.push_back({at(ring, k), at(ring, k + 1), at(last, k + 1 - shift)});
      }
    if (i == 0 || i == along) {
      const VertexId centre = add(middle);
      for (int k = 0; k < around; ++k)
        if (i == 0)
          soup.triangles.push_back({centre, at(ring, k), at(ring, k + 1)});
        else
          soup.triangles.push_back({centre, at(ring, k + 1), at(ring, k)});
    }
    last = ring;
  }
  return soup;
}

const auto kRecipes = std::to_array<Recipe>({
    {"liver_2k", [](const char* name) { return described(name, organ(liver, 10, 400)); }},
    {"liver_10k", [](const char* name) { return described(name, organ(liver, 22, 1200)); }},
    {"liver_40k", [](const char* name) { return described(name, organ(liver, 45, 1500)); }},
    {"kidney_2k", [](const char* name) { return described(name, organ(kidney, 10, 400)); }},
    {"kidney_10k", [](const char* name) { return described(name, organ(kidney, 22, 1200)); }},
    {"kidney_40k", [](const char* name) { return described(name, organ(kidney, 45, 1500)); }},
    {"skin_pad", [](const char* name) { return described(name, organ(skin_pad, 18, 1200)); }},
    {"bar",
     [](const char* name) {
       return described(name, bar({40, 8, 8}, 0.0025));
     }},
    {"sheet",
     [](const char* name) {
       return described(name, bar({32, 20, 2}, 0.0025));
     }},
    {"vessel", [](const char* name) { return described(name, arch(0.005, 44, 12)); }},
    {"nerve", [](const char* name) { return described(name, arch(0.0025, 80, 12)); }},
    {"tray",
     [](const char* name) {
       return described(name, tray({-24, -20, -12, -4, 4, 12, 20, 24}));
     }},
    {"tray_wide",
     [](const char* name) {
       return described(name, tray({-28, -24, -16, -8, 0, 8, 16, 24, 28}));
     }},
    {"paper_box", [](const char* name) { return described(name, paper_box()); }, ".msh"},
});

int run(int argc, char** argv) {
  bool check_only = false;
  std::string directory;
  std::vector<std::string> names;
  Arguments arguments("make_meshes", "writes organ-like surfaces, a bar, a sheet and a box of tetrahedra, in metres");
  arguments.option("DIR", directory, "folder for the files", Need::required);
  arguments.option("NAME", names, "those to make; none: all");
  arguments.toggle("--check", check_only, "writes nothing; ends with 1 when a file there differs");
  if (!arguments.parse(argc, argv)) return 0;
  for (const std::string& name : names)
    if (std::ranges::find(kRecipes, name, &Recipe::name) == std::end(kRecipes))
      throw InputError(name + ": no such mesh");
  int failures = 0;
  for (const Recipe& recipe : kRecipes) {
    if (!names.empty() && std::ranges::find(names, recipe.name) == names.end()) continue;
    const std::string path = directory + "/" + recipe.name + recipe.ending, text = recipe.text(recipe.name);
    bool good = !text.empty();
    if (check_only) {
      std::ostringstream content;
      content << std::ifstream(path, std::ios::binary).rdbuf();
      good = good && content.str() == text;
    } else if (good) {
      good = bool(std::ofstream(path, std::ios::binary) << text);
    }
    if (!good) std::cerr << path << (check_only ? ": is not what this program makes\n" : ": not written\n");
    failures += !good;
  }
  return failures > 0;
}

}  // namespace
}  // namespace sectio

int main(int argc, char** argv) {
  return sectio::run_program("make_meshes", [&] { return sectio::run(argc, argv); });
}
