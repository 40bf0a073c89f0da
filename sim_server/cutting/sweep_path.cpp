#include "sim_server/cutting/sweep_path.h"

#include <algorithm>
#include <cmath>
#include <deque>

namespace sectio {
namespace {

constexpr int kMaxFaces = 200000;
constexpr double kShortestPieceM = 1e-8;  // shorter remainders of a face's crossing are none

// Columns: along the first edge, across it, and the normal.
Mat3 frame_of(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 e = (b - a).stableNormalized();
  const Vec3 n = (b - a).cross(c - a).stableNormalized();
  Mat3 f;
  f << e, n.cross(e), n;
  return f;
}

double cross(const Vec2& a, const Vec2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace

BladeSweep::BladeSweep(const Vec3& from, const Vec3& tip_first, const Vec3& above_first, const Blade& last)
    : origin(from), up(last.up_world) {
  const Vec3 to = last.tip_world_m - from;
  ahead = (to - to.dot(up) * up).stableNormalized();
  left = up.cross(ahead);
  tip_first_ = in_plane(tip_first);
  above_first_ = in_plane(above_first);
  tip_last_ = in_plane(last.tip_world_m);
}

double BladeSweep::trail_height(double s) const {
  const Vec2 d = tip_last_ - tip_first_;
  return tip_first_.y() + (s - tip_first_.x()) / d.x() * d.y();
}

std::optional<BladeSweep::Clip> BladeSweep::clip(const Vec2& a, const Vec2& b) const {
  Clip c;
  // Keeps where the value, linear from `at_a` to `at_b`, is not negative.
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
  const Vec2 up_first = above_first_ - tip_first_, trail = tip_last_ - tip_first_;
  if (!keep(cross(a - tip_first_, up_first), cross(b - tip_first_, up_first), SweepRim::first_pose) ||
      !keep(tip_last_.x() - a.x(), tip_last_.x() - b.x(), SweepRim::last_pose) ||
      !keep(cross(trail, a - tip_first_), cross(trail, b - tip_first_), SweepRim::trail))
    return std::nullopt;
  const bool whole = c.rim_from == SweepRim::none && c.rim_to == SweepRim::none;
  if (!whole && (c.to - c.from) * (b - a).norm() < kShortestPieceM) return std::nullopt;
  return c;
}

double BladeSweep::rim_position(const Vec2& x, SweepRim rim) const {
  const auto squeezed = [](double height) { return height > 0 ? height / (1 + height) : 0.0; };
  switch (rim) {
    case SweepRim::first_pose:
      return 1 - squeezed((x - tip_first_).dot((above_first_ - tip_first_).normalized()));
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
  PathFinder(const MeshDraft& draft, const BladeSweep& sweep, const std::optional<CutFront>& front, double snap_ratio,
             double inset)
      : draft_(draft), sweep_(sweep), front_(front), snap_(snap_ratio), inset_(inset) {}

  std::optional<std::vector<SurfacePath>> run(std::span<const TriangleId> active) {
    std::vector<SurfacePath> paths;
    if (front_) {
      for (const TriangleId t : draft_.fan(front_->bottom)) behind_.insert(t);
      for (const TriangleId t : draft_.fan(front_->top))
        if (draft_.triangle(t).corner_of(front_->bottom) >= 0) behind_.insert(t);
      if (front_->bottom_on_surface) last_ = face_at(front_->bottom, false);
      first_ = face_at(front_->top, true);
      if (first_ == kNone || (front_->bottom_on_surface && last_ == kNone)) return std::nullopt;
      if (!trace(first_, paths)) return std::nullopt;
      if (last_ != kNone && !visited_.contains(last_) && !trace(last_, paths)) return std::nullopt;
    }
    for (const TriangleId t : active)
      if (!trace(t, paths)) return std::nullopt;
    return paths;
  }

 private:
  // One face that the plane crosses: in over edge `in`, where left becomes right, out over `out`.
  struct Face {
    TriangleId id = kNone;
    Triangle triangle;
    std::size_t in = 0, out = 0;
    PathPoint entry, exit;
    BladeSweep::Clip clip;
    bool begins = false, ends = false;  // the path does
    bool at_front = false;
  };

  PathPoint crossing(const Triangle& t, std::size_t edge, const std::array<double, 3>& sides) const {
    std::size_t a = edge, b = (edge + 1) % 3;
    if (sides[a] >= 0) std::swap(a, b);  // always from the right to the left: the same for both faces of the edge
    PathPoint p;
    p.from = t.v[a];
    p.to = t.v[b];
    p.t = sides[a] / (sides[a] - sides[b]);
    const Vec3 x = draft_.position(p.from);
    p.at = sweep_.in_plane(x + p.t * (draft_.position(p.to) - x));
    return p;
  }

  PathPoint at_vertex(VertexId v) const {
    PathPoint p;
    p.kind = PathPoint::Kind::vertex;
    p.from = v;
    p.at = sweep_.in_plane(draft_.position(v));
    return p;
  }

  // The triangle of the fan of v whose opposite edge the plane crosses furthest ahead: outwards for a path that begins
  // at v, inwards for one that ends there.
  TriangleId face_at(VertexId v, bool begins) const {
    TriangleId best = kNone;
    double best_ahead = sweep_.in_plane(draft_.position(v)).x() + 1e-12;
    for (const TriangleId t : draft_.fan(v)) {
      if (t_is_old_wall(t)) continue;
      const Triangle triangle = draft_.triangle(t);
      const auto i = static_cast<std::size_t>(triangle.corner_of(v));
      const Vec3 u = draft_.position(triangle.v[(i + 1) % 3]), w = draft_.position(triangle.v[(i + 2) % 3]);
      const double s_u = sweep_.side(u), s_w = sweep_.side(w);
      if (begins ? !(s_u < 0 && s_w >= 0) : !(s_u >= 0 && s_w < 0)) continue;
      const double s = sweep_.in_plane(u + s_u / (s_u - s_w) * (w - u)).x();
      if (s > best_ahead) best_ahead = s, best = t;
    }
    return best;
  }

  // Of the cut so far: it has both ends of the front, or hangs at its bottom inside the body.
  bool t_is_old_wall(TriangleId t) const {
    const Triangle triangle = draft_.triangle(t);
    const bool top = triangle.corner_of(front_->top) >= 0, bottom = triangle.corner_of(front_->bottom) >= 0;
    return front_->bottom_on_surface ? top && bottom : bottom;
  }

  // The crossing of a face as far as it lies in the region; nothing if none of it does.
  std::optional<Face> face_of(TriangleId id) const {
    Face f;
    f.id = id;
    f.triangle = draft_.triangle(id);
    if (!f.triangle.alive()) return std::nullopt;
    std::array<double, 3> sides;
    for (std::size_t i = 0; i < 3; ++i) sides[i] = sweep_.side(draft_.position(f.triangle.v[i]));
    int changes = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const bool from = sides[i] >= 0, to = sides[(i + 1) % 3] >= 0;
      if (from != to) ++changes, (from ? f.in : f.out) = i;
    }
    if (id == first_) {  // the top counts as on the plane
      const auto i = static_cast<std::size_t>(f.triangle.corner_of(front_->top));
      f.out = (i + 1) % 3;
      sides[i] = 0;
      changes = 2;
    }
    if (id == last_) {
      const auto i = static_cast<std::size_t>(f.triangle.corner_of(front_->bottom));
      f.in = (i + 1) % 3;
      changes = 2;
    }
    if (changes != 2) return std::nullopt;
    f.entry = id == first_ ? at_vertex(front_->top) : crossing(f.triangle, f.in, sides);
    f.exit = id == last_ ? at_vertex(front_->bottom) : crossing(f.triangle, f.out, sides);
    const auto clip = sweep_.clip(f.entry.at, f.exit.at);
    f.at_front = id == first_ || id == last_;
    if (!clip && !f.at_front) return std::nullopt;
    if (clip) f.clip = *clip;
    if (id == first_) f.clip.from = 0, f.clip.rim_from = SweepRim::first_pose;
    if (id == last_) f.clip.to = 1, f.clip.rim_to = SweepRim::first_pose;
    if (f.clip.from >= f.clip.to) return std::nullopt;
    f.begins = f.clip.rim_from != SweepRim::none;
    f.ends = f.clip.rim_to != SweepRim::none;
    return f;
  }

  // Follows the path through a face both ways. False when it leads nowhere.
  bool trace(TriangleId start, std::vector<SurfacePath>& paths) {
    if (visited_.contains(start) || (behind_.contains(start) && start != last_)) return true;
    const std::optional<Face> first = face_of(start);
    if (!first) return start != first_ && start != last_;
    if (!first->at_front &&
        (first->clip.to - first->clip.from) * (first->exit.at - first->entry.at).norm() < kShortestPieceM)
      return true;  // a path that has more than this begins elsewhere
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
      if (!f || f->begins || faces.size() > kMaxFaces) {  // what is left of it is too short: it ends at the edge
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
    return append(faces, closed, paths);
  }

  SweepRim rim_near(const Vec2& x) const {
    const double to_last = std::abs(sweep_.tip_last().x() - x.x());
    const double to_trail = std::abs(x.y() - sweep_.trail_height(x.x()));
    const double to_first = std::abs(x.x() - sweep_.tip_first().x());
    if (to_last <= to_trail && to_last <= to_first) return SweepRim::last_pose;
    return to_trail <= to_first ? SweepRim::trail : SweepRim::first_pose;
  }

  // An end of a path within a face, or the point of the face's rim that it is close to.
  PathPoint end_point(const Face& f, double s, SweepRim rim) const {
    PathPoint p;
    const double near = std::max(snap_, 1e-9);
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
    if (p.t < snap_) return at_vertex(p.from);
    return p.t > 1 - snap_ ? at_vertex(p.to) : p;
  }

  bool append(const std::deque<Face>& faces, bool closed, std::vector<SurfacePath>& paths) const {
    SurfacePath path;
    path.closed = closed;
    const auto add = [&](const PathPoint& p) {
      const std::size_t n = path.points.size();
      if (n >= 1 && p.kind != PathPoint::Kind::in_face && path.points[n - 1].same_place(p)) {
        if (p.rim != SweepRim::none) path.points[n - 1].rim = p.rim, path.points[n - 1].rim_position = p.rim_position;
        return;
      }
      path.points.push_back(p);
    };
    if (!closed) add(end_point(faces.front(), faces.front().clip.from, faces.front().clip.rim_from));
    for (const Face& f : faces) {
      PathFace face;
      face.corners = f.triangle.v;
      face.active_edges = (f.begins && f.id != first_ ? 0 : 1) + (f.ends && f.id != last_ ? 0 : 1);
      face.begin = static_cast<int>(path.points.size()) - 1;
      add(f.ends ? end_point(f, f.clip.to, f.clip.rim_to) : snapped(f.exit));
      face.end = static_cast<int>(path.points.size()) - 1;
      path.faces.push_back(face);
    }
    if (closed && path.points.size() > 1 && path.points.front().same_place(path.points.back())) path.points.pop_back();
    if (path.points.empty()) return false;
    if (closed) {
      const int n = static_cast<int>(path.points.size());
      for (PathFace& f : path.faces) f.begin = (f.begin + n) % n, f.end = (f.end + n) % n;
    }
    paths.push_back(std::move(path));
    return true;
  }

  const MeshDraft& draft_;
  const BladeSweep& sweep_;
  const std::optional<CutFront>& front_;
  double snap_, inset_;
  std::set<TriangleId> visited_, behind_;
  TriangleId first_ = kNone, last_ = kNone;
};

}  // namespace

BladeSweep sweep_between(const MeshDraft& draft, const Blade& first, const Blade& last,
                         const std::optional<CutFront>& front) {
  if (!front) return {first.tip_world_m, first.tip_world_m, first.tip_world_m + first.up_world, last};
  const Vec3 top = draft.position(front->top);
  const Vec3 tip = front->bottom_on_surface ? first.tip_world_m
                   : front->bottom_at_tip   ? front->bottom_at_tip->position_world_m
                                            : draft.position(front->bottom);
  return {top, tip, top, last};
}

Mat3 rest_from_world(const MeshDraft& draft, const std::array<VertexId, 3>& corners) {
  const VertexState a = draft.state(corners[0]), b = draft.state(corners[1]), c = draft.state(corners[2]);
  return frame_of(a.rest_body_m, b.rest_body_m, c.rest_body_m) *
         frame_of(a.position_world_m, b.position_world_m, c.position_world_m).transpose();
}

std::optional<std::vector<SurfacePath>> sweep_paths(const MeshDraft& draft, const BladeSweep& sweep,
                                                    const std::optional<CutFront>& front,
                                                    std::span<const TriangleId> active, double snap_ratio,
                                                    double inset) {
  return PathFinder(draft, sweep, front, snap_ratio, inset).run(active);
}

}  // namespace sectio
