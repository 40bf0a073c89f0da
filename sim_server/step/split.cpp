
#include <algorithm>
#include <utility>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "sim_server/body_contact/mass_properties.h"
#include "sim_server/components/leave.h"
#include "sim_server/step/commit.h"
#include "sim_server/step/step.h"

namespace sectio {
namespace {

bool is_anchored(const Body& body, const Part& part) {
  return std::ranges::any_of(part.vertices, [&](VertexId v) { return body.engines.deformation->fixed(v); });
}

// The parts that leave. The search never lists the component that it did not see whole.
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

std::unique_ptr<Body> make_body(Body& parent, Leaving& leaving, const BodySpec& spec, const Scene& scene,
                                std::uint32_t id, const Pose& frame) {
  ParticleState state;
  state.resize(leaving.vertex_from.size());
  const ParticleView now = parent.particle_view();
  for (std::size_t v = 0; v < state.size(); ++v)
    state.place(v, now.position(leaving.vertex_from[v]), now.velocity(leaving.vertex_from[v]));
  return std::make_unique<Body>(spec, scene, id, parent.make_engines(), std::move(leaving.mesh), std::move(state),
                                frame, &parent, leaving.vertex_from);
}

void announce_removed(double volume_m3, std::uint32_t parent_id, StepContext& context) {
  context.output.report.removed_volume_m3 += volume_m3;
  context.emit(EventKind::fragment_removed, parent_id, 0, formatted("%.3g mm3", volume_m3 * 1e9));
}

// The component with fixed vertices stays the body: the largest if there are several, and the largest of all if no
// component is fixed. Parts stay in a body that keeps them, and beyond the number of bodies that a session can
// announce; crumbs stay in none.
void split_body(SimulatedWorld& world, StepContext& context, std::uint32_t body_id) {
  Body& body = *world.bodies[body_id];
  if (body.unsettled.empty()) return;
  const std::vector<TriangleId> changed = std::exchange(body.unsettled, {});
  for (const Part& part : leaving_parts(body, body.engines.splitting->separated(body.shared(), changed))) {
    if (body.engines.cutting->is_temporary(part.triangles)) {
      body.unsettled = changed;
      continue;
    }
    const bool anchored = is_anchored(body, part);
    Leaving leaving = leave(body.mesh, part);
    const double volume_m3 = mass_properties(leaving.mesh.rest_body_m(), leaving.mesh.triangles(), 1).volume_m3;
    const bool crumb = !anchored && volume_m3 < body.spec.splitting.least_volume_m3;
    const bool stays = body.spec.splitting.free_parts == FreeParts::keep || world.bodies.size() >= world.most_bodies;
    if (!crumb && stays) continue;
    if (!crumb) {
      const BodySpec& spec = world.add_part_spec(body, anchored);
      std::unique_ptr<Body> made =
          make_body(body, leaving, spec, world.scene, static_cast<std::uint32_t>(world.bodies.size()),
                    body.frame_world(part.vertices.front()));
      welcome_part(world, context, body_id, std::move(made), leaving.vertex_from);
    }
    const bool left = commit(world, context, body_id, {Cause::part_left, std::move(leaving.delta), {}});
    SECTIO_ASSERT(left, "a whole part can be removed");
    static_cast<void>(left);
    if (crumb) announce_removed(volume_m3, body_id, context);
  }
}

}  // namespace

void split(SimulatedWorld& world, StepContext& context) {
  for_each_body(world, context, [&](std::uint32_t b) { split_body(world, context, b); });
}

}  // namespace sectio
