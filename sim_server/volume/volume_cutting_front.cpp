// What a blade opens: along its way for good, and its front, which is temporary.
#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

#include "common/core/sort_unique.h"
#include "common/math/intersect.h"
#include "sim_server/volume/volume_cutting.h"

namespace sectio {
namespace {

constexpr double kAgain = 0.1;     // mean edges that a blade goes after a cut that could not be made
constexpr double kLap = 0.25;      // mean edges that a sheet begins behind the blade's way
constexpr double kLag = 0.05;      // mean edges behind the blade at which its front ends: it touches what it cuts next
constexpr double kThread = 0.5;    // mean edges: tissue ahead that goes with what is cut, nothing being behind it
constexpr double kCrumb = 0.06;    // of the cube of a mean edge: half of an element
constexpr double kPatience = 1.5;  // mean edges that a blade goes on in the hope of a cut that leaves no crumbs
constexpr double kJoined = 1.0;    // mean edges around a sheet: vertices of the cut that it goes on from
// The side of a sheet where the blade is: corners are tip and heel of where it begins, heel and tip of where it ends.
constexpr std::uint32_t kEnd = 1 << 2;
constexpr std::uint32_t kAlong = 1 << 1 | 1 << 3;  // those along which its ends go

}  // namespace

// Fronts stay as they are.
void VolumeCutting::settle() {
  if (std::ranges::none_of(ways_, [](const auto& way) { return way.second.has_front; })) return;
  volume_.forget();
  kinds_.clear();
  for (auto& [tool, way] : ways_) {
    way.has_front = false;
    way.cut.insert(way.cut.end(), way.of_front.begin(), way.of_front.end());
    way.of_front.clear();
    sort_unique(way.cut);
  }
}

// Instead of vertices that are temporary those that they were made from.
std::vector<VertexId> VolumeCutting::settled(const std::vector<VertexId>& vertices) const {
  std::vector<VertexId> found;
  std::vector<VertexId> made;
  for (const VertexId v : vertices) (volume_.made_from(v) ? made : found).push_back(v);
  if (made.empty()) return vertices;
  for (std::size_t k = 0; k < made.size(); ++k) {
    const auto ends = *volume_.made_from(made[k]);
    for (const VertexId v : ends) (volume_.made_from(v) ? made : found).push_back(v);
  }
  sort_unique(found);
  return found;
}

// In the world, where the blade and the tissue are what they are; only where it has been is carried along. The sheet
// goes on from all that the blade has cut: no lip is cut again because it has moved a little.
TetCutOutcome VolumeCutting::cut_along(const Way& way, double further_m, std::uint32_t exact) {
  const auto in_world = [&](const Edge& e) {
    return Edge{way.frame_world.to_world(e.tip_m), way.frame_world.to_world(e.heel_m)};
  };
  Edge from = in_world(way.edges.front()), to = in_world(furthest(way));
  const Vec3 ahead = (to.tip_m + to.heel_m - from.tip_m - from.heel_m).stableNormalized();
  from = {from.tip_m - kLap * element_m_ * ahead, from.heel_m - kLap * element_m_ * ahead};
  to = {to.tip_m + further_m * ahead, to.heel_m + further_m * ahead};
  const Vec3 normal = (to.heel_m - to.tip_m).cross(ahead).stableNormalized();
  std::vector<std::uint32_t> begin;
  for (const VertexId v : way.near) {
    const Vec3& x = volume_.vertex(v).position_world_m;
    if (std::abs(normal.dot(x - to.tip_m)) > element_m_) continue;
    if (follows() && distance_to_segment(x, to.tip_m, to.heel_m) > element_m_) continue;
    begin.insert(begin.end(), volume_.star(v).begin(), volume_.star(v).end());
  }
  if (begin.empty()) return {};
  sort_unique(begin);
  CutSheet sheet{{from.tip_m, from.heel_m, to.heel_m, to.tip_m}, {}, exact, exact & kAlong};
  const Edge &first = way.edges.front(), &last = way.edges.back();
  const double reach_m =
      kJoined * element_m_ + std::max((last.tip_m - first.tip_m).norm(), (last.heel_m - first.heel_m).norm());
  std::ranges::copy_if(way.cut, std::back_inserter(sheet.joined), [&](VertexId v) {
    return distance_to_segment(volume_.vertex(v).rest_body_m, last.tip_m, last.heel_m) < reach_m;
  });
  return cut(volume_, sheet, cut_settings_, begin);
}

// A blade that comes out has cut what it passed through in its last step; tissue that it bulged is still behind it. Of
// one that follows its front only where the tissue ends there: else it is taken out of the middle of it.
bool VolumeCutting::cut_for_good(Way& way, bool is_lifted) {
  const std::size_t mark = volume_.mark();
  TetCutOutcome outcome;
  if (is_lifted || way.ends) outcome = cut_along(way, kThread * element_m_, follows() ? kEnd | kAlong : 0);
  way.is_through = outcome.twins > 0 && (outcome.beyond & kEnd) == 0;
  if (!way.is_through) volume_.undo_to(mark);
  if (!way.is_through && !is_lifted) outcome = cut_along(way, 0, follows() ? kAlong : 0);
  const bool may_wait = !is_lifted && way.since_cut_m < kPatience * element_m_;
  if (outcome.twins == 0 || (is_lifted && !way.is_through) || (may_wait && leaves_crumbs())) {
    volume_.undo_to(mark);  // nothing opens yet; or later, further on
    way.is_through = false;
    return false;
  }
  way.cut.insert(way.cut.end(), outcome.on_sheet.begin(), outcome.on_sheet.end());
  sort_unique(way.cut);
  return true;
}

bool VolumeCutting::cut_front(Way& way) {
  const std::size_t mark = volume_.mark();
  TetCutOutcome outcome = cut_along(way, -kLag * element_m_, kEnd | kAlong);
  way.has_front = outcome.twins > 0 && !(way.since_cut_m < kPatience * element_m_ && leaves_crumbs());
  way.of_front.clear();
  way.ends = way.has_front && outcome.ahead_m < kThread * element_m_;
  if (way.has_front)
    way.of_front = std::move(outcome.on_sheet);
  else
    volume_.undo_to(mark);
  return way.has_front;
}

// What is final first: it stays when the rest is undone. False when nothing opens that was closed.
bool VolumeCutting::cut_all(std::span<const Stroke> strokes, std::span<const std::uint32_t> lifted, Pending& pending) {
  std::vector<std::uint32_t> opened;  // by which
  const auto is_lifted = [&](std::uint32_t tool) { return std::ranges::find(lifted, tool) != lifted.end(); };
  for (const Stroke& s : strokes) {
    const auto found = pending.ways.find(s.tool_id);
    if (found == pending.ways.end() || !is_due(found->second)) continue;
    ways_[s.tool_id].next_m = found->second.since_cut_m + kAgain * element_m_;
    if (cut_for_good(found->second, is_lifted(s.tool_id))) opened.push_back(s.tool_id);
  }
  pending.final_steps = volume_.mark();
  for (const Stroke& s : strokes) {
    const auto found = pending.ways.find(s.tool_id);
    if (found == pending.ways.end() || is_lifted(s.tool_id) || !follows()) continue;
    if ((is_due(found->second) || found->second.has_front) && cut_front(found->second)) opened.push_back(s.tool_id);
  }
  bool any = false;
  for (auto& [tool, way] : pending.ways) {
    if (!is_due(way) || std::ranges::find(opened, tool) == opened.end()) continue;
    way.open_to = furthest(way);
    const Edge &to = way.open_to, &begin = way.edges.front();
    const Vec3 up = (to.heel_m - to.tip_m).normalized(), ahead = to.tip_m + to.heel_m - begin.tip_m - begin.heel_m;
    way.forward = (ahead - ahead.dot(up) * up).stableNormalized();
    way.since_cut_m = 0;
    way.next_m = next_cut_m();
    any = true;
  }
  return any;
}

// By the operations, both sides together: dividing a surface leaves its area as it is.
double VolumeCutting::opened_m2() const {
  const BoundaryChange boundary = boundary_change(volume_.change().tetrahedra);
  const auto area_m2 = [&](const std::vector<Corners3>& faces) {
    double sum = 0;
    for (const auto& [a, b, c] : faces) {
      const Vec3& x = volume_.vertex(a).rest_body_m;
      sum += 0.5 * (volume_.vertex(b).rest_body_m - x).cross(volume_.vertex(c).rest_body_m - x).norm();
    }
    return sum;
  };
  return area_m2(boundary.added) - area_m2(boundary.removed);
}

// Has less than half of an element come off? O(operations).
bool VolumeCutting::leaves_crumbs() const {
  const double enough_m3 = kCrumb * std::pow(element_m_, 3);
  std::unordered_set<std::uint32_t> large;  // asked, never walked
  std::vector<std::uint32_t> found;
  for (const TetEdit& e : volume_.change().tetrahedra) {
    if (e.before == e.after || large.contains(e.id)) continue;
    found.assign(1, e.id);
    double volume_m3 = 0;
    bool is_large = false;
    for (std::size_t k = 0; k < found.size() && !is_large; ++k) {
      volume_m3 += volume_.volume_m3(found[k]);
      is_large = volume_m3 > enough_m3;
      for (std::size_t corner = 0; corner < 4 && !is_large; ++corner) {
        const std::uint32_t u = volume_.across(found[k], corner);
        if (u == kNone || std::ranges::find(found, u) != found.end()) continue;
        found.push_back(u);
        is_large = large.contains(u);
      }
    }
    if (!is_large) return true;
    large.insert(found.begin(), found.end());
  }
  return false;
}

}  // namespace sectio
