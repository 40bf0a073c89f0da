// A few ellipsoids that fill about what a surface encloses: a tumour, a vessel.
#pragma once

#include <cstddef>
#include <vector>

#include "common/mesh/triangle_mesh.h"

namespace sectio {

struct Ellipsoid {
  Vec3 centre_m = Vec3::Zero();
  Vec3 radii_m = Vec3::Ones();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  // from its axes to those of the surface
};

struct EllipsoidFit {
  std::vector<Ellipsoid> ellipsoids;
  double overlap = 0;    // their union and the inside of the surface: twice the common volume over the sum (Dice 1945)
  double volume_m3 = 0;  // inside the surface
};

// Points of a grid inside the surface, by its winding number, are divided into as many groups as are needed for an
// overlap of 0.95, at most `most`; each group has the ellipsoid of its second moments. The group whose
// ellipsoid fits worst is divided across its longest axis; the best division is kept. Triangles may be open or turned
// either way, as for wrap(). Throws InputError when nothing is enclosed. Deterministic.
EllipsoidFit fit_ellipsoids(const TriangleSoup& given, std::size_t most);

}  // namespace sectio
