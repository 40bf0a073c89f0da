#include "sim_server/surface/cutting/sweep_path.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include "common/math/frame.h"

namespace sectio {
namespace {

constexpr int kMaxFaces = 200000;
constexpr double kBeyond_m = 1e-3;  // least distance of the tip beyond a cut that has come out below
constexpr double kBulge_m = 3e-4;   // by which a groove reaches over its front
constexpr double kFold_m = 1e-4;    // smaller than this, a crossing that enters and leaves over one rim is a fold
constexpr double kShortestPiece_m = 1e-8;  // shorter remainders of a face's crossing are dropped

double cross(const Vec2& a, const Vec2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace

void BladeSweep::set_plane(const Vec3& from, const RestBlade& last) {
  origin = from;
  up = last.up_body;
  const Vec3 to = last.tip_body_m - from;
  ahead = (to - to.dot(up) * up).stableNormalized();
  left = up.cross(ahead);
  tip_last_ = in_plane(last.tip_body_m);
}

BladeSweep::BladeSweep(const RestBlade& first, const RestBlade& last) : straight_(true) {
  set_plane(first.tip_body_m, last);
  tip_first_ = Vec2::Zero();
  first_ = {place_of(first.tip_body_m), place_of(first.tip_body_m + first.up_body)};
}

BladeSweep::BladeSweep(std::span<const std::array<Vec3, 2>> parts, const Vec3& tip_first, const RestBlade& last) {
  set_plane(parts.front()[0], last);
  tip_first_ = in_plane(tip_first);
  for (const auto& ends : parts)
    for (const Vec3& x : ends) first_.push_back(place_of(x));
  std::stable_sort(first_.begin(), first_.end(), [](const Place& a, const Place& b) { return a.height < b.height; });
}

BladeSweep::Place BladeSweep::first_at(double height) const {
  auto above = std::find_if(first_.begin(), first_.end(), [&](const Place& p) { return p.height >= height; });
  if (!straight_ && above == first_.begin()) return first_.front();
  if (!straight_ && above == first_.end()) return first_.back();
  above = std::clamp(above, first_.begin() + 1, first_.end() - 1);
  const Place &a = *(above - 1), &b = *above;
  const double t = (height - a.height) / (b.height - a.height);
  return {height, a.ahead + t * (b.ahead - a.ahead), a.left + t * (b.left - a.left)};
}

double BladeSweep::side(const Vec3& x) const {
  const Vec2 at = in_plane(x);
  const double fade = std::clamp((tip_last_.x() - at.x()) / length_m(), 0.0, 1.0);
  return left.dot(x - origin) - fade * first_at(at.y()).left;
}

double BladeSweep::trail_height(double s) const {
  const Vec2 d = tip_last_ - tip_first_;
  return tip_first_.y() + (s - tip_first_.x()) / d.x() * d.y();
}

std::optional<BladeSweep::Clip> BladeSweep::clip(const Vec2& a, const Vec2& b, double behind_m, double beyond_m) const {
  Clip c;
  // Keeps the part in which the value, linear from `at_a` to `at_b`, is not negative.
  const auto keep = [&](double at_a, double at_b, SweepRim rim) {
    if (at_a < 0 && at_b < 0) return false;
    if (at_a < 0) {
      const double t = at_a / (at_a - at_b);
      if (t > c.from) c.from = t, c.rim_from = rim;
    } else if (at_b < 0) {
      const double t = at_a / (at_a - at_b);
      if (t < c.to) c.to = t, c.rim_to = rim;
    }
    return c.from < c.to;
  };
  const Vec2 trail = tip_last_ - tip_first_;
  const double last = tip_last_.x() + beyond_m;
  if (!keep(ahead_of_first(a) + behind_m, ahead_of_first(b) + behind_m, SweepRim::first_pose) ||
      !keep(last - a.x(), last - b.x(), SweepRim::last_pose) ||
      !keep(cross(trail, a - tip_first_), cross(trail, b - tip_first_), SweepRim::trail))
    return std::nullopt;
  const bool whole = c.rim_from == SweepRim::none && c.rim_to == SweepRim::none;
  if (!whole && (c.to - c.from) * (b - a).norm() < kShortestPiece_m) return std::nullopt;
  return c;
}

double BladeSweep::rim_position(const Vec2& x, SweepRim rim) const {
  const auto squeezed = [](double height) { return height > 0 ? height / (1 + height) : 0.0; };
  switch (rim) {
    case SweepRim::first_pose:
      return 1 - squeezed(x.y() - tip_first_.y());
    case SweepRim::last_pose:
      return 2 + squeezed(x.y() - tip_last_.y());
    default: {
      const Vec2 trail = tip_last_ - tip_first_;
      return 1 + std::clamp((x - tip_first_).dot(trail) / trail.squaredNorm(), 0.0, 1.0);
    }
  }
}

namespace {

class PathFinder {
 public:
  PathFinder(const MeshDraft& draft, const BladeSweep& sweep, const PathSnap& snap, double inset)
      : draft_(draft), sweep_(sweep), snap_(snap), inset_(inset) {}

  std::optional<std::vector<SurfacePath>> run(const SweepEnds& ends, std::span<const TriangleId> active) {
    if (!ends.fronts.empty()) behind_m_ = snap_.fold_m;
    if (ends.target) beyond_m_ = snap_.fold_m;
    for (const CutFront& f : ends.fronts) in_plane_.insert({f.top, f.bottom});
    if (ends.target) in_plane_.insert({ends.target->top, ends.target->bottom});
    for (std::size_t k = 0; k < ends.fronts.size(); ++k)
      if (!anchor(ends.fronts[k], SweepRim::first_pose) && k == 0) return std::nullopt;
    if (ends.target && !anchor(*ends.target, SweepRim::last_pose)) return std::nullopt;
    std::vector<SurfacePath> paths;
    const std::vector<Anchor> anchors = anchors_;
    for (const Anchor& a : anchors)
      if (!trace(a.face, paths)) return std::nullopt;
    for (const TriangleId t : active)
      if (!trace(t, paths)) return std::nullopt;
    if (!ends.fronts.empty()) std::erase_if(paths, [&](const SurfacePath& path) { return is_behind_front(path); });
    std::erase_if(paths, is_fold);
    return paths;
  }

 private:
  // The groove behind a front may bulge over it, and round its bottom: such a path begins and ends at the first pose,
  // or beneath it at the trail, and is open already.
  bool is_behind_front(const SurfacePath& path) const {
    const auto at_front = [](const PathPoint& p) {
      return p.ridge == kNone && (p.rim == SweepRim::first_pose || p.rim == SweepRim::trail);
    };
    return !path.closed && at_front(path.points.front()) && at_front(path.points.back()) &&
           std::ranges::all_of(path.points, [&](const PathPoint& p) { return sweep_.ahead_of_first(p.at) < kBulge_m; });
  }

  // Faces that are folded over each other at rest, by next to nothing, are left for the next step.
  static bool is_fold(const SurfacePath& path) {
    const PathPoint &a = path.points.front(), &b = path.points.back();
    if (path.closed || path.points.size() < 2 || a.rim != b.rim || a.ridge != kNone || b.ridge != kNone) return false;
    return std::ranges::all_of(path.points, [&](const PathPoint& p) { return (p.at - a.at).norm() < kFold_m; });
  }

  // An end of a front, at which a path begins or ends in a triangle of its fan.
  struct Anchor {
    VertexId vertex = kNone, ridge = kNone;
    bool begins = false;
    SweepRim rim = SweepRim::none;
    TriangleId face = kNone;
  };

  // False when the surface does not lead on from the front, or to it.
  bool anchor(const CutFront& f, SweepRim rim) {
    const bool goes_on = rim == SweepRim::first_pose;
    const TriangleId top = face_at(f, f.top, goes_on, goes_on);
    const TriangleId bottom = f.bottom_on_surface ? face_at(f, f.bottom, !goes_on, goes_on) : kNone;
    if (top == kNone || (f.bottom_on_surface && goes_on && bottom == kNone)) return false;
    anchors_.push_back({f.top, f.bottom, goes_on, rim, top});
    if (bottom != kNone) anchors_.push_back({f.bottom, f.top, !goes_on, rim, bottom});
    for (const VertexId v : {f.top, f.bottom})
      for (const TriangleId t : draft_.fan(v)) at_front_.insert(t);
    return true;
  }

  // The ends of fronts are in the plane. By rounding they would be on either side of it, and an edge between two fronts
  // in one face for the one and in another for the other.
  double side(VertexId v) const {
    if (in_plane_.contains(v)) return 0;
    const double side_m = sweep_.side(draft_.rest(v));
    return std::abs(side_m) < snap_.within_m ? 0 : side_m;
  }

  const Anchor* anchor_in(TriangleId face, bool begins) const {
    const auto it = std::find_if(anchors_.begin(), anchors_.end(),
                                 [&](const Anchor& a) { return a.face == face && a.begins == begins; });
    return it != anchors_.end() ? &*it : nullptr;
  }

  // A face that the plane crosses: it enters over the edge `in`, where left becomes right, and leaves over `out`.
  struct Face {
    TriangleId id = kNone;
    Triangle triangle;
    std::size_t in = 0, out = 0;
    PathPoint entry, exit;
    BladeSweep::Clip clip;
    bool begins = false, ends = false;  // the path begins or ends here
    const Anchor *from = nullptr, *to = nullptr;
  };

  PathPoint crossing(const Triangle& t, std::size_t edge, const std::array<double, 3>& sides) const {
    std::size_t a = edge, b = (edge + 1) % 3;
    if (sides[a] >= 0) std::swap(a, b);  // always from the right to the left: the same for both faces of the edge
    PathPoint p;
    p.from = t.v[a];
    p.to = t.v[b];
    p.t = sides[a] / (sides[a] - sides[b]);
    const Vec3 x = draft_.rest(p.from);
    p.at = sweep_.in_plane(x + p.t * (draft_.rest(p.to) - x));
    return p;
  }

  PathPoint at_vertex(VertexId v) const {
    PathPoint p;
    p.kind = PathPoint::Kind::vertex;
    p.from = v;
    p.at = sweep_.in_plane(draft_.rest(v));
    return p;
  }

  // The triangle of the fan of v whose opposite edge the plane crosses furthest ahead (or furthest behind): outwards
  // for a path that begins at v, inwards for one that ends there. Skin is preferred, since the plane may also cross a
  // wall of the groove when the blade has turned.
  TriangleId face_at(const CutFront& f, VertexId v, bool begins, bool ahead) const {
    TriangleId best = kNone;
    const double sign = ahead ? 1 : -1;
    std::pair<bool, double> best_rank;
    for (const TriangleId t : draft_.fan(v)) {
      const Triangle triangle = draft_.triangle(t);
      const bool top = triangle.corner_of(f.top) >= 0, bottom = triangle.corner_of(f.bottom) >= 0;
      if (f.bottom_on_surface ? top && bottom : bottom) continue;
      const auto i = static_cast<std::size_t>(triangle.corner_of(v));
      const Vec3 u = draft_.rest(triangle.v[(i + 1) % 3]), w = draft_.rest(triangle.v[(i + 2) % 3]);
      const double s_u = side(triangle.v[(i + 1) % 3]), s_w = side(triangle.v[(i + 2) % 3]);
      if (begins ? !(s_u < 0 && s_w >= 0) : !(s_u >= 0 && s_w < 0)) continue;
      const std::pair rank(triangle.surface == Surface::skin,
                           sign * sweep_.in_plane(u + s_u / (s_u - s_w) * (w - u)).x());
      if (best == kNone || rank > best_rank) best_rank = rank, best = t;
    }
    return best;
  }

  // The part of a face's crossing in the region; nothing if there is none.
  std::optional<Face> face_of(TriangleId id) const {
    Face f;
    f.id = id;
    f.triangle = draft_.triangle(id);
    if (!f.triangle.alive()) return std::nullopt;
    std::array<double, 3> sides;
    for (std::size_t i = 0; i < 3; ++i) sides[i] = side(f.triangle.v[i]);
    int changes = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const bool from = sides[i] >= 0, to = sides[(i + 1) % 3] >= 0;
      if (from != to) ++changes, (from ? f.in : f.out) = i;
    }
    f.from = anchor_in(id, true);
    f.to = anchor_in(id, false);
    if (f.from) f.out = edge_opposite(f.triangle, f.from->vertex);  // both vertices count as on the plane
    if (f.to) f.in = edge_opposite(f.triangle, f.to->vertex);
    const bool anchored = f.from || f.to;
    if (changes != 2 && !anchored) return std::nullopt;
    f.entry = f.from ? at_vertex(f.from->vertex) : crossing(f.triangle, f.in, sides);
    f.exit = f.to ? at_vertex(f.to->vertex) : crossing(f.triangle, f.out, sides);
    const auto clip = sweep_.clip(f.entry.at, f.exit.at, behind_m_, beyond_m_);
    if (!clip && !anchored) return std::nullopt;
    if (clip) f.clip = *clip;
    if (f.from) f.clip.from = 0, f.clip.rim_from = f.from->rim;
    if (f.to) f.clip.to = 1, f.clip.rim_to = f.to->rim;
    if (f.clip.from >= f.clip.to) return std::nullopt;
    f.begins = f.clip.rim_from != SweepRim::none;
    f.ends = f.clip.rim_to != SweepRim::none;
    return f;
  }

  static std::size_t edge_opposite(const Triangle& t, VertexId v) {
    return static_cast<std::size_t>((t.corner_of(v) + 1) % 3);
  }
  bool is_anchor(TriangleId t) const { return anchor_in(t, true) || anchor_in(t, false); }

  // Follows the path through a face in both directions. False if it leads nowhere.
  bool trace(TriangleId start, std::vector<SurfacePath>& paths) {
    if (visited_.contains(start)) return true;
    const std::optional<Face> first = face_of(start);
    if (!first) return !is_anchor(start);
    if (!first->from && !first->to &&
        (first->clip.to - first->clip.from) * (first->exit.at - first->entry.at).norm() < kShortestPiece_m)
      return true;  // a longer path begins elsewhere
    std::deque<Face> faces{*first};
    visited_.insert(start);
    bool closed = false;
    while (!faces.back().ends) {
      const TriangleId next = draft_.neighbour(faces.back().id, static_cast<int>(faces.back().out));
      if (next == faces.front().id && !faces.front().begins) {
        closed = true;
        break;
      }
      const std::optional<Face> f = visited_.contains(next) ? std::nullopt : face_of(next);
      if (!f || f->begins || faces.size() > kMaxFaces) {  // the rest is too short: the path ends at the edge
        faces.back().ends = true;
        faces.back().clip.rim_to = rim_near(faces.back().exit.at);
        break;
      }
      visited_.insert(next);
      faces.push_back(*f);
    }
    while (!closed && !faces.front().begins) {
      const TriangleId next = draft_.neighbour(faces.front().id, static_cast<int>(faces.front().in));
      const std::optional<Face> f = visited_.contains(next) ? std::nullopt : face_of(next);
      if (!f || f->ends || faces.size() > kMaxFaces) {
        faces.front().begins = true;
        faces.front().clip.rim_from = rim_near(faces.front().entry.at);
        break;
      }
      visited_.insert(next);
      faces.push_front(*f);
    }
    // The walls of the existing groove meet in the front, so the plane may graze them.
    const bool grazes = !is_anchor(start) && std::any_of(faces.begin(), faces.end(),
                                                         [&](const Face& f) { return at_front_.contains(f.id); });
    return grazes || append(faces, closed, paths);
  }

  SweepRim rim_near(const Vec2& x) const {
    const double to_last = std::abs(sweep_.tip_last().x() - x.x());
    const double to_trail = std::abs(x.y() - sweep_.trail_height(x.x()));
    const double to_first = std::abs(x.x() - sweep_.tip_first().x());
    if (to_last <= to_trail && to_last <= to_first) return SweepRim::last_pose;
    return to_trail <= to_first ? SweepRim::trail : SweepRim::first_pose;
  }

  // The end of a path within a face, or the close point on the face's rim.
  PathPoint end_point(const Face& f, double s, SweepRim rim, const Anchor* anchor) const {
    PathPoint p;
    const double near = std::max(snap_.ratio, 1e-9);
    if (s < near) {
      p = snapped(f.entry);
    } else if (s > 1 - near) {
      p = snapped(f.exit);
    } else {
      p.kind = PathPoint::Kind::in_face;
      p.face = f.triangle.v;
      p.from = p.face[0];
      p.at = f.entry.at + s * (f.exit.at - f.entry.at);
      const Vec3 b = (1 - s) * bary_of(f, f.entry) + s * bary_of(f, f.exit);
      p.bary = b.cwiseMax(inset_);
      p.bary /= p.bary.sum();
    }
    p.rim = rim;
    p.rim_position = sweep_.rim_position(p.at, rim);
    if (anchor) p.ridge = anchor->ridge;
    return p;
  }

  static Vec3 bary_of(const Face& f, const PathPoint& p) {
    Vec3 b = Vec3::Zero();
    b[f.triangle.corner_of(p.from)] = 1 - p.t;
    if (p.to != kNone) b[f.triangle.corner_of(p.to)] = p.t;
    return b;
  }

  PathPoint snapped(const PathPoint& p) const {
    if (p.kind != PathPoint::Kind::on_edge) return p;
    const double near = snap_.within_m > 0 ? std::max(snap_.ratio, 1e-9) : snap_.ratio;
    if (p.t < near) return at_vertex(p.from);
    return p.t > 1 - near ? at_vertex(p.to) : p;
  }

  bool append(const std::deque<Face>& faces, bool closed, std::vector<SurfacePath>& paths) const {
    SurfacePath path;
    path.closed = closed;
    const auto add = [&](const PathPoint& p) {
      const std::size_t n = path.points.size();
      if (n >= 1 && p.kind != PathPoint::Kind::in_face && path.points[n - 1].same_place(p)) {
        if (p.rim == SweepRim::none) return;
        path.points[n - 1].rim = p.rim;
        path.points[n - 1].rim_position = p.rim_position;
        path.points[n - 1].ridge = p.ridge;
        return;
      }
      path.points.push_back(p);
    };
    if (!closed)
      add(end_point(faces.front(), faces.front().clip.from, faces.front().clip.rim_from, faces.front().from));
    for (const Face& f : faces) {
      PathFace face;
      face.corners = f.triangle.v;
      face.active_edges = (f.begins && !f.from ? 0 : 1) + (f.ends && !f.to ? 0 : 1);
      face.begin = static_cast<int>(path.points.size()) - 1;
      add(f.ends ? end_point(f, f.clip.to, f.clip.rim_to, f.to) : snapped(f.exit));
      face.end = static_cast<int>(path.points.size()) - 1;
      path.faces.push_back(face);
    }
    if (closed && path.points.size() > 1 && path.points.front().same_place(path.points.back())) path.points.pop_back();
    if (path.points.empty()) return false;
    leave_out_way_round_front(path);
    if (closed) {
      const int n = static_cast<int>(path.points.size());
      for (PathFace& f : path.faces) f.begin = (f.begin + n) % n, f.end = (f.end + n) % n;
    }
    paths.push_back(std::move(path));
    return true;
  }

  // Vertices may lie at the place of a front, all in the plane. The first face is then chosen among faces of no width,
  // and the path may go once round the front before it goes on.
  static void leave_out_way_round_front(SurfacePath& path) {
    if (path.closed || path.points.front().ridge == kNone) return;
    const PathPoint begin = path.points.front();
    const auto is_begin = [&](const PathPoint& p) { return p.same_place(begin); };
    const auto again = std::find_if(path.points.rbegin(), path.points.rend() - 1, is_begin);
    const auto left_out = static_cast<int>(path.points.rend() - 1 - again);
    if (left_out == 0 || left_out + 1 == static_cast<int>(path.points.size())) return;
    path.points.erase(path.points.begin(), path.points.begin() + left_out);
    path.points.front() = begin;
    std::erase_if(path.faces, [&](const PathFace& f) { return f.begin < left_out; });
    for (PathFace& f : path.faces) f.begin -= left_out, f.end -= left_out;
  }

  const MeshDraft& draft_;
  const BladeSweep& sweep_;
  PathSnap snap_;
  double inset_;
  double behind_m_ = 0, beyond_m_ = 0;
  std::vector<Anchor> anchors_;
  std::set<VertexId> in_plane_;
  std::set<TriangleId> visited_, at_front_;
};

}  // namespace

bool still_there(const MeshDraft& draft, const CutFront& f) {
  if (draft.incident(f.top) == kNone || draft.incident(f.bottom) == kNone) return false;
  if (draft.triangle_of_edge(f.top, f.bottom) == kNone) return false;
  if (f.bottom_on_surface) return true;
  if (f.before_left == f.before_right) return draft.triangle_of_edge(f.bottom, f.before_left) != kNone;
  return draft.find_triangle(f.bottom, f.before_left, f.before_right) != kNone;
}

BladeSweep sweep_between(const MeshDraft& draft, const RestBlade& first, const RestBlade& last,
                         std::span<const CutFront> fronts) {
  if (fronts.empty()) return {first, last};
  std::vector<std::array<Vec3, 2>> parts;
  for (const CutFront& f : fronts) parts.push_back({draft.rest(f.top), draft.rest(f.bottom)});
  const CutFront& lowest = fronts.back();
  Vec3 tip = lowest.bottom_at_tip ? lowest.bottom_at_tip->rest_body_m : parts.back()[1];
  if (lowest.bottom_on_surface) {
    const double beyond_m = (tip - first.tip_body_m).dot(last.up_body);
    tip -= std::max(beyond_m, kBeyond_m) * last.up_body;
  } else {
    parts.back()[1] = tip;
  }
  return {parts, tip, last};
}

Mat3 world_from_rest(const MeshDraft& draft, const std::array<VertexId, 3>& corners) {
  const VertexState a = draft.state(corners[0]), b = draft.state(corners[1]), c = draft.state(corners[2]);
  return frame_of(a.position_world_m, b.position_world_m, c.position_world_m) *
         frame_of(a.rest_body_m, b.rest_body_m, c.rest_body_m).transpose();
}

std::optional<std::vector<SurfacePath>> sweep_paths(const MeshDraft& draft, const BladeSweep& sweep,
                                                    const SweepEnds& ends, std::span<const TriangleId> active,
                                                    const PathSnap& snap, double inset) {
  return PathFinder(draft, sweep, snap, inset).run(ends, active);
}

bool goes_round_a_hole(const SurfacePath& path) {
  double twice_area = 0;
  for (std::size_t i = 0; i < path.points.size(); ++i)
    twice_area += cross(path.points[i].at, path.points[(i + 1) % path.points.size()].at);
  return path.closed && twice_area > 0;
}

}  // namespace sectio
