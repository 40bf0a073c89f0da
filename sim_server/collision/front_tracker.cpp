#include "sim_server/collision/front_tracker.h"

#include <algorithm>

#include "common/core/sort_unique.h"

namespace sectio {
namespace {

double motion(const FrontStep& step) {
  double most = 0;
  for (std::size_t i = 0; i < 4; ++i)
    most = std::max(most, (step.after.at_world_m[i] - step.before.at_world_m[i]).norm());
  return most;
}

bool is_near(const ToolCorners& tool, const Box3& box) {
  for (const auto& [i, j] : kSegmentCorners)
    if (overlaps(tool.at_world_m[i], tool.at_world_m[j], box)) return true;
  return false;
}

std::vector<SurfaceHit> hits_of(const SurfaceView& view, std::span<const TriangleId> triangles, const Vec3& p,
                                const Vec3& q) {
  std::vector<SurfaceHit> found;
  for (const TriangleId t : triangles)
    if (auto hit = hit_triangle(view, t, p, q)) found.push_back(*hit);
  sort_hits(found);
  return found;
}

// Finds all contacts of the instrument with the triangles within its reach.
ToolContact contact_of(const SurfaceView& view, std::span<const TriangleId> triangles, const FrontStep& step) {
  ToolContact contact;
  const auto &from = step.before.at_world_m, &to = step.after.at_world_m;
  for (std::size_t s = 0; s < kToolSegments; ++s) {
    const auto [i, j] = kSegmentCorners[s];
    contact.segments[s].before = hits_of(view, triangles, from[i], from[j]);
    contact.segments[s].after = hits_of(view, triangles, to[i], to[j]);
    contact.segments[s].swept = cross_edges(view, triangles, {from[i], from[j], to[i], to[j]});
  }
  for (std::size_t i = 0; i < 4; ++i) contact.corner_paths[i] = hits_of(view, triangles, from[i], to[i]);
  return contact;
}

}  // namespace

ToolContact FrontTracker::follow(const SurfaceView& view, const CollisionEngine& tree, const FrontStep& step) {
  const double reach_m = motion(step);
  tree.near_segments(view, step.after.at_world_m, kSegmentCorners, reach_m, near_);
  if (near_.empty()) return {};

  const bool trusted = step.continuous && reach_m <= kMaxWalk_m;
  const bool local = trusted && walk_reaches(view, step.after, reach_m);
  ++(local ? counters_.local_searches : counters_.global_searches);
  ToolContact contact = contact_of(view, near_, step);
  contact.searched_globally = !local;
  known_ = near_;
  return contact;
}

// Breadth-first search from the known triangles, over triangles close to the instrument, until all of near_ are found.
bool FrontTracker::walk_reaches(const SurfaceView& view, const ToolCorners& tool, double reach_m) {
  walked_.clear();
  visited_.clear();
  std::size_t missing = near_.size();
  const auto visit = [&](TriangleId t) {
    if (!view.alive(t)) return;
    const auto at = std::lower_bound(visited_.begin(), visited_.end(), t);
    if (at != visited_.end() && *at == t) return;
    visited_.insert(at, t);
    walked_.push_back(t);
    missing -= std::binary_search(near_.begin(), near_.end(), t);
  };
  for (const TriangleId t : known_) visit(t);
  for (std::size_t next = 0; missing > 0 && next < walked_.size() && walked_.size() < kMaxWalked; ++next)
    for (const TriangleId t : view.mesh.neighbours(walked_[next]))
      if (is_near(tool, grown(box_of(view.corners(t)), reach_m + kWalkMargin_m))) visit(t);
  return missing == 0;
}

void FrontTracker::topology_changed(const SurfaceView& view, std::span<const TriangleId> changed) {
  if (known_.empty()) return;
  known_.insert(known_.end(), changed.begin(), changed.end());
  std::erase_if(known_, [&](TriangleId t) { return !view.alive(t); });
  sort_unique(known_);
}

}  // namespace sectio
