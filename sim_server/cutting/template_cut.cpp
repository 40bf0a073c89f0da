#include "sim_server/cutting/template_cut.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "sim_server/cutting/slit.h"
#include "sim_server/cutting/templates.h"

namespace sectio {
namespace {

using Kind = PathPoint::Kind;

constexpr double kWidestOpening = 0.4;  // of the way to the nearest vertex beside the path: the rest stays beside it

// A corner of the region inside the body, before it has vertices.
struct RimItem {
  enum class What : std::uint8_t { path, tip_first, tip_last, bottom };
  What what = What::path;
  std::size_t path = 0, point = 0;  // of a path, or above a bottom
  Vec2 at = Vec2::Zero();
  double rim_position = 0;
};
using Rim = std::vector<RimItem>;

// What the surface is like at a point of a path, before anything is changed.
struct PathFrame {
  Vec3 normal_world = Vec3::Zero();
  Mat3 rest_from_world = Mat3::Identity();
};

class Step {
 public:
  Step(MeshDraft& draft, const BladeSweep& sweep, const std::optional<CutFront>& front,
       const TemplateSettings& settings)
      : draft_(draft), sweep_(sweep), front_(front), settings_(settings) {}

  // The order of the paper: templates, then the surface, then the structures inside.
  bool run(std::vector<SurfacePath> paths, TemplateStep& step) {
    paths_ = std::move(paths);
    for (SurfacePath& path : paths_)
      if (!prepare(path)) return false;
    if (!join_paths()) return false;
    choose_templates(step.faces);
    for (Rim& rim : rims_) hang_bottoms(rim, step.faces);
    if (!subdivide_faces()) return false;
    std::vector<Slit> slits;
    for (const Rim& rim : rims_) slits.push_back(slit_of(rim, step));
    if (!open_slits(draft_, slits)) return false;
    for (std::size_t k = 0; k < rims_.size(); ++k) find_front(rims_[k], slits[k], step);
    return true;
  }

 private:
  bool at_front(const PathPoint& p) const {
    return front_ && p.kind == Kind::vertex &&
           (p.from == front_->top || (front_->bottom_on_surface && p.from == front_->bottom));
  }

  // A slit needs a pair: where a path has two single ends and nothing between, its middle becomes one.
  bool prepare(SurfacePath& path) const {
    if (path.closed) return path.points.size() >= 3;
    if (path.points.size() < 2) return false;
    if (path.points.size() > 2 || at_front(path.points[0]) || at_front(path.points[1])) return true;
    PathPoint middle;
    middle.kind = Kind::between;
    middle.at = 0.5 * (path.points[0].at + path.points[1].at);
    path.points.insert(path.points.begin() + 1, middle);
    for (PathFace& f : path.faces) f.begin += f.begin == 1, f.end += f.end == 1;
    return true;
  }

  // Every end of a path is followed, clockwise along the rim of the sweep, by the beginning of one.
  bool join_paths() {
    std::vector<bool> used(paths_.size(), false);
    for (std::size_t first = 0; first < paths_.size(); ++first) {
      if (used[first]) continue;
      Rim rim;
      std::size_t p = first;
      do {
        if (used[p]) return false;
        used[p] = true;
        for (std::size_t i = 0; i < paths_[p].points.size(); ++i)
          rim.push_back({RimItem::What::path, p, i, paths_[p].points[i].at, paths_[p].points[i].rim_position});
        if (paths_[p].closed) {
          if (!is_clockwise(rim)) return false;  // a hole
          break;
        }
        const double end = paths_[p].points.back().rim_position;
        const std::size_t next = path_begun_below(end);
        if (next == paths_.size()) return false;
        const double begin = paths_[next].points.front().rim_position;
        if (begin < 2 && end > 2) rim.push_back({RimItem::What::tip_last, 0, 0, sweep_.tip_last(), 2});
        if (begin < 1 && end > 1) rim.push_back({RimItem::What::tip_first, 0, 0, sweep_.tip_first(), 1});
        p = next;
      } while (p != first);
      rims_.push_back(std::move(rim));
    }
    return true;
  }

  static bool is_clockwise(const Rim& rim) {
    double area = 0;
    for (std::size_t i = 0; i < rim.size(); ++i) {
      const Vec2 &a = rim[i].at, &b = rim[(i + 1) % rim.size()].at;
      area += a.x() * b.y() - a.y() * b.x();
    }
    return area < 0;
  }

  std::size_t path_begun_below(double rim_position) const {
    std::size_t best = paths_.size();
    for (std::size_t p = 0; p < paths_.size(); ++p) {
      if (paths_[p].closed || paths_[p].points.front().rim_position >= rim_position) continue;
      if (best == paths_.size() || paths_[p].points.front().rim_position > paths_[best].points.front().rim_position)
        best = p;
    }
    return best;
  }

  void choose_templates(std::vector<ActiveFace>& faces) {
    for (const Rim& rim : rims_)
      for (std::size_t i = 0; i < rim.size(); ++i) {
        if (rim[i].what != RimItem::What::path || rim[i].point != 0) continue;
        const SurfacePath& path = paths_[rim[i].path];
        const std::size_t n = rim.size(), last = (i + path.points.size() - 1) % n;
        const RimItem &before = rim[(i + n - 1) % n], &after = rim[(last + 1) % n];
        first_face_.resize(paths_.size());
        first_face_[rim[i].path] = faces.size();
        for (std::size_t k = 0; k < path.faces.size(); ++k) {
          const PathFace& f = path.faces[k];
          ActiveFace face;
          face.corners = f.corners;
          face.active_edges = f.active_edges;
          face.angle = angle_class(sweep_.up, normal_of(f), settings_.right_angle_tolerance_rad);
          const bool tip_before = !path.closed && k == 0 && before.what == RimItem::What::tip_first;
          const bool tip_after = !path.closed && k + 1 == path.faces.size() && after.what == RimItem::What::tip_last;
          face.vertices_inside = tip_before + tip_after;
          face.chosen = &template_for(face.angle, face.active_edges, face.vertices_inside);
          faces.push_back(face);
        }
      }
  }

  Vec3 normal_of(const PathFace& f) const {
    const Vec3 a = draft_.position(f.corners[0]);
    return (draft_.position(f.corners[1]) - a).cross(draft_.position(f.corners[2]) - a).stableNormalized();
  }

  // A pair of bottom vertices hangs under a point all of whose faces have sides and a bottom of their own.
  bool has_bottom(std::size_t p, std::size_t i, const std::vector<ActiveFace>& faces) const {
    const SurfacePath& path = paths_[p];
    bool any = false;
    for (std::size_t k = 0; k < path.faces.size(); ++k) {
      if (path.faces[k].begin != static_cast<int>(i) && path.faces[k].end != static_cast<int>(i)) continue;
      const Substructure s = faces[first_face_[p] + k].chosen->substructure;
      if (s == Substructure::none || s == Substructure::cone) return false;
      any = true;
    }
    return any;
  }

  void hang_bottoms(Rim& rim, const std::vector<ActiveFace>& faces) const {
    const Rim above = rim;
    for (const RimItem& item : above) {
      if (item.what != RimItem::What::path) continue;
      const SurfacePath& path = paths_[item.path];
      if (!path.closed && (item.point == 0 || item.point + 1 == path.points.size())) continue;
      if (!has_bottom(item.path, item.point, faces)) continue;
      const Vec2 x(item.at.x(), sweep_.trail_height(item.at.x()));
      const double position = sweep_.rim_position(x, SweepRim::trail);
      if (position <= 1 || position >= 2 || !sees_trail(above, item, x.y())) continue;
      insert_on_trail(rim, {RimItem::What::bottom, item.path, item.point, x, position});
    }
  }

  // Nothing but tissue between a point and the trail beneath it.
  static bool sees_trail(const Rim& rim, const RimItem& item, double trail_height) {
    const double s = item.at.x(), h = item.at.y();
    if (h <= trail_height) return false;
    for (std::size_t i = 0; i < rim.size(); ++i) {
      const RimItem &a = rim[i], &b = rim[(i + 1) % rim.size()];
      if (a.what != RimItem::What::path || b.what != RimItem::What::path) continue;
      if ((a.at.x() < s) == (b.at.x() < s) || &a == &item) continue;
      const double t = (s - a.at.x()) / (b.at.x() - a.at.x());
      const double at = a.at.y() + t * (b.at.y() - a.at.y());
      if (at > trail_height && at < h - 1e-12) return false;
    }
    return true;
  }

  static void insert_on_trail(Rim& rim, const RimItem& bottom) {
    for (std::size_t i = 0; i < rim.size(); ++i) {
      const RimItem &a = rim[i], &b = rim[(i + 1) % rim.size()];
      const bool gap =
          a.what != RimItem::What::path || b.what != RimItem::What::path || a.path != b.path || b.point != a.point + 1;
      if (!gap || !(a.rim_position > bottom.rim_position && b.rim_position < bottom.rim_position)) continue;
      rim.insert(rim.begin() + static_cast<std::ptrdiff_t>(i) + 1, bottom);
      return;
    }
  }

  // Splits the active faces; afterwards every path is one of edges.
  bool subdivide_faces() {
    vertices_.resize(paths_.size());
    frames_.resize(paths_.size());
    for (std::size_t p = 0; p < paths_.size(); ++p) find_frames(p);
    for (std::size_t p = 0; p < paths_.size(); ++p) {
      const SurfacePath& path = paths_[p];
      std::vector<VertexId>& v = vertices_[p];
      for (std::size_t i = 0; i < path.points.size(); ++i) {
        if (path.points[i].kind == Kind::between) continue;
        const VertexId x = vertex_at(path, i, v.empty() ? kNone : v.back());
        if (x == kNone) return false;
        v.push_back(x);
        if (i > 0 && path.points[i - 1].kind == Kind::between) {
          const VertexId from = v[v.size() - 2];
          const VertexId middle =
              insert_on_edge(draft_, from, x, VertexState::mix(draft_.state(from), draft_.state(x), 0.5));
          if (middle == kNone) return false;
          v.insert(v.end() - 1, middle);
        }
      }
    }
    return true;
  }

  VertexId vertex_at(const SurfacePath& path, std::size_t i, VertexId before) {
    const PathPoint& p = path.points[i];
    if (p.kind == Kind::vertex) return p.from;
    if (p.kind == Kind::on_edge)
      return insert_on_edge(draft_, p.from, p.to, VertexState::mix(draft_.state(p.from), draft_.state(p.to), p.t));
    const VertexState state =
        VertexState::mix({draft_.state(p.face[0]), draft_.state(p.face[1]), draft_.state(p.face[2])}, p.bary);
    const TriangleId whole = draft_.find_triangle(p.face[0], p.face[1], p.face[2]);
    if (whole != kNone) return insert_in_face(draft_, whole, state);
    const PathPoint& origin = path.points[0];
    if (origin.kind == Kind::in_face && origin.face == p.face) {  // both ends in one face: the other end has divided it
      std::size_t least = 0;
      for (std::size_t k = 1; k < 3; ++k)
        if (p.bary[static_cast<int>(k)] * origin.bary[static_cast<int>(least)] <
            p.bary[static_cast<int>(least)] * origin.bary[static_cast<int>(k)])
          least = k;
      const TriangleId t = draft_.find_triangle(before, p.face[(least + 1) % 3], p.face[(least + 2) % 3]);
      return t != kNone ? insert_in_face(draft_, t, state) : kNone;
    }
    // The point before has divided the face from one of its edges.
    for (std::size_t k = 0; k < 3; ++k) {
      const Cell cell{before, {p.face[(k + 1) % 3], p.face[(k + 2) % 3], p.face[k]}};
      if (!triangles_of(draft_, cell).empty()) return insert_in_cell(draft_, cell, state);
    }
    return kNone;
  }

  void find_frames(std::size_t p) {
    const SurfacePath& path = paths_[p];
    frames_[p].resize(path.points.size());
    for (std::size_t i = 0; i < path.points.size(); ++i)
      for (const PathFace& f : path.faces) {
        const bool between = path.points[i].kind == Kind::between;
        if (!between && f.begin != static_cast<int>(i) && f.end != static_cast<int>(i)) continue;
        PathFrame& frame = frames_[p][i];
        if (frame.normal_world.isZero()) {
          frame.rest_from_world = rest_from_world(draft_, f.corners);
        }
        frame.normal_world += normal_of(f);
      }
  }

  static VertexState shifted(const VertexState& s, const Vec3& by_world, const Mat3& rest_from_world) {
    return {s.rest_body_m + rest_from_world * by_world, s.position_world_m + by_world, s.velocity_world_m_per_s};
  }

  Slit slit_of(const Rim& rim, TemplateStep& step) {
    Slit slit;
    std::vector<Vec3> half(rim.size(), Vec3::Zero());  // opening vectors, before anything moves
    for (std::size_t i = 0; i < rim.size(); ++i)
      if (rim[i].what == RimItem::What::path) half[i] = opening(rim[i]);
    for (std::size_t i = 0; i < rim.size(); ++i) slit.rim.push_back(inner_node(rim, i, step));
    for (std::size_t i = 0; i < rim.size(); ++i)
      if (rim[i].what == RimItem::What::path) slit.rim[i] = surface_node(rim[i], half[i]);
    for (std::size_t i = 0; i < rim.size(); ++i) {
      const RimItem &a = rim[i], &b = rim[(i + 1) % rim.size()];
      slit.rim[i].bottom_follows = on_trail(a, false) && on_trail(b, true) && (!same_path_edge(a, b));
      if (a.what != RimItem::What::bottom) continue;
      const auto top = std::find_if(rim.begin(), rim.end(), [&](const RimItem& r) {
        return r.what == RimItem::What::path && r.path == a.path && r.point == a.point;
      });
      slit.verticals.emplace_back(static_cast<std::size_t>(top - rim.begin()), i);
    }
    continue_bottoms(rim, slit, step);
    return slit;
  }

  bool same_path_edge(const RimItem& a, const RimItem& b) const {
    if (a.what != RimItem::What::path || b.what != RimItem::What::path || a.path != b.path) return false;
    return b.point == a.point + 1 || paths_[a.path].closed;
  }

  bool on_trail(const RimItem& r, bool arriving) const {
    switch (r.what) {
      case RimItem::What::bottom:
        return true;
      case RimItem::What::tip_last:
        return !arriving;
      case RimItem::What::tip_first:
        return arriving;
      default: {
        const SurfacePath& path = paths_[r.path];
        return !path.closed && path.points[r.point].rim == SweepRim::trail &&
               r.point == (arriving ? 0 : path.points.size() - 1);
      }
    }
  }

  // From the middle of the pair to its left half: half of open_top, square to the path, in the face.
  Vec3 opening(const RimItem& r) const {
    const std::vector<VertexId>& v = vertices_[r.path];
    const SurfacePath& path = paths_[r.path];
    const std::size_t n = v.size();
    const std::size_t before = r.point > 0 ? r.point - 1 : path.closed ? n - 1 : 0;
    const std::size_t after = r.point + 1 < n ? r.point + 1 : path.closed ? 0 : n - 1;
    const Vec3 along = draft_.position(v[after]) - draft_.position(v[before]);
    const Vec3 across = frames_[r.path][r.point].normal_world.cross(along).stableNormalized();
    const Vec3 here = draft_.position(v[r.point]);
    double half_m = settings_.open_top_m / 2;
    const std::vector<TriangleId> fan = draft_.fan(v[r.point]);
    std::set<VertexId> lips;  // of the cut so far
    for (const TriangleId t : fan)
      if (const Triangle wall = draft_.triangle(t); at_front(path.points[r.point]) && wall.surface == Surface::wall)
        lips.insert(wall.v.begin(), wall.v.end());
    for (const TriangleId t : fan)
      for (const VertexId x : draft_.triangle(t).v) {
        if (on_a_path(x) || lips.contains(x)) continue;
        const double beside_m = std::abs((draft_.position(x) - here).dot(across));
        if (beside_m > 1e-9) half_m = std::min(half_m, kWidestOpening * beside_m);
      }
    return half_m * across;
  }

  bool on_a_path(VertexId x) const {
    return std::any_of(vertices_.begin(), vertices_.end(),
                       [&](const auto& v) { return std::find(v.begin(), v.end(), x) != v.end(); });
  }

  void part(SlitNode& node, const Vec3& half_world, const Mat3& rest_from_world) {
    const VertexState state = draft_.state(node.left);
    node.right = draft_.add_vertex(shifted(state, -half_world, rest_from_world));
    draft_.move_vertex(node.left, shifted(state, half_world, rest_from_world));
  }

  SlitNode surface_node(const RimItem& r, const Vec3& half_world) {
    const std::vector<VertexId>& v = vertices_[r.path];
    const SurfacePath& path = paths_[r.path];
    SlitNode node;
    node.left = node.right = v[r.point];
    node.at = r.at;
    node.on_surface = true;
    const bool begins = !path.closed && r.point == 0, ends = !path.closed && r.point + 1 == v.size();
    if ((begins || ends) && !at_front(path.points[r.point])) return node;
    node.path_from = begins ? front_->bottom : v[(r.point + v.size() - 1) % v.size()];
    node.path_to = ends ? front_->top : v[(r.point + 1) % v.size()];
    part(node, half_world, frames_[r.path][r.point].rest_from_world);
    return node;
  }

  // Corners inside the body and bottoms. Those that are new are born above the tip's trail.
  SlitNode inner_node(const Rim& rim, std::size_t i, TemplateStep& step) {
    const RimItem& r = rim[i];
    SlitNode node;
    node.at = r.at;
    if (r.what == RimItem::What::path) return node;
    const std::size_t n = rim.size();
    const RimItem& top = r.what == RimItem::What::bottom     ? r
                         : r.what == RimItem::What::tip_last ? rim[(i + n - 1) % n]
                                                             : rim[(i + 1) % n];
    const VertexState above = draft_.state(vertices_[top.path][top.point]);
    const Mat3& to_rest = frames_[top.path][top.point].rest_from_world;
    const Vec3 half = settings_.open_bottom_m / 2 * sweep_.left;
    if (r.what == RimItem::What::tip_first && front_ && !front_->bottom_on_surface) {
      node.left = node.right = front_->bottom;
      node.path_from = front_->before_right;
      node.path_to = front_->top;
      part(node, half, to_rest);
      if (front_->bottom_at_tip) {
        step.bottoms_at_tip.emplace_back(node.left, shifted(*front_->bottom_at_tip, half, to_rest));
        step.bottoms_at_tip.emplace_back(node.right, shifted(*front_->bottom_at_tip, -half, to_rest));
      }
      return node;
    }
    const Vec3 tip = sweep_.origin + r.at.x() * sweep_.ahead + r.at.y() * sweep_.up;
    const Vec3 down = r.what == RimItem::What::bottom
                          ? Vec3((r.at.y() - sweep_.in_plane(above.position_world_m).y()) * sweep_.up)
                          : Vec3(tip - above.position_world_m);
    const auto add = [&](const Vec3& beside) {
      const VertexId v = draft_.add_vertex(shifted(above, settings_.bottom_at_birth * down + beside, to_rest));
      step.bottoms_at_tip.emplace_back(v, shifted(above, down + beside, to_rest));
      return v;
    };
    if (r.what == RimItem::What::bottom) {
      node.left = add(half);
      node.right = add(-half);
    } else {
      node.left = node.right = add(Vec3::Zero());
    }
    return node;
  }

  // The bottom of the cut so far leads up to the front's: its last face goes, its sides now end on the pair.
  void continue_bottoms(const Rim& rim, Slit& slit, TemplateStep& step) const {
    for (std::size_t i = 0; i < rim.size(); ++i) {
      const SlitNode& node = slit.rim[i];
      if (rim[i].what == RimItem::What::path) continue;
      step.bottoms[node.left] = node.right;
      step.bottoms[node.right] = node.left;
      if (rim[i].what != RimItem::What::tip_first || !node.pair()) continue;
      const VertexId l = front_->before_left, r = front_->before_right;
      if (l != r) {
        slit.old_bottoms.push_back({{node.left, l, r}, Surface::wall});
        slit.new_bottoms.push_back({{node.left, l, r}, Surface::wall});
        slit.new_bottoms.push_back({{node.left, r, node.right}, Surface::wall});
      } else {
        slit.new_bottoms.push_back({{node.left, l, node.right}, Surface::wall});
      }
    }
  }

  // Where the blade stands now: the upper end of the part of its line that is in the body, and the lower one.
  void find_front(const Rim& rim, const Slit& slit, TemplateStep& step) {
    const std::size_t n = rim.size();
    for (std::size_t i = 0; i < n; ++i) {
      if (rim[i].what != RimItem::What::path || paths_[rim[i].path].closed) continue;
      const SurfacePath& path = paths_[rim[i].path];
      if (rim[i].point + 1 != path.points.size() || path.points.back().rim != SweepRim::last_pose) continue;
      if (step.front && rim[i].rim_position < front_position_) continue;
      const std::size_t j = (i + 1) % n, k = (i + 2) % n;
      front_position_ = rim[i].rim_position;
      step.front = CutFront{slit.rim[i].left, slit.rim[j].left, rim[j].what == RimItem::What::path, kNone, kNone, {}};
      if (rim[j].what != RimItem::What::path) {
        step.front->before_left = slit.rim[k].left;
        step.front->before_right = slit.rim[k].right;
        for (const auto& [v, state] : step.bottoms_at_tip)
          if (v == step.front->bottom) step.front->bottom_at_tip = state;
      }
    }
  }

  MeshDraft& draft_;
  const BladeSweep& sweep_;
  const std::optional<CutFront>& front_;
  const TemplateSettings& settings_;
  std::vector<SurfacePath> paths_;
  std::vector<Rim> rims_;
  std::vector<std::size_t> first_face_;          // of each path among the active faces
  std::vector<std::vector<VertexId>> vertices_;  // of each path
  std::vector<std::vector<PathFrame>> frames_;
  double front_position_ = 0;
};

}  // namespace

TemplateStep cut_with_templates(MeshDraft& draft, const Blade& first, const Blade& last,
                                const std::optional<CutFront>& front, std::span<const TriangleId> active,
                                const TemplateSettings& settings) {
  const BladeSweep sweep = sweep_between(draft, first, last, front);
  if (!(sweep.length_m() >= settings.min_step_m)) return {};
  for (const double snap : {settings.snap_ratio, 0.0}) {
    auto paths = sweep_paths(draft, sweep, front, active, snap, settings.inset);
    if (!paths) break;
    if (paths->empty()) return {};
    TemplateStep step;
    MeshDraft trial = draft;
    if (!Step(trial, sweep, front, settings).run(std::move(*paths), step)) continue;
    draft = std::move(trial);
    step.outcome = TemplateOutcome::cut;
    return step;
  }
  TemplateStep refused;
  refused.outcome = TemplateOutcome::refused;
  return refused;
}

}  // namespace sectio
