#include "sim_server/surface/cutting/template_cut.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "sim_server/surface/cutting/slit.h"
#include "sim_server/surface/cutting/sweep_rim.h"
#include "sim_server/surface/cutting/templates.h"

namespace sectio {
namespace {

using Kind = PathPoint::Kind;

constexpr double kLeastPart_m = 1e-4;   // a shorter part of the edge is in a fold of the surface
constexpr double kWidestOpening = 0.4;  // largest width, over the distance to the nearest vertex beside the path
constexpr double kFolded = 0.7;         // cosine by which a face has turned against the body, and is in a fold

// The surface at a point of a path, before any change.
struct PathFrame {
  Vec3 normal_body = Vec3::Zero();
  Mat3 world_from_rest = Mat3::Identity();
};

class Step {
 public:
  Step(MeshDraft& draft, const BladeSweep& sweep, const SweepEnds& ends, const TemplateSettings& settings)
      : draft_(draft), sweep_(sweep), ends_(ends), settings_(settings) {}

  // Works in the order of the paper: templates, then the surface, then the structures inside. Returns why there is no
  // valid subdivision; empty when there is one.
  std::string_view run(std::vector<SurfacePath> paths, TemplateStep& step) {
    paths_ = std::move(paths);
    for (SurfacePath& path : paths_)
      if (!prepare(path)) return "the blade's path over the surface is too short";
    if (auto rims = join_paths(paths_, sweep_)) rims_ = std::move(*rims);
    if (rims_.empty()) return "the blade's paths over the surface don't make a whole";
    choose_templates(step.faces);
    for (Rim& rim : rims_) hang_bottoms(rim, step.faces);
    if (!subdivide_faces()) return "a face that the blade crosses can't be divided";
    std::vector<Slit> slits;
    for (const Rim& rim : rims_) slits.push_back(slit_of(rim, step));
    if (!ends_.may_part && std::any_of(slits.begin(), slits.end(), parts))
      return "nothing would hold the sides together";
    if (!open_slits(draft_, slits)) return "the faces along the cut can't be opened";
    for (std::size_t k = 0; k < rims_.size(); ++k) find_fronts(rims_[k], slits[k], step);
    if (std::ranges::any_of(step.starts, [&](const CutFront& f) { return leaves_bridge(f); }))
      return "the cut would begin anew beside its end";
    if (std::ranges::any_of(step.fronts, [&](const CutFront& f) { return is_sliver(f); }))
      return "the edge would end in a fold of the surface";
    return {};
  }

 private:
  // A second beginning right beside the front: a fold hides the way between them, which would stay uncut.
  bool leaves_bridge(const CutFront& start) const {
    const auto is_near = [&](VertexId a, VertexId b) {
      return (draft_.rest(a) - draft_.rest(b)).norm() < settings_.fold_m;
    };
    return std::ranges::any_of(ends_.fronts, [&](const CutFront& f) {
      return is_near(start.top, f.top) || is_near(start.top, f.bottom) || is_near(start.bottom, f.top) ||
             is_near(start.bottom, f.bottom);
    });
  }
  // A part of the edge this short is in a fold: the surface does not lead on from it, and a bridge would be left there.
  bool is_sliver(const CutFront& f) const {
    return f.bottom_on_surface && (draft_.rest(f.top) - draft_.rest(f.bottom)).norm() < kLeastPart_m;
  }
  // Does nothing hold the slit's two sides together?
  static bool parts(const Slit& slit) {
    return std::all_of(slit.rim.begin(), slit.rim.end(), [](const SlitNode& node) { return node.pair(); });
  }
  static bool at_front(const PathPoint& p) { return p.ridge != kNone; }

  // Gives each path a pair, which a slit needs: the middle of a path with two single ends and no point between.
  static bool prepare(SurfacePath& path) {
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
          face.angle = angle_class(sweep_.up, rest_normal_of(draft_, f.corners), settings_.right_angle_tolerance_rad);
          const bool tip_before = !path.closed && k == 0 && before.what == RimItem::What::tip_first;
          const bool tip_after = !path.closed && k + 1 == path.faces.size() && after.what == RimItem::What::tip_last;
          face.vertices_inside = tip_before + tip_after;
          face.chosen = &template_for(face.angle, face.active_edges, face.vertices_inside);
          faces.push_back(face);
        }
      }
  }

  // Does a pair of bottom vertices hang under the point? Yes, if all its faces have sides and a bottom of their own.
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

  // Is there only tissue between a point and the trail beneath it?
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

  // Divides the active faces; afterwards every path consists of edges.
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
    if (origin.kind == Kind::in_face && origin.face == p.face) {  // the other end has divided the face
      std::size_t least = 0;
      for (std::size_t k = 1; k < 3; ++k)
        if (p.bary[static_cast<int>(k)] * origin.bary[static_cast<int>(least)] <
            p.bary[static_cast<int>(least)] * origin.bary[static_cast<int>(k)])
          least = k;
      const TriangleId t = draft_.find_triangle(before, p.face[(least + 1) % 3], p.face[(least + 2) % 3]);
      return t != kNone ? insert_in_face(draft_, t, state) : kNone;
    }
    // The previous point has divided the face from one of its edges.
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
        if (frame.normal_body.isZero()) {
          frame.world_from_rest = world_from_rest(draft_, f.corners);
        }
        frame.normal_body += rest_normal_of(draft_, f.corners);
      }
  }

  static VertexState shifted(const VertexState& s, const Vec3& by_body, const Mat3& world_from_rest) {
    return {s.rest_body_m + by_body, s.position_world_m + world_from_rest * by_body, s.velocity_world_m_per_s};
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

  // The vector from the middle of the pair to its left half: half of open_top, square to the path, in the face.
  Vec3 opening(const RimItem& r) const {
    const std::vector<VertexId>& v = vertices_[r.path];
    const SurfacePath& path = paths_[r.path];
    const std::size_t n = v.size();
    const std::size_t before = r.point > 0 ? r.point - 1 : path.closed ? n - 1 : 0;
    const std::size_t after = r.point + 1 < n ? r.point + 1 : path.closed ? 0 : n - 1;
    const Vec3 along = draft_.rest(v[after]) - draft_.rest(v[before]);
    const Vec3 across = frames_[r.path][r.point].normal_body.cross(along).stableNormalized();
    const Vec3 here = draft_.rest(v[r.point]);
    double half_m = settings_.open_top_m / 2;
    const std::vector<TriangleId> fan = draft_.fan(v[r.point]);
    std::set<VertexId> lips;  // lips of the cut so far
    for (const TriangleId t : fan)
      if (const Triangle wall = draft_.triangle(t); at_front(path.points[r.point]) && wall.surface == Surface::wall)
        lips.insert(wall.v.begin(), wall.v.end());
    for (const TriangleId t : fan)
      for (const VertexId x : draft_.triangle(t).v) {
        if (on_a_path(x) || lips.contains(x)) continue;
        const double beside_m = std::abs((draft_.rest(x) - here).dot(across));
        if (beside_m > 1e-9) half_m = std::min(half_m, kWidestOpening * beside_m);
      }
    return half_m * across;
  }

  bool on_a_path(VertexId x) const {
    return std::any_of(vertices_.begin(), vertices_.end(),
                       [&](const auto& v) { return std::find(v.begin(), v.end(), x) != v.end(); });
  }

  void part(SlitNode& node, const Vec3& half_body, const Mat3& world_from_rest) {
    const VertexState state = draft_.state(node.left);
    node.right = draft_.add_vertex(shifted(state, -half_body, world_from_rest));
    draft_.move_vertex(node.left, shifted(state, half_body, world_from_rest));
  }

  SlitNode surface_node(const RimItem& r, const Vec3& half_body) {
    const std::vector<VertexId>& v = vertices_[r.path];
    const SurfacePath& path = paths_[r.path];
    SlitNode node;
    node.left = node.right = v[r.point];
    node.at = r.at;
    node.on_surface = true;
    const bool begins = !path.closed && r.point == 0, ends = !path.closed && r.point + 1 == v.size();
    if ((begins || ends) && !at_front(path.points[r.point])) return node;
    node.path_from = begins ? path.points[r.point].ridge : v[(r.point + v.size() - 1) % v.size()];
    node.path_to = ends ? path.points[r.point].ridge : v[(r.point + 1) % v.size()];
    part(node, half_body, frames_[r.path][r.point].world_from_rest);
    return node;
  }

  // Tissue below a face has turned with it, unless that belongs to a folded lip: then it says nothing about what is
  // deep below, and bottoms are made where the blade is.
  Mat3 rotation_below(const PathFrame& frame) const {
    const double turned = 0.5 * ((frame.world_from_rest.transpose() * ends_.world_from_rest).trace() - 1);
    return turned > kFolded ? frame.world_from_rest : ends_.world_from_rest;
  }

  // A corner inside the body, or a bottom. New ones are made above the tip's trail.
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
    const Mat3 to_world = rotation_below(frames_[top.path][top.point]);
    const Vec3 half = settings_.open_bottom_m / 2 * sweep_.left;
    if (const CutFront* f = front_above(top); f && r.what != RimItem::What::bottom) {
      node.left = node.right = f->bottom;
      if (f->bottom_on_surface) return node;  // the other groove comes out below here, this one doesn't
      const bool goes_on = r.what == RimItem::What::tip_first;
      node.path_from = goes_on ? f->before_right : f->top;
      node.path_to = goes_on ? f->top : f->before_left;
      part(node, half, to_world);
      if (f->bottom_at_tip) {
        step.bottoms_at_tip.emplace_back(node.left, shifted(*f->bottom_at_tip, half, to_world));
        step.bottoms_at_tip.emplace_back(node.right, shifted(*f->bottom_at_tip, -half, to_world));
      }
      return node;
    }
    const Vec3 tip = sweep_.origin + r.at.x() * sweep_.ahead + r.at.y() * sweep_.up;
    const Vec3 down = r.what == RimItem::What::bottom
                          ? Vec3((r.at.y() - sweep_.in_plane(above.rest_body_m).y()) * sweep_.up)
                          : Vec3(tip - above.rest_body_m);
    const auto add = [&](const Vec3& beside) {
      const VertexId v = draft_.add_vertex(shifted(above, settings_.bottom_at_birth * down + beside, to_world));
      step.bottoms_at_tip.emplace_back(v, shifted(above, down + beside, to_world));
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

  // The front at which a path begins or ends.
  const CutFront* front_above(const RimItem& top) const {
    const PathPoint& p = paths_[top.path].points[top.point];
    if (!at_front(p)) return nullptr;
    if (ends_.target && p.from == ends_.target->top) return &*ends_.target;
    const auto f = std::find_if(ends_.fronts.begin(), ends_.fronts.end(),
                                [&](const CutFront& front) { return front.top == p.from; });
    return f != ends_.fronts.end() ? &*f : nullptr;
  }

  // Joins the bottom of the cut so far: its last face, which led up to the front, is discarded, and its sides now end
  // on the pair. The bottom of a groove that is joined is treated alike, seen from the other side.
  void continue_bottoms(const Rim& rim, Slit& slit, TemplateStep& step) const {
    for (std::size_t i = 0; i < rim.size(); ++i) {
      const SlitNode& node = slit.rim[i];
      if (rim[i].what == RimItem::What::path) continue;
      step.bottoms.insert({node.left, node.right});
      if (rim[i].what == RimItem::What::bottom || !node.pair()) continue;
      const bool goes_on = rim[i].what == RimItem::What::tip_first;
      const CutFront& f = *front_above(rim[goes_on ? (i + 1) % rim.size() : (i + rim.size() - 1) % rim.size()]);
      const VertexId a = goes_on ? node.left : node.right, b = goes_on ? node.right : node.left;
      const VertexId l = f.before_left, r = f.before_right;  // beside a and b
      if (l != r) {
        slit.old_bottoms.push_back({{f.bottom, l, r}, Surface::wall});
        slit.new_bottoms.push_back({{a, l, r}, Surface::wall});
        slit.new_bottoms.push_back({{a, r, b}, Surface::wall});
      } else {
        slit.new_bottoms.push_back({{a, l, b}, Surface::wall});
      }
    }
  }

  // The fronts at the blade's last pose, and at its first: the parts of each of these lines that are in the body.
  void find_fronts(const Rim& rim, const Slit& slit, TemplateStep& step) const {
    const std::size_t n = rim.size();
    for (std::size_t i = 0; i < n; ++i) {
      if (rim[i].what != RimItem::What::path || paths_[rim[i].path].closed) continue;
      const SurfacePath& path = paths_[rim[i].path];
      const PathPoint& p = path.points[rim[i].point];
      if (at_front(p)) continue;
      if (rim[i].point + 1 == path.points.size() && p.rim == SweepRim::last_pose) {
        const std::size_t j = (i + 1) % n, k = (i + 2) % n;
        step.fronts.push_back(front_of(rim, slit, {i, j}, slit.rim[k].left, slit.rim[k].right, step));
        step.fronts.back().ahead_body = sweep_.ahead;
      }
      if (rim[i].point == 0 && p.rim == SweepRim::first_pose) {
        const std::size_t j = (i + n - 1) % n, k = (i + n - 2) % n;
        step.starts.push_back(front_of(rim, slit, {i, j}, slit.rim[k].right, slit.rim[k].left, step));
        step.starts.back().ahead_body = -sweep_.ahead;
      }
    }
    const auto height = [&](const CutFront& f) { return sweep_.in_plane(draft_.rest(f.top)).y(); };
    std::sort(step.fronts.begin(), step.fronts.end(),
              [&](const CutFront& a, const CutFront& b) { return height(a) > height(b); });
  }

  CutFront front_of(const Rim& rim, const Slit& slit, std::array<std::size_t, 2> ends, VertexId before_left,
                    VertexId before_right, const TemplateStep& step) const {
    const bool on_surface = rim[ends[1]].what == RimItem::What::path;
    CutFront f{slit.rim[ends[0]].left, slit.rim[ends[1]].left, on_surface, kNone, kNone, {}, {}};
    if (on_surface) return f;
    f.before_left = before_left;
    f.before_right = before_right;
    for (const auto& [v, state] : step.bottoms_at_tip)
      if (v == f.bottom) f.bottom_at_tip = state;
    return f;
  }

  MeshDraft& draft_;
  const BladeSweep& sweep_;
  const SweepEnds& ends_;
  const TemplateSettings& settings_;
  std::vector<SurfacePath> paths_;
  std::vector<Rim> rims_;
  std::vector<std::size_t> first_face_;          // by path: index of its first face in the active faces
  std::vector<std::vector<VertexId>> vertices_;  // by path
  std::vector<std::vector<PathFrame>> frames_;
};

}  // namespace

std::array<PathSnap, 5> snaps_to_try(const TemplateSettings& settings) {
  return {PathSnap{settings.snap_ratio}, PathSnap{}, PathSnap{settings.snap_ratio, settings.snap_within_m},
          PathSnap{settings.snap_ratio, settings.snap_within_m, settings.fold_m}, PathSnap{0, 0, settings.fold_m}};
}

TemplateStep cut_with_templates(MeshDraft& draft, const RestBlade& first, const RestBlade& last, const SweepEnds& ends,
                                std::span<const TriangleId> active, const TemplateSettings& settings) {
  const BladeSweep sweep = sweep_between(draft, first, last, ends.fronts);
  if (!(sweep.length_m() >= settings.min_step_m)) return {};
  TemplateStep refused;
  refused.outcome = TemplateOutcome::refused;
  for (const PathSnap& snap : snaps_to_try(settings)) {
    auto paths = sweep_paths(draft, sweep, ends, active, snap, settings.inset);
    if (!paths) {
      refused.why = kNoPath;
      continue;
    }
    if (paths->empty()) return {};
    TemplateStep step;
    MeshDraft trial = draft;
    refused.why = Step(trial, sweep, ends, settings).run(std::move(*paths), step);
    if (!refused.why.empty()) continue;
    draft = std::move(trial);
    step.outcome = TemplateOutcome::cut;
    return step;
  }
  return refused;
}

}  // namespace sectio
