// The material inside a body, as implicit regions of its rest shape: parenchyma with vessels and a tumour, say. The
// region is a pure function of the rest point, which deformation and cuts don't change: the server evaluates it for
// stiffness and scores, the renderer for each fragment (draw/shaders.h).
//
// A region is the union of its parts; where regions overlap, the later one counts. The tissue outside all regions has
// the index kNoRegion.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/math/types.h"

namespace sectio {

constexpr std::size_t kMaxRegions = 16;      // in a body
constexpr std::size_t kMaxRegionParts = 32;  // in all regions of a body together
constexpr std::uint32_t kNoRegion = 0xffffffffu;

enum class RegionForm : std::uint8_t {
  ellipsoid,  // a_m: centre, b_m: half axes, turned
  box,        // a_m, b_m and orientation as for an ellipsoid
  tube,       // from a_m to b_m, rounded at both ends; the radius changes evenly
};

struct RegionPart {
  RegionForm form = RegionForm::ellipsoid;
  Vec3 a_m = Vec3::Zero();
  Vec3 b_m = Vec3::Ones();
  double radius_a_m = 0, radius_b_m = 0;                            // a tube's ends
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  // ellipsoid and box
};

struct Region {
  std::string name;
  Vec3 colour = Vec3::Constant(0.5);        // red, green, blue; 0 to 1
  Vec3 grain_colour = Vec3::Constant(0.5);  // mixed in by noise
  Vec3 rim_colour = Vec3::Constant(0.5);    // down to rim_m below the border: the wall of a vessel, a capsule
  double rim_m = 0;
  double ripple_m = 0;  // the largest displacement of the border by noise
  double stiffness_factor = 1;
  bool marked = false;  // tissue that an exercise wants removed
  std::vector<RegionPart> parts;
};

using Regions = std::vector<Region>;  // later ones on top

// Negative inside; near a part's border it approximates the distance in metres, and is exact for tubes of one radius.
double signed_distance_m(const RegionPart& part, const Vec3& rest_m);
// The same for a region, with its ripple.
double signed_distance_m(const Region& region, const Vec3& rest_m);

// The index of the region at a point, or kNoRegion.
std::uint32_t region_at(const Regions& regions, const Vec3& rest_m);

// False if the part certainly has no point in the ball.
bool may_reach(const RegionPart& part, const Vec3& centre_rest_m, double radius_m);

// Whether all points of a ball certainly have the same region; false if a border may pass through the ball.
bool is_one_region(const Regions& regions, const Vec3& centre_rest_m, double radius_m);

// The stiffness factor of the tissue at a point: that of its region, or 1.
double stiffness_factor_at(const Regions& regions, const Vec3& rest_m);
// Whether any region has a stiffness factor other than 1.
bool vary_in_stiffness(const Regions& regions);

// Smooth noise in [-1, 1] with waves of 6 and 14 mm, which displaces the borders.
double ripple_at(const Vec3& rest_m);

// Empty if a body may have these regions; otherwise a text for a person that says what is wrong.
std::string flaw_of(const Regions& regions);

}  // namespace sectio
