#include "sim_server/collision/surface_tree.h"

#include <fcl/broadphase/detail/hierarchy_tree.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <tuple>

#include "common/core/error.h"
#include "common/mesh/slot_table.h"

namespace sectio {
namespace {

using FclBox = fcl::AABB<double>;
using Tree = fcl::detail::HierarchyTree<FclBox>;
using Node = fcl::detail::NodeBase<FclBox>;

// With fewer leaves FCL joins the closest pairs, at cubic cost.
constexpr int kBottomUpLeaves = 6;
// A vertex gets a new anchor a little before it could leave the boxes.
constexpr double kTrigger = 0.99;
// Boxes of a body that moves as a whole are refitted instead of inserted one by one.
constexpr std::size_t kRefitFraction = 8;
constexpr double kRounding_m = 1e-9;     // far above the rounding of lengths of metres
constexpr std::size_t kStackSize = 192;  // more than the greatest depth of a tree of 2^32 leaves

TriangleId triangle_of(const Node* leaf) {
  return static_cast<TriangleId>(reinterpret_cast<std::uintptr_t>(leaf->data));
}
void* data_of(TriangleId t) {
  return reinterpret_cast<void*>(static_cast<std::uintptr_t>(t));  // NOLINT(performance-no-int-to-ptr): FCL's own slot
}

Box3 box_of(const Node* node) {
  return Box3(node->bv.min_, node->bv.max_);
}

std::size_t floor_log2(std::size_t n) {
  return static_cast<std::size_t>(std::bit_width(n | 1)) - 1;
}

// Builds a tree by halving the leaves at their median along the longest side of their box. The inner nodes come from
// `inner`, the root first.
Node* build_halves(std::span<Node*> leaves, Node**& inner) {
  if (leaves.size() == 1) return leaves[0];
  Node* node = *inner++;
  node->bv = leaves[0]->bv;
  for (const Node* leaf : leaves) node->bv += leaf->bv;
  Eigen::Index axis = 0;
  (node->bv.max_ - node->bv.min_).maxCoeff(&axis);
  const std::size_t half = leaves.size() / 2;
  std::nth_element(leaves.begin(), leaves.begin() + static_cast<std::ptrdiff_t>(half), leaves.end(),
                   [axis](const Node* x, const Node* y) {
                     const double cx = x->bv.min_[axis] + x->bv.max_[axis], cy = y->bv.min_[axis] + y->bv.max_[axis];
                     return cx != cy ? cx < cy : x->data < y->data;
                   });
  node->children[0] = build_halves(leaves.first(half), inner);
  node->children[1] = build_halves(leaves.subspan(half), inner);
  node->children[0]->parent = node->children[1]->parent = node;
  return node;
}

std::size_t leaf_count(const Node* node) {
  return node->isLeaf() ? 1 : leaf_count(node->children[0]) + leaf_count(node->children[1]);
}

void collect(Node* node, std::vector<Node*>& leaves, std::vector<Node*>& inner) {
  if (node->isLeaf()) {
    leaves.push_back(node);
    return;
  }
  inner.push_back(node);
  collect(node->children[0], leaves, inner);
  collect(node->children[1], leaves, inner);
}

// FCL inserts a new leaf beside the nearest one, so that a stroke would grow the tree into a list. Like a scapegoat
// tree (Galperin & Rivest 1993), when a leaf lies too deep, the subtree of its lowest unbalanced ancestor is rebuilt in
// place; O(log n) amortised.
void balance_above(Node* leaf, std::size_t leaves_in_tree) {
  std::size_t depth = 0;
  for (const Node* node = leaf; node->parent; node = node->parent) ++depth;
  if (depth <= 2 * floor_log2(leaves_in_tree) + 16) return;
  std::size_t height = 0, count = 1;
  Node* node = leaf;
  while (node->parent && height <= 2 * floor_log2(count) + 8) {
    const Node* parent = node->parent;
    count += leaf_count(parent->children[parent->children[0] == node ? 1 : 0]);
    node = node->parent;
    ++height;
  }
  std::vector<Node*> leaves, inner;
  collect(node, leaves, inner);
  Node** next = inner.data();
  build_halves(leaves, next);
}

// Calls on_leaf(triangle) for each leaf whose path of boxes satisfies overlaps(box).
template <class Overlaps, class OnLeaf>
void visit(const Tree& tree, const Overlaps& overlaps_box, const OnLeaf& on_leaf) {
  const Node* root = tree.getRoot();
  if (!root) return;
  std::array<const Node*, kStackSize> stack;
  std::size_t top = 0;
  stack[top++] = root;
  while (top > 0) {
    const Node* node = stack[--top];
    if (!overlaps_box(box_of(node))) continue;
    if (node->isLeaf()) {
      on_leaf(triangle_of(node));
      continue;
    }
    SECTIO_ASSERT(top + 2 <= kStackSize, "a balanced tree is not that deep");
    stack[top++] = node->children[1];
    stack[top++] = node->children[0];
  }
}

}  // namespace

struct SurfaceTree::Hierarchy {
  double margin_m;
  Tree tree{kBottomUpLeaves};
  std::vector<Node*> leaves;        // one a triangle slot; null when dead
  std::vector<Vec3f> anchors;       // one a vertex slot
  std::vector<std::uint32_t> seen;  // one a triangle slot: the round in which it was refitted
  std::uint32_t round = 0;
  std::vector<VertexId> moved;  // scratch
  std::vector<TriangleId> dirty;

  explicit Hierarchy(double margin) : margin_m(margin) {}

  FclBox fat_box(const TriangleMesh& mesh, TriangleId t) const {
    const auto& v = mesh.triangle(t).v;
    const auto& a = anchors[v[0]].cast<double>().eval();
    FclBox box(a, anchors[v[1]].cast<double>(), anchors[v[2]].cast<double>());
    return box.expand(Vec3::Constant(margin_m));
  }

  void resize(const TriangleMesh& mesh) {
    const float nowhere = std::numeric_limits<float>::infinity();
    resize_slots<Vec3f>(anchors, mesh.vertex_slots(), Vec3f::Constant(nowhere));
    resize_slots<Node*>(leaves, mesh.triangle_slots(), nullptr);
    resize_slots(seen, mesh.triangle_slots(), 0u);
  }

  bool left_margin(VertexId v, const Vec3f& x) const {
    const float trigger = static_cast<float>(kTrigger * margin_m);
    return !((x - anchors[v]).cwiseAbs().maxCoeff() <= trigger);
  }

  void insert(const TriangleMesh& mesh, TriangleId t) {
    leaves[t] = tree.insert(fat_box(mesh, t), data_of(t));
    balance_above(leaves[t], tree.size());
  }

  void remove(TriangleId t) {
    if (t >= leaves.size() || !leaves[t]) return;
    tree.remove(leaves[t]);
    leaves[t] = nullptr;
  }

  // A box of a leaf that is larger than its anchors ask for: FCL keeps one that contains the new one.
  struct LargerBox {
    TriangleId triangle = kNone;
    Vec3 min_m, max_m;

    template <class A>
    void archive(A& a) {
      a(triangle, min_m, max_m);
    }
  };

  // Makes the tree anew, of all living triangles.
  void build(const TriangleMesh& mesh, std::span<const LargerBox> larger) {
    std::vector<Node*> live;
    live.reserve(mesh.triangle_count());
    for (TriangleId t = 0; t < mesh.triangle_slots(); ++t) {
      if (!mesh.triangle(t).alive()) continue;
      Node* leaf = new Node;
      leaf->bv = fat_box(mesh, t);
      leaf->parent = nullptr;
      leaf->children[1] = nullptr;
      leaf->data = data_of(t);
      leaves[t] = leaf;
      live.push_back(leaf);
    }
    for (const LargerBox& box : larger)
      if (box.triangle < leaves.size() && leaves[box.triangle])
        leaves[box.triangle]->bv.min_ = box.min_m, leaves[box.triangle]->bv.max_ = box.max_m;
    if (!live.empty()) tree.init(live);  // the tree owns the leaves from here on
  }

  std::vector<LargerBox> larger_boxes(const TriangleMesh& mesh) const {
    std::vector<LargerBox> larger;
    for (TriangleId t = 0; t < leaves.size(); ++t) {
      if (!leaves[t]) continue;
      const FclBox& box = leaves[t]->bv;
      const FclBox fat = fat_box(mesh, t);
      if (box.min_ != fat.min_ || box.max_ != fat.max_) larger.push_back({t, box.min_, box.max_});
    }
    return larger;
  }

  // Marks all triangles at v that are in the tree, once a round.
  void mark_around(const TriangleMesh& mesh, VertexId v) {
    const TriangleId first = mesh.incident(v);
    TriangleId t = first;
    do {
      if (leaves[t] && seen[t] != round) {
        seen[t] = round;
        dirty.push_back(t);
      }
      t = mesh.neighbour(t, mesh.triangle(t).corner_of(v));
    } while (t != first);
  }

  // Gives new anchors to the vertices in `moved` and new boxes to the triangles around them.
  void anchor_moved(const SurfaceView& view) {
    for (const VertexId v : moved) anchors[v] = view.positions_world_m[v];
    if (moved.size() * kRefitFraction > anchors.size()) {
      for (TriangleId t = 0; t < leaves.size(); ++t)
        if (leaves[t]) leaves[t]->bv = fat_box(view.mesh, t);
      tree.refit();
      return;
    }
    ++round;
    dirty.clear();
    for (const VertexId v : moved) mark_around(view.mesh, v);
    for (const TriangleId t : dirty)
      if (tree.update(leaves[t], fat_box(view.mesh, t))) balance_above(leaves[t], tree.size());
  }
};

SurfaceTree::SurfaceTree(const SurfaceView& view, double margin_m) : hierarchy_(std::make_unique<Hierarchy>(margin_m)) {
  Hierarchy& h = *hierarchy_;
  h.resize(view.mesh);
  for (VertexId v = 0; v < h.anchors.size(); ++v)
    if (view.mesh.vertex_alive(v)) h.anchors[v] = view.positions_world_m[v];
  h.build(view.mesh, {});
}

SurfaceTree::~SurfaceTree() = default;
SurfaceTree::SurfaceTree(SurfaceTree&&) noexcept = default;
SurfaceTree& SurfaceTree::operator=(SurfaceTree&&) noexcept = default;

std::size_t SurfaceTree::update_moved(const SurfaceView& view) {
  Hierarchy& h = *hierarchy_;
  h.moved.clear();
  for (VertexId v = 0; v < h.anchors.size(); ++v)
    if (h.left_margin(v, view.positions_world_m[v]) && view.mesh.vertex_alive(v)) h.moved.push_back(v);
  if (!h.moved.empty()) h.anchor_moved(view);
  return h.moved.size();
}

std::size_t SurfaceTree::update_moved(const SurfaceView& view, std::span<const VertexId> moved) {
  Hierarchy& h = *hierarchy_;
  h.moved.clear();
  for (const VertexId v : moved)
    if (view.mesh.vertex_alive(v) && h.left_margin(v, view.positions_world_m[v])) h.moved.push_back(v);
  if (!h.moved.empty()) h.anchor_moved(view);
  return h.moved.size();
}

void SurfaceTree::update_changed(const SurfaceView& view, std::span<const TriangleId> changed) {
  Hierarchy& h = *hierarchy_;
  for (const TriangleId t : changed) h.remove(t);
  h.resize(view.mesh);  // slots at the end may also be gone
  h.moved.clear();
  for (const TriangleId t : changed)
    if (view.alive(t))
      for (const VertexId v : view.mesh.triangle(t).v)
        if (h.left_margin(v, view.positions_world_m[v])) {  // the vertex is new, or its slot had another vertex
          h.anchors[v] = view.positions_world_m[v];
          h.moved.push_back(v);
        }
  for (const TriangleId t : changed)
    if (view.alive(t) && !h.leaves[t]) h.insert(view.mesh, t);
  if (!h.moved.empty()) h.anchor_moved(view);
}

void SurfaceTree::follow(const SharedBody& body, const TopologyChange& change) {
  const SurfaceView view{body.mesh, body.positions_world_m(), body.id};
  update_changed(view, change.triangles);
  update_moved(view, change.placed);
}

std::size_t SurfaceTree::size() const {
  return hierarchy_->tree.size();
}
std::size_t SurfaceTree::depth() const {
  return hierarchy_->tree.getMaxHeight();
}

// Results depend on the boxes of the leaves, not on the shape of the tree.
void SurfaceTree::archive(Archive& a, const SharedBody& body) {
  std::vector<Hierarchy::LargerBox> larger;
  if (a.reads())
    hierarchy_ = std::make_unique<Hierarchy>(hierarchy_->margin_m);
  else
    larger = hierarchy_->larger_boxes(body.mesh);
  a(hierarchy_->anchors, larger);
  if (!a.reads()) return;
  hierarchy_->resize(body.mesh);
  hierarchy_->build(body.mesh, larger);
}

Box3 SurfaceTree::bounds_world_m() const {
  const Node* root = hierarchy_->tree.getRoot();
  return root ? box_of(root) : Box3();
}

std::vector<SurfaceHit> SurfaceTree::hits(const SurfaceView& view, const Vec3& p, const Vec3& q) const {
  std::vector<SurfaceHit> found;
  visit(
      hierarchy_->tree, [&](const Box3& box) { return overlaps(p, q, box); },
      [&](TriangleId t) {
        if (auto hit = hit_triangle(view, t, p, q)) found.push_back(*hit);
      });
  sort_hits(found);
  return found;
}

std::optional<SurfaceHit> SurfaceTree::first_hit(const SurfaceView& view, const Vec3& p, const Vec3& q) const {
  std::optional<SurfaceHit> best;
  Vec3 end = q;
  visit(
      hierarchy_->tree, [&](const Box3& box) { return overlaps(p, end, box); },
      [&](TriangleId t) {
        const auto hit = hit_triangle(view, t, p, q);
        if (!hit) return;
        if (best && std::tie(best->parameter, best->triangle) <= std::tie(hit->parameter, hit->triangle)) return;
        best = hit;
        end = p + hit->parameter * (q - p);
      });
  return best;
}

bool SurfaceTree::inside(const SurfaceView& view, const Vec3& point) const {
  const Box3 bounds = bounds_world_m();
  if (bounds.isEmpty() || !bounds.contains(point)) return false;
  const Vec3 direction(bounds.max().x() + bounds.sizes().x() - point.x(), 0, 0);  // ends well outside
  std::size_t crossings = 0;
  visit(
      hierarchy_->tree, [&](const Box3& box) { return overlaps(point, point + direction, box); },
      [&](TriangleId t) { crossings += cross_ray(point, direction, view.corners(t)).has_value(); });
  return crossings % 2 == 1;
}

std::optional<ClosestSurfacePoint> SurfaceTree::closest(const SurfaceView& view, const Vec3& point,
                                                        double within_m) const {
  std::optional<ClosestSurfacePoint> best;
  double limit = within_m * within_m;
  visit(
      hierarchy_->tree, [&](const Box3& box) { return box.squaredExteriorDistance(point) <= limit; },
      [&](TriangleId t) {
        const ClosestPoint c = closest_on_triangle(point, view.corners(t));
        if (c.squared_distance > limit) return;
        if (best && c.squared_distance == limit && best->triangle < t) return;
        limit = c.squared_distance;
        best = ClosestSurfacePoint{t, c.bary, c.point, std::sqrt(c.squared_distance)};
      });
  return best;
}

std::vector<EdgeCrossing> SurfaceTree::swept(const SurfaceView& view, const SweptSegment& sweep) const {
  std::vector<TriangleId> near;
  const std::array<Vec3, 2> ends{sweep.a1, sweep.b1};
  const std::array<std::array<std::size_t, 2>, 1> segment{{{0, 1}}};
  near_segments(view, ends, segment, reach_of(sweep), near);
  return cross_edges(view, near, sweep);
}

void SurfaceTree::near_segments(const SurfaceView& view, std::span<const Vec3> points,
                                std::span<const std::array<std::size_t, 2>> segments, double reach_m,
                                std::vector<TriangleId>& out) const {
  out.clear();
  const auto is_near = [&](const Box3& box) {
    const Box3 reached = grown(box, reach_m + kRounding_m);
    return std::any_of(segments.begin(), segments.end(),
                       [&](const auto& s) { return overlaps(points[s[0]], points[s[1]], reached); });
  };
  visit(hierarchy_->tree, is_near, [&](TriangleId t) {
    if (is_near(box_of(view.corners(t)))) out.push_back(t);
  });
  std::sort(out.begin(), out.end());
}

void SurfaceTree::in_box(const SurfaceView& view, const Box3& box, std::vector<TriangleId>& out) const {
  out.clear();
  visit(
      hierarchy_->tree, [&](const Box3& node) { return node.intersects(box); },
      [&](TriangleId t) {
        if (box_of(view.corners(t)).intersects(box)) out.push_back(t);
      });
  std::sort(out.begin(), out.end());
}

}  // namespace sectio
