#include "sim_server/world/surface_under_tool.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace sectio {
namespace {

// A flat punch of radius a moves the surface at a distance r by 2/pi asin(a/r) of its own way (Sneddon 1965): beyond
// these 15 mm, a tip of 2 mm by less than a tenth.
constexpr double kDent_m = 0.015, kAround_m = 0.03;
constexpr double kPoint_m = 0.0015;                     // a point presses as a punch of this radius
constexpr double kMostShare = 0.4, kShareKept_s = 0.5;  // largest share of a dent's motion at vertices beyond it
constexpr double kOnSurface_m = 5e-4;
constexpr double kFlat_m = 1e-6;     // a shortest way below this has no direction
constexpr std::size_t kEnough = 6;   // vertices whose motion counts as that of the surface
constexpr VertexId kLookedAt = 256;  // vertices of a body at most, evenly chosen: a fit of six numbers needs no more

// A corner of an instrument, with the ball about it.
struct Corner {
  Vec3 at_world_m;
  double radius_m;
};

std::vector<Corner> corners_of(const ToolSpec& tool, const JointPose& pose) {
  const InstrumentKind& kind = instrument_of(tool.kind);
  std::vector<Corner> corners;
  for (std::size_t edge = 0; edge < kind.edges; ++edge) {
    const InstrumentShape shape = kind.shape(tool.geometry, {tool.intensity, pose.opening_rad, edge});
    corners.push_back({pose.to_world(shape.a_tool_m), tool.geometry.sphere_radius_m});
    for (const Vec3& corner : {shape.b_tool_m, shape.c_tool_m}) corners.push_back({pose.to_world(corner), 0});
    if (!kind.front_is_virtual) corners.push_back({pose.to_world(shape.d_tool_m), 0});
  }
  return corners;
}

}  // namespace

std::optional<SurfaceUnderTool> nearest_surface(std::span<const std::unique_ptr<Body>> bodies, const ToolSpec& tool,
                                                const JointPose& pose, double reach_m) {
  const std::vector<Corner> corners = corners_of(tool, pose);
  std::optional<SurfaceUnderTool> nearest;
  bool outside = true;
  double within_m = reach_m;
  for (const auto& body : bodies) {
    const Box3 box = body->bounds_world_m();
    for (const Corner& corner : corners) {
      if (box.isEmpty() || box.exteriorDistance(corner.at_world_m) > within_m + corner.radius_m) continue;
      const auto found = body->tree().closest(body->view(), corner.at_world_m, within_m + corner.radius_m);
      if (!found) continue;
      const Vec3 way = corner.at_world_m - found->point_world_m, flat = body->view().normal(found->triangle);
      outside = way.dot(flat) > -kFlat_m;
      within_m = std::max(0.0, found->distance_m - corner.radius_m);
      nearest = {body->id, found->triangle, found->point_world_m, way.norm() > kFlat_m ? way.normalized() : flat,
                 within_m};
    }
  }
  return outside ? nearest : std::nullopt;
}

Vec3 velocity_at(const Body& body, TriangleId triangle, const Vec3& point_world_m) {
  if (body.asleep() || body.frozen) return Vec3::Zero();
  return body.velocity_at(body.mesh.triangle(triangle).v, Vec3::Constant(1.0 / 3), point_world_m);
}

SurfaceMotion motion_beyond_dent(const Body& body, const Vec3& point_world_m) {
  const ParticleView now = body.particle_view();
  const bool rests = body.asleep() || body.frozen;
  std::vector<MovingPoint> near, beyond, moved, moved_beyond;
  const VertexId stride = 1 + body.mesh.vertex_slots() / kLookedAt;
  for (VertexId v = 0; v < body.mesh.vertex_slots(); v += stride) {
    const Vec3 at = now.position(v);
    const double distance_m = (at - point_world_m).norm();
    if (distance_m > kAround_m || !body.mesh.vertex_alive(v)) continue;
    near.push_back({at, now.velocity(v), 1});
    moved.push_back({at, at - body.undeformed_world_m({v, kNone, kNone}, Vec3::UnitX()), 1});
    if (distance_m > kDent_m) beyond.push_back(near.back()), moved_beyond.push_back(moved.back());
  }
  const bool enough = beyond.size() >= kEnough;
  return {rigid_velocity(enough ? moved_beyond : moved).at(point_world_m),
          rests ? Vec3(Vec3::Zero()) : rigid_velocity(enough ? beyond : near).at(point_world_m)};
}

void OwnDent::learn(const Vec3& around_m_per_s, const Vec3& tool_m_per_s, double step_s) {
  const Vec3 against = tool_m_per_s - around_m_per_s;
  const double keeps = std::exp(-step_s / kShareKept_s);
  along_m2_per_s2_ = keeps * along_m2_per_s2_ + step_s * around_m_per_s.dot(against);
  square_m2_per_s2_ = keeps * square_m2_per_s2_ + step_s * against.squaredNorm();
}

double OwnDent::share() const {
  return square_m2_per_s2_ > 0 ? std::clamp(along_m2_per_s2_ / square_m2_per_s2_, 0.0, kMostShare) : 0;
}

std::optional<RestSurface> rest_surface(Body& body, const Vec3& near_world_m) {
  auto at = body.tree().closest(body.view(), near_world_m, kOnSurface_m);  // usually it is there: this looks at little
  if (!at) at = body.tree().closest(body.view(), near_world_m, kDent_m);
  if (!at) return std::nullopt;
  const auto& v = body.mesh.triangle(at->triangle).v;
  return RestSurface{body.undeformed_world_m(v, at->bary),
                     body.undeformed_normal_world(MeshDraft(body.mesh, body.particle_view()), v, at->bary)};
}

double gap_m(const ToolSpec& tool, const JointPose& pose, const Vec3& point_world_m, const Vec3& normal_world) {
  double least_m = std::numeric_limits<double>::infinity();
  for (const Corner& corner : corners_of(tool, pose))
    least_m = std::min(least_m, normal_world.dot(corner.at_world_m - point_world_m) - corner.radius_m);
  return least_m;
}

// Hertz's stiffness under a ball where its force goes over to a straight line: 2 E* sqrt(R d).
FeltTissue felt_tissue(Body& body, const Vec3& near_world_m, const ToolSpec& tool, ContactState state) {
  const MaterialSpec& m = body.spec.material;
  FeltTissue tissue;
  const double radius_m = tool.geometry.sphere_radius_m > 0 ? tool.geometry.sphere_radius_m : kPoint_m;
  tissue.stiffness_n_per_m =
      2 * m.young_pa / (1 - m.poisson * m.poisson) * std::sqrt(radius_m * ContactModel{}.soft_depth_m);
  if (vary_in_stiffness(body.spec.regions))
    if (const auto at = body.tree().closest(body.view(), near_world_m, kDent_m))
      tissue.stiffness_n_per_m *=
          stiffness_factor_at(body.spec.regions, body.mesh.rest_body_m(body.mesh.triangle(at->triangle).v[0]));
  tissue.damping_per_s = m.damping_per_s;
  tissue.friction = m.friction;
  const auto& threshold_n = body.spec.cutting.threshold_force_n;
  if (instrument_of(tool.kind).tip_pierces && state != ContactState::penetration && threshold_n)
    tissue.yield_n = std::min(*threshold_n, kNeverYields_n);
  return tissue;
}

}  // namespace sectio
