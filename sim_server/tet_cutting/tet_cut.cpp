#include "sim_server/tet_cutting/tet_cut.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "common/core/error.h"

namespace sectio {
namespace {

struct Crossing {
  VertexId a, b;  // a < b
  double t;       // from a
  bool operator<(const Crossing& o) const { return a != o.a ? a < o.a : b < o.b; }
  bool operator==(const Crossing& o) const { return a == o.a && b == o.b; }
};

class SheetCut {
 public:
  SheetCut(TetTopology& volume, const CutSheet& sheet, const TetCutSettings& settings)
      : volume_(volume), outline_(sheet.outline_world_m), settings_(settings) {
    SECTIO_ASSERT(outline_.size() >= 3, "a sheet has three corners");
    for (std::size_t i = 2; i < outline_.size(); ++i)
      normal_ += (outline_[i - 1] - outline_[0]).cross(outline_[i] - outline_[0]);
    const double area = normal_.norm();
    flat_ = !(area > 0);
    if (!flat_) normal_ /= area;
    for (const Vec3& p : outline_) centre_ += p / static_cast<double>(outline_.size());
    for (const VertexId v : sheet.joined) {
      set_side(v, 0);
      on_sheet_.push_back(v);
      joined_[v] = true;
    }
  }

  TetCutOutcome run(std::span<const std::uint32_t> begin) {
    if (flat_) return outcome_;
    find(begin);
    snap();
    for (const Crossing& c : crossings_) {
      const VertexId n = volume_.split(c.a, c.b, c.t);
      on_sheet_.push_back(n);
      set_side(n, 0);
      ++outcome_.splits;
    }
    std::sort(on_sheet_.begin(), on_sheet_.end());
    for (std::size_t k = 0, end = on_sheet_.size(); k < end; ++k) separate(on_sheet_[k]);
    std::sort(on_sheet_.begin(), on_sheet_.end());
    outcome_.on_sheet = std::move(on_sheet_);
    outcome_.made = static_cast<std::uint32_t>(volume_.tetrahedra().size()) - tets_before_;
    return outcome_;
  }

 private:
  // Signed distance from the plane; on it counts as above (simulation of simplicity).
  double height(VertexId v) const {
    const double h = normal_.dot(volume_.vertex(v).position_world_m - centre_);
    return h == 0 ? 1e-300 : h;
  }
  bool inside(const Vec3& p) const {
    for (std::size_t i = 0; i < outline_.size(); ++i) {
      const Vec3& a = outline_[i];
      const Vec3& b = outline_[(i + 1) % outline_.size()];
      if ((b - a).cross(p - a).dot(normal_) < 0) return false;
    }
    return true;
  }

  // -1, 1 beside the sheet, 0 on it; by vertex, as far as it is known to matter.
  int side(VertexId v) const {
    const auto known = side_.find(v);
    return known != side_.end() ? known->second : height(v) > 0 ? 1 : -1;
  }
  void set_side(VertexId v, int side) { side_[v] = side; }

  struct Crossed {
    std::uint32_t count = 0, beside = 0;  // edges across the plane: inside the outline, outside it
  };
  // Appends the edges of a tetrahedron that cross the sheet.
  Crossed cross(std::uint32_t t, std::vector<Crossing>& out) const {
    const Tetrahedron& c = volume_.tetrahedra()[t];
    std::array<double, 4> h;
    for (std::size_t i = 0; i < 4; ++i) h[i] = height(c[i]);
    Crossed crossed;
    for (const auto& [i, j] : kTetEdges) {
      if ((h[i] > 0) == (h[j] > 0)) continue;
      const std::size_t a = c[i] < c[j] ? i : j, b = a == i ? j : i;
      const double along = h[a] / (h[a] - h[b]);
      const Vec3& from = volume_.vertex(c[a]).position_world_m;
      if (inside(from + along * (volume_.vertex(c[b]).position_world_m - from))) {
        out.push_back({c[a], c[b], along});
        ++crossed.count;
      } else {
        ++crossed.beside;
      }
    }
    return crossed;
  }

  void visit(std::uint32_t t) {
    const std::size_t first = crossings_.size();
    const Crossed crossed = cross(t, crossings_);
    outcome_.crossed += crossed.count > 0;
    if (settings_.semi_progressive && crossed.beside > 0) crossings_.resize(first);
  }

  void find(std::span<const std::uint32_t> begin) {
    tets_before_ = static_cast<std::uint32_t>(volume_.tetrahedra().size());
    if (begin.empty()) {
      for (std::uint32_t t = 0; t < tets_before_; ++t)
        if (volume_.tetrahedra()[t] != kNoTetrahedron) visit(t);
    } else {
      follow(begin);
    }
    std::sort(crossings_.begin(), crossings_.end());
    crossings_.erase(std::unique(crossings_.begin(), crossings_.end()), crossings_.end());
  }

  // Through the stars of crossed edges' ends.
  void follow(std::span<const std::uint32_t> begin) {
    std::vector<std::uint32_t> queue(begin.begin(), begin.end());
    std::unordered_map<std::uint32_t, bool> seen;
    for (const std::uint32_t t : queue) seen[t] = true;
    std::vector<Crossing> edges;
    for (std::size_t k = 0; k < queue.size(); ++k) {
      visit(queue[k]);
      edges.clear();
      cross(queue[k], edges);
      for (const Crossing& c : edges)
        for (const std::uint32_t t : volume_.star(c.a)) {
          const Tetrahedron& corners = volume_.tetrahedra()[t];
          if (std::ranges::find(corners, c.b) != corners.end() && seen.try_emplace(t, true).second) queue.push_back(t);
        }
    }
  }

  void snap() {
    for (const Crossing& c : crossings_) {
      if (c.t <= settings_.snap) snap_to(c.a);
      if (c.t >= 1 - settings_.snap) snap_to(c.b);
    }
    std::erase_if(crossings_, [&](const Crossing& c) { return side(c.a) == 0 || side(c.b) == 0; });
  }
  void snap_to(VertexId v) {
    if (side(v) == 0) return;
    set_side(v, 0);
    on_sheet_.push_back(v);
    ++outcome_.snapped;
  }

  int sum_of_sides(std::uint32_t t) const {
    int sum = 0;
    for (const VertexId v : volume_.tetrahedra()[t]) sum += side(v);
    return sum;
  }
  // Of a tetrahedron with a face on the sheet: the side of its other corner. One that is all on the sheet stays with
  // the neighbour that it shares the largest face with: else it would come off as a crumb.
  int side_of(std::uint32_t t) const {
    if (const int sum = sum_of_sides(t); sum != 0) return sum > 0 ? 1 : -1;
    const Tetrahedron& c = volume_.tetrahedra()[t];
    double largest = 0, heights = 0;
    int with = 0;
    for (std::size_t corner = 0; corner < 4; ++corner) {
      heights += height(c[corner]);
      const std::uint32_t u = volume_.across(t, corner);
      const int sum = u == kNone ? 0 : sum_of_sides(u);
      const auto& [i, j, k] = kTetFaces[corner];
      const Vec3& p = volume_.vertex(c[i]).rest_body_m;
      const double area = (volume_.vertex(c[j]).rest_body_m - p).cross(volume_.vertex(c[k]).rest_body_m - p).norm();
      if (sum == 0 || area <= largest) continue;
      largest = area;
      with = sum > 0 ? 1 : -1;
    }
    return with != 0 ? with : heights > 0 ? 1 : -1;
  }
  bool cut_between(std::uint32_t t, std::uint32_t u, const std::array<VertexId, 3>& face) const {
    for (const VertexId v : face)
      if (side(v) != 0) return false;
    if (side_of(t) == side_of(u)) return false;
    if (std::ranges::any_of(face, [&](VertexId v) { return joined_.contains(v); })) return true;
    Vec3 middle = Vec3::Zero();
    for (const VertexId v : face) middle += volume_.vertex(v).position_world_m / 3;
    return inside(middle);
  }

  void separate(VertexId v) {
    struct FaceAt {
      VertexId u, w;
      std::uint32_t place;
      bool operator<(const FaceAt& o) const { return u != o.u ? u < o.u : w != o.w ? w < o.w : place < o.place; }
    };
    const std::vector<std::uint32_t> star(volume_.star(v).begin(), volume_.star(v).end());
    std::vector<FaceAt> faces;
    for (std::uint32_t place = 0; place < star.size(); ++place) {
      std::array<VertexId, 3> others{};
      std::ranges::copy_if(volume_.tetrahedra()[star[place]], others.begin(), [&](VertexId x) { return x != v; });
      std::sort(others.begin(), others.end());
      for (const auto& [i, j] : {std::pair{0u, 1u}, {0u, 2u}, {1u, 2u}}) faces.push_back({others[i], others[j], place});
    }
    std::sort(faces.begin(), faces.end());
    std::vector<std::uint32_t> parent(star.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](std::uint32_t p) {
      while (parent[p] != p) p = parent[p] = parent[parent[p]];
      return p;
    };
    for (std::size_t k = 1; k < faces.size(); ++k) {
      const FaceAt &f = faces[k - 1], &g = faces[k];
      if (f.u != g.u || f.w != g.w) continue;
      if (cut_between(star[f.place], star[g.place], {v, f.u, f.w})) continue;
      const std::uint32_t a = root(f.place), b = root(g.place);
      parent[std::max(a, b)] = std::min(a, b);
    }
    for (std::uint32_t r = 1; r < star.size(); ++r) {  // the component of the first tetrahedron keeps v
      if (root(r) != r) continue;
      std::vector<std::uint32_t> component;
      for (std::uint32_t p = r; p < star.size(); ++p)
        if (root(p) == r) component.push_back(star[p]);
      const VertexId twin = volume_.part(v, component);
      set_side(twin, 0);
      if (joined_.contains(v)) joined_[twin] = true;
      on_sheet_.push_back(twin);
      ++outcome_.twins;
    }
  }

  TetTopology& volume_;
  std::vector<Vec3> outline_;
  TetCutSettings settings_;
  Vec3 normal_ = Vec3::Zero(), centre_ = Vec3::Zero();
  bool flat_ = false;
  std::uint32_t tets_before_ = 0;
  std::vector<Crossing> crossings_;
  std::vector<VertexId> on_sheet_;
  std::unordered_map<VertexId, int> side_;  // looked up only, never walked
  std::unordered_map<VertexId, bool> joined_;
  TetCutOutcome outcome_;
};

}  // namespace

TetCutOutcome cut(TetTopology& volume, const CutSheet& sheet, const TetCutSettings& settings,
                  std::span<const std::uint32_t> begin) {
  return SheetCut(volume, sheet, settings).run(begin);
}

namespace {

bool near_edge(const TetTopology& volume, VertexId v, const Vec3& a, const Vec3& b) {
  const Vec3& x = volume.vertex(v).position_world_m;
  double longest2 = 0;
  for (const std::uint32_t t : volume.star(v))
    for (const VertexId w : volume.tetrahedra()[t])
      longest2 = std::max(longest2, (volume.vertex(w).position_world_m - x).squaredNorm());
  const double along = std::clamp((x - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (a + along * (b - a) - x).squaredNorm() < longest2;
}

}  // namespace

TetCutOutcome TetStroke::advance(TetTopology& volume, const Vec3& a_world_m, const Vec3& b_world_m) {
  if (!started_) {
    started_ = true;
    from_a_ = last_a_ = a_world_m;
    from_b_ = last_b_ = b_world_m;
    settled_.clear();
    last_.clear();
    mark_ = volume.mark();
    return {};
  }
  // The sheet from the settled edge is flat as long as the new edge lies in its plane, within a hundredth of its
  // length.
  const Vec3 normal = (last_a_ - from_a_ + last_b_ - from_b_).cross(from_b_ - from_a_);
  const double tolerance = 0.01 * (from_b_ - from_a_).norm();
  const bool begun = normal.norm() > 0;
  const Vec3 unit = begun ? Vec3(normal.normalized()) : Vec3::Zero();
  const bool bends =
      begun && std::max(std::abs(unit.dot(a_world_m - from_a_)), std::abs(unit.dot(b_world_m - from_a_))) > tolerance;
  if (bends) {
    // What goes on from there: vertices of the cut about as far from the settled edge as an element is large.
    settled_.clear();
    for (const VertexId v : last_)
      if (near_edge(volume, v, last_a_, last_b_)) settled_.push_back(v);
    from_a_ = last_a_;
    from_b_ = last_b_;
    mark_ = volume.mark();
  } else {
    volume.undo_to(mark_);
  }
  last_a_ = a_world_m;
  last_b_ = b_world_m;
  TetCutOutcome outcome = cut(volume, {{from_a_, from_b_, b_world_m, a_world_m}, settled_}, settings_);
  last_ = outcome.on_sheet;
  return outcome;
}

}  // namespace sectio
