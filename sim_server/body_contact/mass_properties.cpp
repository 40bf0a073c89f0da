#include "sim_server/body_contact/mass_properties.h"

#include <algorithm>

namespace sectio {

MassProperties mass_properties(std::span<const Vec3> positions_m, std::span<const Triangle> triangles,
                               double density_kg_per_m3) {
  MassProperties result;
  const auto first = std::find_if(triangles.begin(), triangles.end(), [](const Triangle& t) { return t.alive(); });
  if (first == triangles.end()) return result;
  // Sums from a point of the surface: far from the origin, differences of large numbers would lose digits.
  const Vec3& origin = positions_m[first->v[0]];
  result.centre_m = origin;

  // Integrals over a tetrahedron 0 a b c with s = a + b + c:  V = det / 6,  int x = V s / 4,
  // int x x^T = V / 20 (a a^T + b b^T + c c^T + s s^T).
  double volume = 0;
  Vec3 moment = Vec3::Zero();
  Mat3 second = Mat3::Zero();
  for (auto t = first; t != triangles.end(); ++t) {
    if (!t->alive()) continue;
    const Vec3 a = positions_m[t->v[0]] - origin, b = positions_m[t->v[1]] - origin, c = positions_m[t->v[2]] - origin;
    const Vec3 s = a + b + c;
    const double v = a.dot(b.cross(c)) / 6;
    volume += v;
    moment += v / 4 * s;
    second += v / 20 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose());
  }
  result.volume_m3 = volume;
  if (!(volume > 0)) return result;
  const Vec3 centre = moment / volume;
  second -= volume * centre * centre.transpose();
  result.mass_kg = density_kg_per_m3 * volume;
  result.centre_m = origin + centre;
  result.inertia_kg_m2 = density_kg_per_m3 * (second.trace() * Mat3::Identity() - second);
  return result;
}

}  // namespace sectio
