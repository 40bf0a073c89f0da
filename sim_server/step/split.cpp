#include "sim_server/step/split.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "sim_server/body_contact/mass_properties.h"
#include "sim_server/components/leave.h"

namespace sectio {
namespace {

constexpr std::size_t kLongestName = 64;  // that a session can announce

bool is_anchored(const Body& body, const Part& part) {
  return std::ranges::any_of(part.vertices, [&](VertexId v) { return body.engines.deformation->fixed(v); });
}

// A temporary subdivision is not a cut yet: it is undone before the next one is planned.
bool is_worked_on(const Body& body, const Part& part) {
  for (const Stroke& stroke : body.cuts.strokes) {
    if (!stroke.temporary_inverse) continue;
    for (const TriangleEdit& e : stroke.temporary_inverse->triangles)
      if (std::ranges::binary_search(part.triangles, e.id)) return true;
  }
  return false;
}

// The parts that leave; the search never lists the component that it didn't see whole.
std::vector<Part> leaving_parts(Body& body, PartSearch search) {
  if (search.parts.empty()) return {};
  std::uint32_t fixed_in_body = 0, fixed_in_parts = 0;
  for (VertexId v = 0; v < body.mesh.vertex_slots(); ++v) fixed_in_body += body.engines.deformation->fixed(v);
  Part* anchored = nullptr;
  for (Part& part : search.parts) {
    std::uint32_t fixed = 0;
    for (const VertexId v : part.vertices) fixed += body.engines.deformation->fixed(v);
    fixed_in_parts += fixed;
    if (fixed > 0 && (!anchored || part.triangles.size() > anchored->triangles.size())) anchored = &part;
  }
  if (anchored && fixed_in_body == fixed_in_parts)
    *anchored = body.engines.splitting->whole(body.shared(), search.rest);
  return std::move(search.parts);
}

BodySpec spec_of_part(const BodySpec& parent, std::uint32_t part, bool anchored) {
  BodySpec spec = parent;
  spec.mesh = {};
  spec.tets = {};
  spec.mesh_notes.clear();
  const std::string number = std::to_string(part);
  spec.name.resize(std::min(spec.name.size(), kLongestName - number.size() - 1));
  spec.name.append(1, '.').append(number);
  if (anchored) return spec;
  spec.fixed.reset();
  if (spec.splitting.free_parts == FreeParts::rigid) {  // it gives way before it can be cut
    spec.cutting.threshold_force_n = std::numeric_limits<double>::infinity();
    spec.cutting.threshold_displacement_m.reset();
  }
  return spec;
}

std::unique_ptr<Body> make_body(Body& parent, Leaving leaving, const BodySpec& spec, const Scene& scene,
                                std::uint32_t id, const Pose& frame) {
  ParticleState state;
  state.resize(leaving.vertex_from.size());
  for (std::size_t v = 0; v < state.size(); ++v) {
    state.position_world_m[v] = parent.particles.position_world_m[leaving.vertex_from[v]];
    state.velocity_world_m_per_s[v] = parent.particles.velocity_world_m_per_s[leaving.vertex_from[v]];
  }
  auto body = std::make_unique<Body>(spec, scene, id, parent.make_engines(), std::move(leaving.mesh), std::move(state),
                                     frame, &parent.engines, leaving.vertex_from);
  if (!spec.fixed && spec.splitting.free_parts == FreeParts::rigid) body->become_rigid();
  return body;
}

}  // namespace

Split split_body(Body& body, const Scene& scene, std::uint32_t next_id, std::uint32_t room,
                 std::deque<BodySpec>& specs) {
  Split result;
  if (body.unsettled.empty() || body.rigid) return result;
  const std::vector<TriangleId> changed = std::exchange(body.unsettled, {});
  for (const Part& part : leaving_parts(body, body.engines.splitting->separated(body.shared(), changed))) {
    if (is_worked_on(body, part)) {
      body.unsettled = changed;
      continue;
    }
    const bool anchored = is_anchored(body, part);
    Leaving leaving = leave(body.mesh, part);
    const double volume_m3 = mass_properties(leaving.mesh.rest_body_m(), leaving.mesh.triangles(), 1).volume_m3;
    const bool crumb = !anchored && volume_m3 < body.spec.splitting.least_volume_m3;
    if (!crumb && result.parts.size() == room) continue;
    const Pose frame = body.frame_world(part.vertices.front());
    result.deltas.push_back(leaving.delta);
    if (crumb) {
      result.removed_m3.push_back(volume_m3);
    } else {
      const std::uint32_t id = next_id + static_cast<std::uint32_t>(result.parts.size());
      const BodySpec& spec = specs.emplace_back(spec_of_part(body.spec, ++body.parts_made, anchored));
      result.vertex_from.push_back(leaving.vertex_from);
      result.parts.push_back(make_body(body, std::move(leaving), spec, scene, id, frame));
    }
    body.give_up(result.deltas.back());
  }
  return result;
}

}  // namespace sectio
