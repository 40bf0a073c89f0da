// What a body is made of inside, as implicit regions in its shape at rest: parenchyma with vessels and a tumour in it.
// A pure function of the rest point, so that nothing about it changes when the body is deformed or cut: the server asks
// it for stiffness and scores, and the renderer evaluates the same function for each fragment (draw/shaders.h).
//
// A region is the union of its parts; of regions that overlap, the later one is there. The tissue around all of them is
// no region: kNoRegion.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/math/types.h"

namespace sectio {

constexpr std::size_t kMaxRegions = 16;      // of a body
constexpr std::size_t kMaxRegionParts = 32;  // of all its regions together
constexpr std::uint32_t kNoRegion = 0xffffffffu;

enum class RegionForm : std::uint8_t {
  ellipsoid,  // a_m: centre, b_m: half axes, turned
  box,        // the same
  tube,       // from a_m to b_m, rounded at both ends; the radius changes evenly
};

struct RegionPart {
  RegionForm form = RegionForm::ellipsoid;
  Vec3 a_m = Vec3::Zero();
  Vec3 b_m = Vec3::Ones();
  double radius_a_m = 0, radius_b_m = 0;                            // of a tube
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  // of an ellipsoid or a box
};

struct Region {
  std::string name;
  Vec3 colour = Vec3::Constant(0.5);        // red, green, blue; 0 to 1
  Vec3 grain_colour = Vec3::Constant(0.5);  // mixed in by noise
  Vec3 rim_colour = Vec3::Constant(0.5);    // at most rim_m below its border: the wall of a vessel, a capsule
  double rim_m = 0;
  double ripple_m = 0;  // by which its border is uneven, at most
  double stiffness_factor = 1;
  bool marked = false;  // tissue that an exercise wants removed
  std::vector<RegionPart> parts;
};

using Regions = std::vector<Region>;  // later ones on top

// Less than 0 inside; near the distance in metres around the border of a part, and exact for tubes of one radius.
double signed_distance_m(const RegionPart& part, const Vec3& rest_m);
// With its ripple.
double signed_distance_m(const Region& region, const Vec3& rest_m);

// The index of the region at a point, or kNoRegion.
std::uint32_t region_at(const Regions& regions, const Vec3& rest_m);

// False when the part is certain to have no point in a ball.
bool may_reach(const RegionPart& part, const Vec3& centre_rest_m, double radius_m);

// The same for all points of a ball around it, where that is known; false when borders may pass through it.
bool is_one_region(const Regions& regions, const Vec3& centre_rest_m, double radius_m);

// Of the tissue at a point: that of its region, or 1.
double stiffness_factor_at(const Regions& regions, const Vec3& rest_m);
// Does any region have one of its own?
bool vary_in_stiffness(const Regions& regions);

// In [-1, 1], smooth, with waves of 6 and 14 mm: by what borders are uneven.
double ripple_at(const Vec3& rest_m);

// Empty when a body may have these regions; otherwise what is wrong, for a person.
std::string flaw_of(const Regions& regions);

}  // namespace sectio
