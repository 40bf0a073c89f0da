// The frame that a viewer would draw of a scene, simulated in this process without a network.
#pragma once

#include "render_client/draw/draw_frame.h"
#include "sim_server/simulation.h"

namespace sectio {

// Has the bodies and the camera, no instruments and no floor.
inline Frame frame_of(const Scene& scene, Simulation& simulation) {
  Frame frame;
  frame.session = scene.session;
  frame.camera = scene.camera;
  for (std::uint32_t b = 0; b < simulation.body_count(); ++b) {
    const TriangleMesh& mesh = simulation.mesh(b);
    const auto positions = simulation.positions_world_m(b);
    BodyFrame& body = frame.bodies.emplace_back();
    body.name = simulation.body(b).name;
    body.revision = mesh.revision();
    body.skin_colour = simulation.body(b).skin_colour;
    body.wall_colour = simulation.body(b).wall_colour;
    body.regions = simulation.body(b).regions;
    body.surface = simulation.body(b).surface;
    body.layers = simulation.body(b).layers;
    for (const Vec3& rest : mesh.rest_body_m()) body.rest_body_m.push_back(rest.cast<float>());
    body.positions_world_m.assign(positions.begin(), positions.end());
    body.triangles.assign(mesh.triangles().begin(), mesh.triangles().end());
    body.scalars = simulation.scalars(b);
  }
  return frame;
}

}  // namespace sectio
