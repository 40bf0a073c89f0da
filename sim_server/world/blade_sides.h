// The flats of a blade in its slit. A blade that goes aside presses one wall of the slit away, and the tissue behind it
// presses back (paper B, figure 4: "push back").
//
// Samples of the walls, fixed in the material, are held on their side of the plane of the blade. With T the tip, a the
// unit normal of the flat, and n the normal of a wall, out of its tissue:
//
//   depth of a sample x:  s (T - x).a - 0.8 mm,  s = -sign(n.a)
//
// by which a wall gives way. A hand that trembles presses none.
//
// A wall that is deep on the wrong side is that of another slit, unless the blade presses walls that way already.
#pragma once

#include <cmath>
#include <vector>

#include "sim_server/deformation/point_constraint.h"
#include "sim_server/world/body.h"
#include "sim_server/world/instrument_edge.h"

namespace sectio {

class BladeSides {
 public:
  // The tip has gone this way in this step. One constraint a sample, with a layer of tissue in series
  // (contact_layer.h). None: the edge has no flat, or is alone. Cost: triangles near the flat.
  std::vector<PointConstraint> press(Body& body, const InstrumentEdge& edge, const Vec3& way_world_m);

  // The way that it has gone aside, all in all, since it lay between walls that it didn't press.
  double aside_m() const { return std::abs(aside_m_); }

  template <class A>
  void archive(A& a) {
    a(presses_, aside_m_);
  }

 private:
  int presses_ = 0;  // the side whose walls it presses, s; 0: neither
  double aside_m_ = 0;
};

}  // namespace sectio
