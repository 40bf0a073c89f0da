// The loads that a body will meet: its weight where it overhangs, and the instruments along their traces. Pure
// functions.
#pragma once

#include <string>
#include <vector>

#include "common/material/elastic_material.h"
#include "sim_server/planning/body_shape.h"
#include "sim_server/planning/error_law.h"

namespace sectio::planning {

// A moment of an instrument's trace, in the body's frame.
struct ToolMoment {
  Vec3 tip_m = Vec3::Zero(), back_m = Vec3::Zero();  // the end that cuts or presses, and the end of the shaft
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  bool grips = false;
  double time_s = 0;
};
struct ToolUse {
  std::string name;
  bool cuts = false;
  double ball_radius_m = 0;  // ball about its tip
  double grip_radius_m = 0;
  std::vector<ToolMoment> moments;  // in order of time; empty: its motion is unknown
};

struct BodySituation {
  ElasticMaterial material;
  double bed_radius_m = 0.008;       // foundation_radius_m of surface springs
  double most_gravity_m_per_s2 = 0;  // largest gravity in the scene
  Vec3 down_body = -Vec3::UnitZ();   // its direction
  std::vector<Vec3> fixed_m;         // fixed vertices
  bool lies_on_floor = false;
  std::vector<ToolUse> tools;
};

struct BodyLoad {
  LoadCase what;
  std::string from;  // name of the instrument, or what the weight does: "hangs", "stands", ...
  bool is_weight = false;
  double depth_of_tissue = 0;  // depth of a cut over the thickness there; 1: it goes through
};

// Under gravity there is always a load by weight; other loads whose displacements are negligible are omitted.
// O(triangles * moments).
std::vector<BodyLoad> loads_on(const TriangleSoup& surface, const BodyShape& shape, const BodySituation& situation);

// How deep a tool is in the body at each moment of its trace, along its shaft, and the tissue's thickness there.
struct ToolDepth {
  double depth_m = 0, thickness_m = 0;
};
std::vector<ToolDepth> depths_along(const TriangleSoup& surface, const ToolUse& tool);

// The largest share of the surface that jaws hold at once.
double gripped_share(const TriangleSoup& surface, const BodySituation& situation);

// A displacement by weight, in thicknesses; smaller ones matter less.
constexpr double kSagThatMatters = 0.02;

// A cut deeper than this share of the thickness needs a model with an inside.
constexpr double kShallow = 0.3;

}  // namespace sectio::planning
