// Samples of a triangle that are fixed in its material: the middles of the equal parts into which a lattice divides it.
#pragma once

#include "common/math/types.h"

namespace sectio {

// Calls visit(bary) for each of along^2 parts of equal area.
template <class Visit>
void for_lattice(int along, const Visit& visit) {
  for (int i = 0; i < along; ++i)
    for (int j = 0; i + j < along; ++j)
      for (const double third : {1.0 / 3, 2.0 / 3}) {  // a triangle that points up, and one that points down
        if (third > 0.5 && i + j + 2 > along) continue;
        Vec3 bary;
        bary.y() = (i + third) / along;
        bary.z() = (j + third) / along;
        bary.x() = 1 - bary.y() - bary.z();
        visit(bary);
      }
}

}  // namespace sectio
