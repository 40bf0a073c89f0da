// The work that a hand does with a blade, leg by leg, in the real simulation: against the toughness of the tissue times
// the area that is new.
#pragma once

#include <string>
#include <vector>

#include "tests/feel/felt_loop.h"

namespace sectio::test {

struct BladeTissue {
  std::string name;  // for tables
  std::string model;
  std::string style = "progressive";
  int squares = 2;        // on the surface, over 10 mm
  double tetrahedra = 0;  // tetrahedra of a volume
  double cell_m = 0;      // cell of a lattice
  double toughness_j_per_m2 = 200;
};

// A straight way of the blade.
struct BladeLeg {
  std::string name;
  Vec3 by_m = Vec3::Zero();
  double new_area_m2 = 0;  // its edge sweeps this area in uncut tissue
  bool is_steady = false;  // the same length of the edge cuts all along, apart from the ends
  double outside_m = 0;    // length outside at its ends
};

struct BladeStroke {
  std::string name;
  std::string tool = "scalpel";
  ToolGeometry geometry;
  Vec3 from_m = Vec3::Zero();  // start of the tip
  std::vector<BladeLeg> legs;
};

constexpr double kToughness_j_per_m2 = BladeTissue{}.toughness_j_per_m2;

// In the block of felt_block(), whose top is z = kBlockTop_m. `long_m`: the way of the slide.
BladeStroke slide_and_return(double deep_m, double long_m);  // down, along, back and forth in the slit, out, in, out
BladeStroke plunge(double deep_m);                           // down, and out
BladeStroke right_through();                                 // a long edge, from side to side
// The same edge goes half through, out, down again in its slit, and on through the other half.
BladeStroke put_back();
// The same edge goes in by 20 mm, and 6 mm further while it is drawn along itself by `slice_over_push` times as much.
BladeStroke slice(double slice_over_push);
Vec3 edge_of_knife();  // unit, from its tip upwards along its sharp side

struct LegWork {
  BladeLeg leg;
  double work_j = 0;                // by the hand, from the simulation's own force
  double booked_j = 0;              // by instrument_work_j
  double mean_n = 0, ripple_n = 0;  // the force's size, rms; a steady leg's without its ends
  Vec3 last_n = Vec3::Zero();       // the force on the blade at the end
};
std::vector<LegWork> work_of(const BladeTissue& tissue, const BladeStroke& stroke, double speed_m_per_s);

}  // namespace sectio::test
