#include "sim_server/world/stuck_points.h"

#include <algorithm>

namespace sectio {

Vec3 StuckPoints::slide(const Contact& contact, const OnTriangle& on, const Way& way_world_m, const Vec3& normal_world,
                        double most_m) {
  if (most_m <= 0) return Vec3::Zero();
  Vec3 apart_m = Vec3::Zero();
  const auto known = std::ranges::lower_bound(stuck_, contact, {}, &Stuck::contact);
  if (known != stuck_.end() && known->contact == contact) {
    apart_m = known->apart_world_m + way_world_m(known->on) - known->way_world_m;
    apart_m -= apart_m.dot(normal_world) * normal_world;
    const double size_m = apart_m.norm();
    if (size_m > most_m) apart_m *= most_m / size_m;
  }
  next_.push_back({contact, on, way_world_m(on), apart_m});
  return apart_m;
}

void StuckPoints::end_step() {
  std::swap(stuck_, next_);
  next_.clear();
}

}  // namespace sectio
