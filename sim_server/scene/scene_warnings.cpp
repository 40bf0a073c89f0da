#include "sim_server/scene/scene_warnings.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "common/core/formatted.h"
#include "common/math/disjoint_sets.h"
#include "common/math/intersect.h"
#include "common/math/solid_angle.h"

namespace sectio {
namespace {

constexpr double kFar_m = 0.05;           // an instrument that stays further away has another frame or unit
constexpr std::size_t kMoments = 200;     // moments of a trace that are looked at
constexpr std::size_t kMostPoints = 500;  // points of a body that are looked for in another
constexpr double kBeneath = 0.05;         // share of a triangle's size
constexpr double kOutlasts_s = 0.01;
constexpr double kBelowFloor_m = 0.001;
constexpr double kOffSurface_m = 0.01;   // a line to cut
constexpr std::size_t kMostOnLine = 50;  // points of a line that are looked at
constexpr double kFarCamera_m = 10;      // no scene is so large
constexpr double kLargestBox_m = 20;

// All soft tissue lies within.
constexpr double kSoftest_pa = 100, kStiffest_pa = 1e7;
constexpr double kLightest_kg_per_m3 = 200, kHeaviest_kg_per_m3 = 3000;

using Box3 = Eigen::AlignedBox3d;

std::vector<Vec3> in_world(const BodySpec& body) {
  std::vector<Vec3> points;
  for (const Vec3& p : body.mesh.vertices_body_m) points.push_back(body.pose.to_world(p));
  return points;
}

Box3 box_of(const std::vector<Vec3>& points) {
  Box3 box;
  for (const Vec3& p : points) box.extend(p);
  return box;
}

// Points just beneath the middles of a body's triangles: bodies whose surfaces coincide have these inside each other.
std::vector<Vec3> beneath_surface(const std::vector<Vec3>& vertices, const TriangleSoup& soup) {
  std::vector<Vec3> points;
  for (const auto& [a, b, c] : soup.triangles) {
    const Vec3 area = (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]);
    const double beneath_m = kBeneath * std::sqrt(area.norm());
    points.push_back((vertices[a] + vertices[b] + vertices[c]) / 3 - beneath_m * area.stableNormalized());
  }
  return points;
}

bool reaches_into(const BodySpec& body, const BodySpec& other) {
  const std::vector<Vec3> around = in_world(other);
  const Box3 box = box_of(around);
  std::vector<Vec3> points = in_world(body);
  const std::vector<Vec3> beneath = beneath_surface(points, body.mesh);
  points.insert(points.end(), beneath.begin(), beneath.end());
  std::vector<Vec3> candidates;
  for (const Vec3& p : points)
    if (box.contains(p)) candidates.push_back(p);
  const std::size_t stride = 1 + candidates.size() / kMostPoints;
  for (std::size_t i = 0; i < candidates.size(); i += stride)
    if (is_inside(candidates[i], around, other.mesh.triangles)) return true;
  return false;
}

void check_material(const BodySpec& body, std::vector<std::string>& warnings) {
  const MaterialSpec& m = body.material;
  if (m.young_pa < kSoftest_pa || m.young_pa > kStiffest_pa)
    warnings.push_back(body.name +
                       formatted(": young_pa is %.4g; soft tissue has %.4g Pa to 10 MPa", m.young_pa, kSoftest_pa));
  if (m.density_kg_per_m3 < kLightest_kg_per_m3 || m.density_kg_per_m3 > kHeaviest_kg_per_m3)
    warnings.push_back(body.name + formatted(": density_kg_per_m3 is %.4g; tissue has %.4g to 3000 kg/m3",
                                             m.density_kg_per_m3, kLightest_kg_per_m3));
}

// The vertices that are simulated, in the frame of the mesh.
const std::vector<Vec3>& particles_of(const BodySpec& body) {
  return body.tets.tetrahedra.empty() ? body.mesh.vertices_body_m : body.tets.vertices_body_m;
}

// A part that hangs together.
struct Piece {
  Box3 box;
  bool held = false;
};

std::vector<Piece> pieces_of(const BodySpec& body) {
  const std::vector<Vec3>& at = particles_of(body);
  DisjointSets together(at.size());
  const auto for_each_cell = [&](const auto& act) {
    if (body.tets.tetrahedra.empty())
      std::ranges::for_each(body.mesh.triangles, act);
    else
      std::ranges::for_each(body.tets.tetrahedra, act);
  };
  for_each_cell([&](const auto& cell) {
    for (const std::uint32_t v : cell) together.join(v, cell[0]);
  });
  std::map<std::uint32_t, Piece> pieces;  // by root
  for_each_cell([&](const auto& cell) {
    for (const std::uint32_t v : cell) {
      Piece& piece = pieces[together.root(v)];
      piece.box.extend(at[v]);
      piece.held = piece.held || body.holds(at[v]);
    }
  });
  std::vector<Piece> all;
  all.reserve(pieces.size());
  for (const auto& [v, piece] : pieces) all.push_back(piece);
  return all;
}

void check_hold(const BodySpec& body, const Scene& scene, std::vector<std::string>& warnings) {
  if (scene.floor_z_m || scene.gravity_m_per_s2.norm() == 0) return;
  const std::vector<Piece> pieces = pieces_of(body);
  // The surface of a cavity hangs together with that around it.
  const auto is_cavity = [&](const Piece& piece) {
    const auto surrounds = [&](const Piece& other) { return &other != &piece && other.box.contains(piece.box); };
    return body.tets.tetrahedra.empty() && std::ranges::any_of(pieces, surrounds);
  };
  const auto falls = [&](const Piece& piece) { return !piece.held && !is_cavity(piece); };
  const auto falling = std::ranges::count_if(pieces, falls);
  if (falling == 0) return;
  if (falling == std::ssize(pieces))
    warnings.push_back(body.name +
                       ": nothing holds it, so it falls: `fixed` has none of its vertices, and there is no floor");
  else
    warnings.push_back(body.name + ": " + std::to_string(falling) + " of its " + std::to_string(pieces.size()) +
                       " parts fall: `fixed` has none of their vertices, and there is no floor");
}

// A tray may well be held as a whole; a box in millimetres holds an organ so.
void check_fixed(const BodySpec& body, std::vector<std::string>& warnings) {
  if (!body.fixed || body.mesh.vertices_body_m.empty()) return;
  const double size_m = (body.fixed->max_world_m - body.fixed->min_world_m).norm();
  const auto holds = [&](const Vec3& p) { return body.fixed->contains(p); };
  if (size_m > kLargestBox_m && std::ranges::all_of(in_world(body), holds))
    warnings.push_back(body.name +
                       formatted(": `fixed` is %.4g m across and holds all of it; has it another unit?", size_m));
}

void check_camera(const Scene& scene, std::vector<std::string>& warnings) {
  const auto far = [&](const BodySpec& body) {
    const Box3 box = box_of(in_world(body));
    return !box.isEmpty() && box.exteriorDistance(scene.camera.eye_world_m) > kFarCamera_m;
  };
  if (std::ranges::all_of(scene.bodies, far) && scene.bodies.size() == scene.world_bodies.size())
    warnings.push_back(formatted("camera: no body is within %.4g m of it; has it another unit?", kFarCamera_m));
}

// The floor lifts what lies in it before the first picture.
void check_floor(const BodySpec& body, const Scene& scene, std::vector<std::string>& warnings) {
  if (!scene.floor_z_m || body.mesh.vertices_body_m.empty()) return;
  const double below_m = *scene.floor_z_m - box_of(in_world(body)).min().z();
  if (below_m > kBelowFloor_m)
    warnings.push_back(
        body.name + formatted(": it reaches %.4g mm below the floor at z = %.4g m", 1e3 * below_m, *scene.floor_z_m));
}

void check_regions(const BodySpec& body, std::vector<std::string>& warnings) {
  const Box3 box = box_of(particles_of(body));
  for (const Region& region : body.regions) {
    const auto reaches = [&](const RegionPart& part) {
      return may_reach(part, box.center(), 0.5 * box.diagonal().norm());
    };
    if (!box.isEmpty() && std::ranges::none_of(region.parts, reaches))
      warnings.push_back(body.name + ": its region " + region.name +
                         " is outside of it; shapes are in the frame of the mesh, in metres");
  }
}

void check_plan(const BodySpec& body, std::vector<std::string>& warnings) {
  const PlanSpec& plan = body.plan;
  if (!plan.cut_cpu_estimate || *plan.cut_cpu_estimate <= plan.cpu_budget) return;
  warnings.push_back(body.name + formatted(": while it is cut it is expected to cost %.2g s of the processor's time a "
                                           "second; its cpu_budget is %.2g",
                                           *plan.cut_cpu_estimate, plan.cpu_budget));
}

bool comes_near(const ToolSpec& tool, const std::vector<Vec3>& vertices) {
  Box3 box = box_of(vertices);
  box.min().array() -= kFar_m;
  box.max().array() += kFar_m;
  const InstrumentKind& kind = instrument_of(tool.kind);
  for (const TracePoint& at : moments_of(tool.trace, kMoments)) {
    const InstrumentShape shape = kind.shape(tool.geometry, {tool.intensity, at.opening_rad, 0});
    for (const auto& [one, other] : {std::pair(shape.a_tool_m, shape.b_tool_m),
                                     {shape.c_tool_m, shape.d_tool_m},
                                     {shape.edge_tip_tool_m, shape.edge_heel_tool_m}}) {
      const Vec3 from = at.pose_world.to_world(one), to = at.pose_world.to_world(other);
      if (!box.intersects(Box3(from.cwiseMin(to), from.cwiseMax(to)))) continue;
      for (const Vec3& v : vertices)
        if (distance_to_segment(v, from, to) < kFar_m) return true;
    }
  }
  return false;
}

// Scissors that cut close; a forceps that holds does so below an angle.
void check_opening(const ToolSpec& tool, std::vector<std::string>& warnings) {
  const InstrumentKind& kind = instrument_of(tool.kind);
  if (tool.trace.empty() || (!kind.only_closing && kind.grip_below_rad == 0)) return;
  const double first_rad = tool.trace.front().opening_rad;
  if (std::ranges::all_of(tool.trace, [&](const TracePoint& at) { return at.opening_rad == first_rad; }))
    warnings.push_back("tool " + tool.name +
                       formatted(": its jaws never move: opening_rad is %.4g in all of its trace", first_rad));
}

void check_trace(const ToolSpec& tool, const Scene& scene, double duration_s, std::vector<std::string>& warnings) {
  if (tool.trace.empty()) return;
  const double begin_s = tool.trace.front().time_s, end_s = tool.trace.back().time_s;
  if (begin_s < 0)
    warnings.push_back("tool " + tool.name +
                       formatted(": its trace begins at %.4g s; what is before 0 is not played", begin_s));
  if (end_s > duration_s + kOutlasts_s)
    warnings.push_back(
        "tool " + tool.name +
        formatted(": its trace lasts %.4g s, the run %.4g s; the rest is not played", end_s, duration_s));
  if (scene.bodies.size() < scene.world_bodies.size()) return;  // it may be meant for a body of another server
  const auto near = [&](const BodySpec& body) { return comes_near(tool, in_world(body)); };
  if (std::ranges::none_of(scene.bodies, near))
    warnings.push_back("tool " + tool.name +
                       ": its trace is never within 5 cm of a body; has it another frame or unit?");
}

void check_gravity(const Scene& scene, double duration_s, std::vector<std::string>& warnings) {
  for (const GravityChange& change : scene.gravity_changes)
    if (change.at_s >= duration_s)
      warnings.push_back(
          formatted("gravity_changes: the run lasts %.4g s; nothing changes at %.4g s", duration_s, change.at_s));
}

double from_surface_m(const Vec3& p, const TriangleSoup& surface) {
  double least = HUGE_VAL;
  for (const auto& [a, b, c] : surface.triangles) {
    const Corners corners{surface.vertices_body_m[a], surface.vertices_body_m[b], surface.vertices_body_m[c]};
    least = std::min(least, closest_on_triangle(p, corners).squared_distance);
  }
  return std::sqrt(least);
}

// A line in the air, and a bin for parts that can't come off.
void check_exercise(const Scene& scene, std::vector<std::string>& warnings) {
  const auto body = std::ranges::find(scene.bodies, scene.exercise->body, &BodySpec::name);
  if (body == scene.bodies.end()) return;
  if (scene.exercise->bin && body->splitting.free_parts == FreeParts::keep)
    warnings.push_back("exercise: nothing can come into the bin: parts stay with " + body->name +
                       " (splitting: {free_parts: keep})");
  if (!scene.exercise->line) return;
  const std::vector<Vec3>& line = scene.exercise->line->points_body_m;
  double furthest_m = 0;
  for (std::size_t i = 0; i < line.size(); i += 1 + line.size() / kMostOnLine)
    furthest_m = std::max(furthest_m, from_surface_m(line[i], body->mesh));
  if (furthest_m > kOffSurface_m)
    warnings.push_back(formatted("exercise: its line is up to %.3g mm from the surface of ", 1e3 * furthest_m) +
                       body->name);
}

}  // namespace

std::vector<std::string> scene_warnings(const Scene& scene, double duration_s) {
  std::vector<std::string> warnings;
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    check_material(scene.bodies[b], warnings);
    check_hold(scene.bodies[b], scene, warnings);
    check_fixed(scene.bodies[b], warnings);
    check_floor(scene.bodies[b], scene, warnings);
    check_regions(scene.bodies[b], warnings);
    check_plan(scene.bodies[b], warnings);
    for (std::size_t other = 0; other < b; ++other)
      if (reaches_into(scene.bodies[b], scene.bodies[other]) || reaches_into(scene.bodies[other], scene.bodies[b]))
        warnings.push_back(scene.bodies[other].name + " and " + scene.bodies[b].name + " overlap at the start");
  }
  check_camera(scene, warnings);
  check_gravity(scene, duration_s, warnings);
  if (scene.exercise) check_exercise(scene, warnings);
  for (const ToolSpec& tool : scene.tools) {
    check_opening(tool, warnings);
    check_trace(tool, scene, duration_s, warnings);
  }
  return warnings;
}

}  // namespace sectio
