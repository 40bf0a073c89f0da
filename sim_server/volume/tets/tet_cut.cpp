#include "sim_server/volume/tets/tet_cut.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/core/error.h"
#include "common/core/number_table.h"
#include "common/core/sort_unique.h"

namespace sectio {
namespace {

constexpr double kLasting = 3;  // factor of the snapping distance at a lasting end
// Places of a blade along one plane differ by a few hundredths of an edge, which changes no decision about a vertex. A
// cut has passed a vertex when one of its own is nearer than so many times the vertex's height over the sheet.
constexpr double kStrays = 0.7, kPassed = 2.5;
// Crossings this far from an end, in snapping distances, look for closer ones: with 1.5 of them second lips remain, and
// without a limit a front opens ahead of its blade.
constexpr double kLooksFrom = 3;

struct Crossing {
  VertexId a, b;  // a < b
  double t;       // place on the edge, 0 at a
  bool operator<(const Crossing& o) const { return a != o.a ? a < o.a : b < o.b; }
  bool operator==(const Crossing& o) const { return a == o.a && b == o.b; }
};

class SheetCut {
 public:
  SheetCut(TetTopology& volume, const CutSheet& sheet, const TetCutSettings& settings)
      : volume_(volume),
        place_(volume.scratch()),
        shape_(sheet),
        exact_(sheet.exact),
        lasting_(sheet.lasting),
        goes_on_(sheet.goes_on),
        settings_(settings) {
    for (const VertexId v : sheet.joined) {
      put_on_sheet(v);
      at(v).joined = true;
    }
  }

  ~SheetCut() {
    for (const Met& met : met_) place_[met.v] = 0;
  }
  SheetCut(const SheetCut&) = delete;
  SheetCut& operator=(const SheetCut&) = delete;

  TetCutOutcome run(std::span<const std::uint32_t> begin) {
    if (!shape_.has_area()) return outcome_;
    find(begin);
    snap();
    split();
    for (std::size_t side = 0; side < shape_.side_count(); ++side)
      if (is_exact(side)) end_at(side);
    if (exact_ != 0) open_across();
    std::sort(on_sheet_.begin(), on_sheet_.end());
    if (settings_.crumb_m3 > 0) keep_crumbs();
    for (std::size_t k = 0, end = on_sheet_.size(); k < end; ++k) separate(on_sheet_[k]);
    std::sort(on_sheet_.begin(), on_sheet_.end());
    if (exact_ != 0)
      std::erase_if(on_sheet_, [&](VertexId v) {  // elements extend beyond the sheet there
        return !at(v).opened && !at(v).joined && !inside(volume_.vertex(v).rest_body_m);
      });
    outcome_.on_sheet = std::move(on_sheet_);
    outcome_.made = static_cast<std::uint32_t>(volume_.tetrahedra().size()) - tets_before_;
    return outcome_;
  }

 private:
  // A vertex that the cut has looked at.
  struct Met {
    VertexId v = kNone;
    double height_m = 0;  // signed distance from the sheet; 0: not known yet
    bool on_sheet = false, joined = false;
    bool at_end = false;  // the cut ends here
    bool opened = false;  // a corner of a cut face
  };
  Met& at(VertexId v) const {
    if (place_.size() <= v) place_.resize(volume_.vertex_count(), 0);
    if (place_[v] == 0) {
      met_.push_back({v});
      place_[v] = static_cast<std::uint32_t>(met_.size());
    }
    return met_[place_[v] - 1];
  }
  bool is_on_sheet(VertexId v) const { return v < place_.size() && place_[v] != 0 && met_[place_[v] - 1].on_sheet; }
  double height(VertexId v) const {
    double& known_m = at(v).height_m;
    if (known_m == 0) known_m = shape_.height_m(volume_.vertex(v).rest_body_m);
    return known_m;
  }
  bool is_exact(std::size_t side) const { return (exact_ >> side & 1) != 0; }
  bool inside(const Vec3& p) const {
    return shape_.inside(p, [](std::size_t) { return true; });
  }
  // Treats the sheet as if it went on beyond its exact sides.
  bool inside_extended(const Vec3& p) const {
    return shape_.inside(p, [&](std::size_t side) { return !is_exact(side); });
  }

  static double area_m2(const std::vector<Vec3>& polygon) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 2; i < polygon.size(); ++i)
      sum += (polygon[i - 1] - polygon[0]).cross(polygon[i] - polygon[0]);
    return sum.norm();
  }
  // Clips the polygon by the outline (Sutherland, Hodgman 1974); returns whether more than a crumb is left.
  bool is_entered() {
    const double whole_m2 = area_m2(polygon_);
    for (std::size_t side = 0; side < shape_.side_count() && !polygon_.empty(); ++side) {
      left_.clear();
      for (std::size_t i = 0; i < polygon_.size(); ++i) {
        const Vec3 &p = polygon_[i], &q = polygon_[(i + 1) % polygon_.size()];
        const double at_p = shape_.within_m2(side, p), at_q = shape_.within_m2(side, q);
        if (at_p >= 0) left_.push_back(p);
        if ((at_p >= 0) != (at_q >= 0)) left_.push_back(p + at_p / (at_p - at_q) * (q - p));
      }
      polygon_.swap(left_);
    }
    return area_m2(polygon_) > settings_.snap * settings_.snap * whole_m2;
  }

  // The side of a vertex: -1 or 1 beside the sheet, 0 on it.
  int side(VertexId v) const { return is_on_sheet(v) ? 0 : height(v) > 0 ? 1 : -1; }
  void put_on_sheet(VertexId v) {
    at(v).on_sheet = true;
    on_sheet_.push_back(v);
  }

  struct Crossed {
    std::uint32_t count = 0, beside = 0;  // edges that cross the plane: inside the outline, outside it
    std::uint32_t beyond = 0;             // sides
    double ahead_m = 0;
  };
  // Appends the edges of a tetrahedron that cross the sheet.
  Crossed cross(std::uint32_t t, std::vector<Crossing>& out) {
    const Tetrahedron& c = volume_.tetrahedra()[t];
    std::array<double, 4> h;
    for (std::size_t i = 0; i < 4; ++i) h[i] = height(c[i]);
    Crossed crossed;
    const auto above = std::ranges::count_if(h, [](double m) { return m > 0; });
    if (above == 0 || above == 4) return crossed;
    if (exact_ != 0) put_section(c, h);
    const bool goes_on = exact_ != 0 && is_entered();
    for (const auto& [i, j] : kTetEdges) {
      if ((h[i] > 0) == (h[j] > 0)) continue;
      const std::size_t a = c[i] < c[j] ? i : j, b = a == i ? j : i;
      const double along = h[a] / (h[a] - h[b]);
      const Vec3& from = volume_.vertex(c[a]).rest_body_m;
      const Vec3 at = from + along * (volume_.vertex(c[b]).rest_body_m - from);
      for (std::size_t side = 0; side < shape_.side_count() && goes_on; ++side)
        if (const double inside_m2 = shape_.within_m2(side, at); inside_m2 < 0) {
          crossed.beyond |= 1u << side;
          if (is_exact(side)) crossed.ahead_m = std::max(crossed.ahead_m, -inside_m2 / shape_.side_m(side, at));
        }
      if (inside(at) || (goes_on && inside_extended(at))) {
        out.push_back({c[a], c[b], along});
        ++crossed.count;
      } else {
        ++crossed.beside;
      }
    }
    return crossed;
  }
  // Sets the polygon to the section of the plane with a tetrahedron of these heights: three or four corners, or none.
  void put_section(const Tetrahedron& c, const std::array<double, 4>& h) {
    std::array<std::size_t, 4> above{}, below{};
    std::size_t some_above = 0, some_below = 0;
    for (std::size_t i = 0; i < 4; ++i) (h[i] > 0 ? above[some_above++] : below[some_below++]) = i;
    polygon_.clear();
    for (std::size_t n = 0; n < some_above; ++n)
      for (std::size_t m = 0; m < some_below; ++m) {
        const std::size_t i = above[n], j = n == 1 && some_below == 2 ? below[1 - m] : below[m];
        const Vec3& from = volume_.vertex(c[i]).rest_body_m;
        polygon_.push_back(from + h[i] / (h[i] - h[j]) * (volume_.vertex(c[j]).rest_body_m - from));
      }
  }

  // `edges`: edges that cross the sheet, whether they are cut or not.
  void visit(std::uint32_t t, std::vector<Crossing>& edges) {
    const Crossed crossed = cross(t, edges);
    outcome_.beyond |= crossed.beyond;
    outcome_.ahead_m = std::max(outcome_.ahead_m, crossed.ahead_m);
    outcome_.crossed += crossed.count > 0;
    if (!settings_.semi_progressive || crossed.beside == 0)
      crossings_.insert(crossings_.end(), edges.begin(), edges.end());
  }

  void find(std::span<const std::uint32_t> begin) {
    tets_before_ = static_cast<std::uint32_t>(volume_.tetrahedra().size());
    if (begin.empty()) {
      std::vector<Crossing> edges;
      for (std::uint32_t t = 0; t < tets_before_; ++t) {
        edges.clear();
        if (volume_.tetrahedra()[t] != kNoTetrahedron) visit(t, edges);
      }
    } else {
      follow(begin);
    }
    sort_unique(crossings_);
  }

  // Searches through the stars of the ends of crossed edges.
  void follow(std::span<const std::uint32_t> begin) {
    std::vector<std::uint32_t> queue;
    NumberSet seen, followed;  // tetrahedra, edges
    for (const std::uint32_t t : begin)
      if (seen.insert(t)) queue.push_back(t);
    std::vector<Crossing> edges;
    for (std::size_t k = 0; k < queue.size(); ++k) {
      edges.clear();
      visit(queue[k], edges);
      for (const Crossing& c : edges) {
        if (!followed.insert(std::uint64_t{c.a} << 32 | c.b)) continue;
        for (const std::uint32_t t : volume_.star(c.a)) {
          const Tetrahedron& corners = volume_.tetrahedra()[t];
          if (std::ranges::find(corners, c.b) != corners.end() && seen.insert(t)) queue.push_back(t);
        }
      }
    }
  }

  void snap() {
    for (const Crossing& c : crossings_) {
      if (side(c.a) != 0 && is_close(c.a, c.t)) snap_to(c.a);
      if (side(c.b) != 0 && is_close(c.b, 1 - c.t)) snap_to(c.b);
      mean_edge_m_ += length_m(c) / static_cast<double>(crossings_.size());
    }
    std::erase_if(crossings_, [&](const Crossing& c) { return side(c.a) == 0 || side(c.b) == 0; });
  }
  // Whether the sheet, which crosses an edge of this vertex at `along`, crosses any of them close to it, or would do if
  // it went on: one that goes on later decides the same, and has no second lip beside the first. A vertex that the cut
  // has passed close by is left there by a blade that has strayed a little since.
  bool is_close(VertexId v, double along) const {
    const double h = height(v), at_m = std::abs(h);
    if (at_m < settings_.close_m) return true;
    if (along > kLooksFrom * settings_.snap) return false;
    const Vec3& rest_m = volume_.vertex(v).rest_body_m;
    double least = 1;
    bool is_passed = false;
    for (const std::uint32_t t : volume_.star(v))
      for (const VertexId x : volume_.tetrahedra()[t]) {
        const Vec3 to_x_m = volume_.vertex(x).rest_body_m - rest_m;
        is_passed |= is_on_sheet(x) && at(x).joined && to_x_m.norm() < kPassed * at_m;
        if ((height(x) > 0) == (h > 0)) continue;
        const double there = at_m / (at_m + std::abs(height(x)));
        if (there < least && crosses(rest_m + there * to_x_m)) least = there;
      }
    return least <= (is_passed ? kStrays : 1) * settings_.snap;
  }
  // Whether a point in the sheet's plane is in the sheet, or beyond sides where it may go on.
  bool crosses(const Vec3& p) const {
    return shape_.inside(p, [&](std::size_t side) { return (goes_on_ >> side & 1) == 0; });
  }
  void snap_to(VertexId v) {
    put_on_sheet(v);
    ++outcome_.snapped;
  }

  double length_m(const Crossing& c) const {
    return (volume_.vertex(c.b).rest_body_m - volume_.vertex(c.a).rest_body_m).norm();
  }
  void split() {
    for (const Crossing& c : crossings_) {
      put_on_sheet(volume_.split(c.a, c.b, c.t));
      ++outcome_.splits;
    }
  }

  // Splits edges on the sheet, in elements that it enters and has not cut yet, where a side of the outline crosses
  // them.
  void end_at(std::size_t side) {
    crossings_.clear();
    for (const std::array<VertexId, 3>& face : entered_faces())
      for (const auto& [i, j] : {std::pair{0u, 1u}, {0u, 2u}, {1u, 2u}}) {
        const double at_a = shape_.within_m2(side, volume_.vertex(face[i]).rest_body_m);
        const double at_b = shape_.within_m2(side, volume_.vertex(face[j]).rest_body_m);
        if ((at_a > 0) != (at_b > 0)) crossings_.push_back({face[i], face[j], at_a / (at_a - at_b)});
      }
    sort_unique(crossings_);
    std::vector<VertexId> snapped;
    for (const Crossing& c : crossings_) {  // parts of edges that step 3 has split are divided more coarsely
      const double snap = settings_.snap * std::max(1.0, mean_edge_m_ / length_m(c)), to = std::min(c.t, 1 - c.t);
      const VertexId near = c.t < 0.5 ? c.a : c.b;
      // A cut that ended in the skin ahead of it would open that.
      const auto may_be_coarse = [&] {
        return shape_.within_m2(side, volume_.vertex(near).rest_body_m) > 0 || !is_at_surface(near);
      };
      if (to <= snap || ((lasting_ >> side & 1) != 0 && to <= kLasting * snap && may_be_coarse()))
        snapped.push_back(near);
    }
    sort_unique(snapped);
    const auto is_snapped = [&](VertexId v) { return std::ranges::binary_search(snapped, v); };
    std::erase_if(crossings_, [&](const Crossing& c) { return is_snapped(c.a) || is_snapped(c.b); });
    for (const VertexId v : snapped) at(v).at_end = true;
    const auto first = static_cast<VertexId>(volume_.vertex_count());
    split();
    for (VertexId v = first; v < volume_.vertex_count(); ++v) at(v).at_end = true;
  }
  bool is_at_surface(VertexId v) const {
    return std::ranges::any_of(volume_.star(v), [&](std::uint32_t t) {
      for (std::size_t corner = 0; corner < 4; ++corner)
        if (volume_.tetrahedra()[t][corner] != v && volume_.across(t, corner) == kNone) return true;
      return false;
    });
  }
  // An edge from one end of the opening to the other has no vertex that could get a twin, and would keep it closed.
  void open_across() {
    std::vector<Crossing> edges;
    for (const std::array<VertexId, 3>& face : entered_faces()) {
      if (!inside(middle(face))) continue;
      for (const auto& [i, j] : {std::pair{0u, 1u}, {0u, 2u}, {1u, 2u}})
        if (at(face[i]).at_end && at(face[j]).at_end) edges.push_back({face[i], face[j], 0.5});
    }
    std::sort(edges.begin(), edges.end());
    crossings_.clear();
    for (std::size_t n = 1; n < edges.size(); ++n)
      if (edges[n] == edges[n - 1]) crossings_.push_back(edges[n]);
    sort_unique(crossings_);  // an edge may belong to more than two faces where sheets meet
    split();
  }
  // The cut faces, corners ascending, in the order of their first corners on the sheet. Each is between two tetrahedra.
  std::vector<std::array<VertexId, 3>> entered_faces() {
    std::vector<std::array<VertexId, 3>> entered;
    for (const VertexId v : on_sheet_) {
      faces_.clear();
      for (const std::uint32_t t : volume_.star(v)) {
        std::array<std::uint64_t, 3> further{};  // corners on the sheet with higher numbers
        std::size_t count = 0;
        for (const VertexId x : volume_.tetrahedra()[t])
          if (x > v && is_on_sheet(x)) further[count++] = x;
        if (count < 2) continue;
        std::ranges::sort(std::span(further).first(count));
        for (std::size_t a = 0; a + 1 < count; ++a)
          for (std::size_t b = a + 1; b < count; ++b) faces_.emplace_back(further[a] << 32 | further[b], t);
      }
      std::sort(faces_.begin(), faces_.end());
      for (std::size_t n = 1; n < faces_.size(); ++n) {
        const auto [corners, t] = faces_[n];
        if (faces_[n - 1].first != corners || side_of(faces_[n - 1].second) == side_of(t)) continue;
        const std::array<VertexId, 3> face{v, static_cast<VertexId>(corners >> 32), static_cast<VertexId>(corners)};
        polygon_.clear();
        for (const VertexId x : face) polygon_.push_back(volume_.vertex(x).rest_body_m);
        if (is_entered()) entered.push_back(face);
      }
    }
    return entered;
  }

  int sum_of_sides(std::uint32_t t) const {
    int sum = 0;
    for (const VertexId v : volume_.tetrahedra()[t]) sum += side(v);
    return sum;
  }
  // The side of a tetrahedron with a face on the sheet is that of its other corner. A tetrahedron with all corners on
  // the sheet stays with the neighbour with which it shares the largest face, as it would come off as a crumb
  // otherwise.
  int side_of(std::uint32_t t) const {
    if (const int* kept = kept_on_.find(t)) return *kept;
    if (const int sum = sum_of_sides(t); sum != 0) return sum > 0 ? 1 : -1;
    const Tetrahedron& c = volume_.tetrahedra()[t];
    double largest = 0, heights = 0;
    int with = 0;
    for (std::size_t corner = 0; corner < 4; ++corner) {
      heights += height(c[corner]);
      const std::uint32_t u = volume_.across(t, corner);
      const int sum = u == kNone ? 0 : sum_of_sides(u);
      const auto& [i, j, k] = kTetFaces[corner];
      const double area = volume_.face_m2(c[i], c[j], c[k]);
      if (sum == 0 || area <= largest) continue;
      largest = area;
      with = sum > 0 ? 1 : -1;
    }
    return with != 0 ? with : heights > 0 ? 1 : -1;
  }
  Vec3 middle(const std::array<VertexId, 3>& face) const {
    Vec3 sum = Vec3::Zero();
    for (const VertexId v : face) sum += volume_.vertex(v).rest_body_m / 3;
    return sum;
  }
  bool cut_between(std::uint32_t t, std::uint32_t u, const std::array<VertexId, 3>& face) const {
    for (const VertexId v : face)
      if (side(v) != 0) return false;
    if (side_of(t) == side_of(u)) return false;
    const bool joins = std::ranges::any_of(face, [&](VertexId v) { return at(v).joined; });
    return shape_.inside(middle(face), [&](std::size_t side) { return !joins || is_exact(side); });
  }

  void keep_crumbs() {
    for (const VertexId v : on_sheet_)
      for (const std::uint32_t t : volume_.star(v)) {
        double above_m2 = 0, below_m2 = 0;
        if (!is_crumb(t, above_m2, below_m2) || above_m2 + below_m2 == 0) continue;
        for (const std::uint32_t u : part_) kept_on_.at(u) = above_m2 > below_m2 ? 1 : -1;
      }
  }
  // Sets `part_` to the tetrahedra that stay connected with one, until they are more than a crumb; and the areas of the
  // sheet that part it from what is above and below.
  bool is_crumb(std::uint32_t first, double& above_m2, double& below_m2) {
    if (more_than_crumb_.contains(first)) return false;
    part_.assign(1, first);
    double volume_m3 = 0;
    bool is_more = false;
    for (std::size_t k = 0; k < part_.size() && !is_more; ++k) {
      const std::uint32_t t = part_[k];
      volume_m3 += volume_.volume_m3(t);
      is_more = volume_m3 > settings_.crumb_m3;
      for (std::size_t corner = 0; corner < 4 && !is_more; ++corner) {
        const std::uint32_t u = volume_.across(t, corner);
        if (u == kNone || std::ranges::find(part_, u) != part_.end()) continue;
        const Tetrahedron& c = volume_.tetrahedra()[t];
        const auto& [i, j, l] = kTetFaces[corner];
        if (cut_between(t, u, {c[i], c[j], c[l]})) {
          (side_of(u) > 0 ? above_m2 : below_m2) += volume_.face_m2(c[i], c[j], c[l]);
        } else {
          part_.push_back(u);
          is_more = more_than_crumb_.contains(u);
        }
      }
    }
    if (is_more)
      for (const std::uint32_t t : part_) more_than_crumb_.insert(t);
    return !is_more;
  }

  void separate(VertexId v) {
    star_.assign(volume_.star(v).begin(), volume_.star(v).end());
    const std::span<const std::uint32_t> star = star_;
    faces_.clear();
    for (std::uint32_t place = 0; place < star.size(); ++place) {
      std::array<std::uint64_t, 3> others{};
      std::ranges::copy_if(volume_.tetrahedra()[star[place]], others.begin(), [&](VertexId x) { return x != v; });
      std::sort(others.begin(), others.end());
      const auto& [a, b, c] = others;
      for (const std::uint64_t edge : {a << 32 | b, a << 32 | c, b << 32 | c}) faces_.emplace_back(edge, place);
    }
    std::sort(faces_.begin(), faces_.end());
    parent_.resize(star.size());
    std::iota(parent_.begin(), parent_.end(), 0u);
    const auto root = [&](std::uint32_t p) {
      while (parent_[p] != p) p = parent_[p] = parent_[parent_[p]];
      return p;
    };
    for (std::size_t k = 1; k < faces_.size(); ++k) {
      const auto [edge, place] = faces_[k - 1];
      const auto [next_edge, next_place] = faces_[k];
      if (edge != next_edge) continue;
      const std::array<VertexId, 3> face{v, static_cast<VertexId>(edge >> 32), static_cast<VertexId>(edge)};
      if (cut_between(star[place], star[next_place], face)) {
        for (const VertexId corner : face) at(corner).opened = true;
        continue;
      }
      const std::uint32_t a = root(place), b = root(next_place);
      parent_[std::max(a, b)] = std::min(a, b);
    }
    for (std::uint32_t r = 1; r < star.size(); ++r) {  // the component of the first tetrahedron keeps v
      if (root(r) != r) continue;
      std::vector<std::uint32_t> component;
      for (std::uint32_t p = r; p < star.size(); ++p)
        if (root(p) == r) component.push_back(star[p]);
      const VertexId twin = volume_.part(v, component);
      put_on_sheet(twin);
      at(twin).joined = bool{at(v).joined};
      at(twin).opened = true;
      ++outcome_.twins;
    }
  }

  TetTopology& volume_;
  std::vector<std::uint32_t>& place_;  // by vertex, in `met_`, from 1; 0: it is not there
  SheetShape shape_;
  std::uint32_t exact_, lasting_, goes_on_;
  TetCutSettings settings_;
  std::uint32_t tets_before_ = 0;
  double mean_edge_m_ = 0;  // mean of the edges that the sheet crosses
  std::vector<Crossing> crossings_;
  std::vector<VertexId> on_sheet_;
  mutable std::vector<Met> met_;
  NumberTable<int> kept_on_;          // crumbs, by tetrahedron: the side
  NumberSet more_than_crumb_;         // tetrahedra
  std::vector<Vec3> polygon_, left_;  // scratch, as the rest
  std::vector<std::pair<std::uint64_t, std::uint32_t>>
      faces_;                                 // at a vertex: the edge opposite it, tetrahedron or place
  std::vector<std::uint32_t> star_, parent_;  // by place
  std::vector<std::uint32_t> part_;
  TetCutOutcome outcome_;
};

}  // namespace

TetCutOutcome cut(TetTopology& volume, const CutSheet& sheet, const TetCutSettings& settings,
                  std::span<const std::uint32_t> begin) {
  return SheetCut(volume, sheet, settings).run(begin);
}

}  // namespace sectio
