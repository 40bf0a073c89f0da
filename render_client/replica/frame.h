// A frame to draw: the whole state of one step on the topology of its own revision. The replica makes it and draw/
// reads it; it knows neither DDS nor OpenGL.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/material/looks.h"
#include "common/material/regions.h"
#include "common/math/camera.h"
#include "common/math/types.h"
#include "common/mesh/scalar_field.h"
#include "common/mesh/triangle_mesh.h"

namespace sectio {

struct BodyFrame {
  std::string name;
  std::uint64_t revision = 0;
  Vec3 skin_colour = Vec3::Constant(0.6);
  Vec3 wall_colour = Vec3::Constant(0.5);
  Regions regions;  // inside the body
  BodySurface surface = BodySurface::tissue;
  std::vector<TissueLayer> layers;  // in walls, from the skin down
  // One entry a slot; dead triangles have v[0] == kNone. A renderer renews its index buffers when the revision changes.
  std::vector<Vec3f> rest_body_m;
  std::vector<Vec3f> positions_world_m;
  std::vector<Triangle> triangles;
  std::vector<ScalarField> scalars;
};

struct ToolFrame {
  std::string name;
  std::string kind;  // the kind that a scene names
  bool present = false;
  JointPose pose_world;
  std::array<Vec3, 4> abcd_tool_m;  // A, B, C, D of paper B, figure 3
  double gauge_m = 0;               // between the edges of a U-form blade
};

struct Frame {
  std::string session;
  std::uint64_t arrangement = 0;  // another number: other bodies may have these names
  std::uint64_t step = 0;
  double sim_time_s = 0;
  double step_wall_time_s = 0;  // measured by the server
  bool in_contact = false;
  Camera camera;
  std::optional<double> floor_z_m;
  Vec3 gravity_m_per_s2{0, 0, -9.81};
  std::vector<BodyFrame> bodies;
  std::vector<ToolFrame> tools;
};

}  // namespace sectio
