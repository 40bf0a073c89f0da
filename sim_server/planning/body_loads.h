// What will be done to a body: its weight where it hangs over, and what instruments do along their traces. Pure.
#pragma once

#include <string>
#include <vector>

#include "sim_server/planning/body_shape.h"
#include "sim_server/planning/error_law.h"

namespace sectio::planning {

// An instrument, in the body's frame.
struct ToolMoment {
  Vec3 tip_m = Vec3::Zero(), back_m = Vec3::Zero();  // the line that cuts or presses, and where its shaft ends
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  bool grips = false;
};
struct ToolUse {
  std::string name;
  bool cuts = false;
  double ball_radius_m = 0;  // about its tip
  double grip_radius_m = 0;
  std::vector<ToolMoment> moments;  // in order; empty: nobody knows what it will do
};

struct BodySituation {
  double young_pa = 6000, poisson = 0.45, density_kg_per_m3 = 1060;
  double bed_radius_m = 0.008;       // of surface springs
  double most_gravity_m_per_s2 = 0;  // that it will feel
  std::vector<Vec3> fixed_m;         // vertices that are held
  bool lies_on_floor = false;
  std::vector<ToolUse> tools;
};

struct BodyLoad {
  LoadCase what;
  std::string from;            // whom or what it comes from
  double depth_of_tissue = 0;  // of a cut: its depth over the thickness there; 1: it goes through
};

// Loads that move too little to matter are left out. O(triangles * moments).
std::vector<BodyLoad> loads_on(const TriangleSoup& surface, const BodyShape& shape, const BodySituation& situation);

// A cut this deep, over the thickness, needs an inside.
constexpr double kShallow = 0.3;

}  // namespace sectio::planning
