#include "sim_server/volume/slit.h"

#include <algorithm>
#include <cmath>

#include "common/core/sort_unique.h"

namespace sectio {
namespace {

constexpr double kSeam_m = 1e-4;   // strips this far from each other have no gap between them
constexpr double kSameCut = 0.9;   // cosine of the angle up to which strips are of one cut
constexpr double kOneSide = 0.5;   // the same of strips by which a blade came
constexpr double kLidShare = 0.5;  // lips beyond the ends of a strip, in lengths of its edge, lie as it does

}  // namespace

void Slit::add_vertices(std::span<const VertexId> vertices) {
  vertices_.insert(vertices_.end(), vertices.begin(), vertices.end());
  sort_unique(vertices_);
}

void Slit::open(const BladeEdge& from, const BladeEdge& to, double strip_m) {
  const auto is_short = [&](const Strip& s) {
    return std::max((to.tip_m - s.from.tip_m).norm(), (to.heel_m - s.from.heel_m).norm()) < strip_m;
  };
  const bool goes_on = !strips_.empty() && strips_.back().to == from;
  if (goes_on && is_short(strips_.back())) {
    strips_.back().to = to;
    return;
  }
  if (goes_on) strips_.back().is_followed = true;
  strips_.push_back({from, to, goes_on});
}

// At a share of the edge's length, the strip reaches from one place of the edge to the next. Strips whose ends have
// moved along the edge, or hardly at all, have no holes between them.
std::optional<SlitPlane> Slit::Strip::plane_at(const Vec3& at_m, double beyond_share) const {
  const Vec3 tip_m = 0.5 * (from.tip_m + to.tip_m), up_m = 0.5 * (from.heel_m + to.heel_m) - tip_m;
  const double share = up_m.dot(at_m - tip_m) / up_m.squaredNorm();
  if (share < -beyond_share || share > 1 + beyond_share) return std::nullopt;
  const Vec3 up = up_m.normalized(), begin_m = from.at(share), moved_m = to.at(share) - begin_m;
  const Vec3 across_m = moved_m - moved_m.dot(up) * up;
  const double place = across_m.dot(at_m - begin_m), end = across_m.squaredNorm();
  const double seam = kSeam_m * std::sqrt(end);
  if (!(end > 0) || place < (follows ? -seam : 0) || place > end + (is_followed ? seam : 0)) return std::nullopt;
  return SlitPlane{begin_m + place / end * across_m, up.cross(across_m).stableNormalized()};
}

std::optional<SlitPlane> Slit::plane_at(const Vec3& at_m, double beside_m) const {
  std::optional<SlitPlane> nearest;
  for (const Strip& strip : strips_) {
    const std::optional<SlitPlane> plane = strip.plane_at(at_m, kLidShare);
    if (!plane || std::abs(plane->height_m(at_m)) > beside_m) continue;
    beside_m = std::abs(plane->height_m(at_m));
    nearest = plane;
  }
  return nearest;
}

Vec3 Slit::Strip::normal_m() const {
  const Vec3 up = (from.heel_m + to.heel_m - from.tip_m - to.tip_m).stableNormalized();
  return up.cross(to.at(0.5) - from.at(0.5));
}

bool Slit::leads_to(std::size_t strip, std::size_t next, double gap_m) const {
  const BladeEdge &to = strips_[strip].to, &from = strips_[next].from;
  return std::min((from.tip_m - to.tip_m).norm(), (from.heel_m - to.heel_m).norm()) < gap_m;
}

// A strip of a trembling blade may lie across the cut: it turns what comes before by little, and belongs to no side.
// One that lies across at a corner goes on as the strip before it, and has the side of the next one: that is left or
// right of the way.
std::vector<Vec3> Slit::facing(const Vec3& normal, double smooth_m) const {
  std::vector<Vec3> facing(strips_.size(), Vec3::Zero());
  Vec3 there = normal, next = Vec3::Zero();
  double next_sign = 1;
  bool leads_here = true;  // from this strip to the last one
  for (std::size_t i = strips_.size(); i-- > 0;) {
    if (i + 1 < strips_.size()) leads_here &= leads_to(i, i + 1, smooth_m);
    if (!leads_here) there = normal;
    const Vec3 across_m = strips_[i].normal_m(), across = across_m.stableNormalized();
    const bool lies_across = leads_here && !next.isZero() && std::abs(across.dot(there)) < kOneSide;
    double sign = std::copysign(1.0, across.dot(there));
    if (lies_across) sign = across.dot(next) < -kOneSide ? -next_sign : next_sign;
    if (leads_here) there = (smooth_m * there + sign * across_m).normalized();
    const bool goes_on = lies_across && i > 0 && leads_to(i - 1, i, smooth_m) &&
                         across.dot(strips_[i - 1].normal_m().stableNormalized()) > kSameCut;
    if (goes_on || sign * across.dot(there) > (leads_here ? kOneSide : kSameCut)) facing[i] = sign * across;
    next = across, next_sign = sign;
  }
  return facing;
}

std::optional<SlitPlane> Slit::plane_facing(const Vec3& at_m, double beside_m, std::span<const Vec3> facing) const {
  std::optional<SlitPlane> nearest;
  for (std::size_t i = 0; i < strips_.size(); ++i) {
    if (facing[i].isZero()) continue;
    std::optional<SlitPlane> plane = strips_[i].plane_at(at_m, 0);
    if (!plane || std::abs(plane->height_m(at_m)) > beside_m) continue;
    if (plane->normal.dot(facing[i]) < 0) plane->normal = -plane->normal;
    beside_m = std::abs(plane->height_m(at_m));
    nearest = plane;
  }
  return nearest ? nearest : outside_corner(at_m, beside_m, facing);
}

// A strip and the next one leave a wedge between them on the outside of a corner. The edge in which they meet is what
// is nearest there.
std::optional<SlitPlane> Slit::outside_corner(const Vec3& at_m, double beside_m, std::span<const Vec3> facing) const {
  std::optional<SlitPlane> nearest;
  const double gap_m = beside_m;
  for (std::size_t i = 1; i < strips_.size(); ++i) {
    if (facing[i].isZero() || !leads_to(i - 1, i, gap_m)) continue;
    const BladeEdge& edge = strips_[i].from;
    const Vec3 up_m = edge.heel_m - edge.tip_m;
    const double share = up_m.dot(at_m - edge.tip_m) / up_m.squaredNorm();
    const Vec3 away_m = at_m - edge.at(share);
    if (share < 0 || share > 1 || away_m.norm() > beside_m) continue;
    if (away_m.dot(strips_[i].way_m(share)) > 0 || away_m.dot(strips_[i - 1].way_m(share)) < 0) continue;
    beside_m = away_m.norm();
    nearest = SlitPlane{edge.at(share), std::copysign(1.0, away_m.dot(facing[i])) * away_m.stableNormalized()};
  }
  return nearest;
}

bool Slit::contains(const Vec3& at_m, double beside_m) const {
  return std::ranges::any_of(strips_, [&](const Strip& strip) {
    const std::optional<SlitPlane> plane = strip.plane_at(at_m, 0);
    return plane && std::abs(plane->height_m(at_m)) <= beside_m;
  });
}

}  // namespace sectio
