#include "sim_server/wrap/wrap.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <unordered_map>
#include <utility>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/math/disjoint_sets.h"
#include "common/math/intersect.h"
#include "common/mesh/check.h"
#include "common/mesh/enclosed_volume.h"
#include "sim_server/wrap/remesh.h"
#include "sim_server/wrap/surface_field.h"

namespace sectio {
namespace {

constexpr double kTriangles = 8000;   // when no size is given
constexpr double kCell = 0.7;         // cell of the grid, in edges
constexpr double kMostCorners = 2e7;  // corners of the grid
constexpr double kLeastShare = 0.01;  // share of the volume: smaller closed surfaces are bubbles
constexpr double kLeastAngle_rad = 5 * M_PI / 180;
constexpr double kLeastThickness = 0.25;  // thickness of a filled body: volume by area, in edges
constexpr int kSmoothings = 6;
constexpr int kBisections = 6;        // per edge of the grid
constexpr double kLayerCells = 1.75;  // so thick is the layer of balls that bound what is outside

// Labels of triangles that share edges, from 0.
std::vector<std::uint32_t> parts_of(const TriangleSoup& soup, std::uint32_t& count) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> edges;  // ends, triangle
  edges.reserve(3 * soup.triangles.size());
  for (std::uint32_t t = 0; t < soup.triangles.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [low, high] = std::minmax(soup.triangles[t][i], soup.triangles[t][(i + 1) % 3]);
      edges.emplace_back(std::uint64_t{low} << 32 | high, t);
    }
  std::sort(edges.begin(), edges.end());
  DisjointSets together(soup.triangles.size());
  for (std::size_t n = 1; n < edges.size(); ++n)
    if (edges[n].first == edges[n - 1].first) together.join(edges[n].second, edges[n - 1].second);
  std::vector<std::uint32_t> label(soup.triangles.size(), kNone), of(soup.triangles.size());
  count = 0;
  for (std::size_t t = 0; t < of.size(); ++t) {
    std::uint32_t& name = label[together.root(static_cast<std::uint32_t>(t))];
    if (name == kNone) name = count++;
    of[t] = name;
  }
  return of;
}

}  // namespace

// Each part is seen from its own middle.
TriangleSoup turned_outward(TriangleSoup soup) {
  std::uint32_t count = 0;
  const std::vector<std::uint32_t> part = parts_of(soup, count);
  std::vector<Vec3> middle(count, Vec3::Zero());
  std::vector<double> area(count, 0), volume(count, 0);
  const auto corner = [&](std::size_t t, std::size_t i) { return soup.vertices_body_m[soup.triangles[t][i]]; };
  for (std::size_t t = 0; t < part.size(); ++t) {
    const double a = (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0)).norm();
    middle[part[t]] += a / 3 * (corner(t, 0) + corner(t, 1) + corner(t, 2));
    area[part[t]] += a;
  }
  for (std::size_t t = 0; t < part.size(); ++t) {
    const Vec3 m = middle[part[t]] / std::max(area[part[t]], 1e-300);
    volume[part[t]] += (corner(t, 0) - m).dot((corner(t, 1) - m).cross(corner(t, 2) - m));
  }
  for (std::size_t t = 0; t < part.size(); ++t)
    if (volume[part[t]] < 0) std::swap(soup.triangles[t][1], soup.triangles[t][2]);
  return soup;
}

namespace {

double area_m2(const TriangleSoup& soup) {
  double area = 0;
  for (const auto& t : soup.triangles) {
    const Vec3& a = soup.vertices_body_m[t[0]];
    area += 0.5 * (soup.vertices_body_m[t[1]] - a).cross(soup.vertices_body_m[t[2]] - a).norm();
  }
  return area;
}
double volume_of(const TriangleSoup& soup, std::span<const std::uint32_t> triangles) {
  EnclosedVolume volume;
  for (const std::uint32_t t : triangles) {
    const auto& [a, b, c] = soup.triangles[t];
    volume.add(soup.vertices_body_m[a], soup.vertices_body_m[b], soup.vertices_body_m[c]);
  }
  return volume.m3();
}
double volume_of(const TriangleSoup& soup) {
  std::vector<std::uint32_t> all(soup.triangles.size());
  std::iota(all.begin(), all.end(), 0u);
  return volume_of(soup, all);
}

// The surface between corners of a grid that are inside and outside: where the winding number is 1/2 or, with a ball of
// fill_m, where no ball of that radius gets to from far away without touching a triangle.
class GridSurface {
 public:
  GridSurface(const SurfaceField& field, const Box3& box, double cell_m, double fill_m)
      : field_(field), cell_m_(cell_m), fill_m_(fill_m) {
    const double margin_cells = std::ceil(fill_m / cell_m) + 2.5;
    origin_ = box.min() - margin_cells * cell_m * Vec3::Ones();
    double corners = 1;
    for (int i = 0; i < 3; ++i) {
      count_[i] = static_cast<std::int64_t>(std::ceil(box.sizes()[i] / cell_m) + 2 * margin_cells) + 1;
      corners *= static_cast<double>(count_[i]);
    }
    if (corners > kMostCorners) throw InputError("the size is too small for a body this large");
  }

  TriangleSoup run() {
    level_.resize(static_cast<std::size_t>(count_[0] * count_[1] * count_[2]));
    if (fill_m_ > 0)
      roll_ball();
    else
      for (std::size_t n = 0; n < level_.size(); ++n) level_[n] = static_cast<float>(field_.winding(corner(n)) - 0.5);
    for (std::int64_t z = 0; z + 1 < count_[2]; ++z)
      for (std::int64_t y = 0; y + 1 < count_[1]; ++y)
        for (std::int64_t x = 0; x + 1 < count_[0]; ++x) cube(x, y, z);
    return std::move(soup_);
  }

 private:
  std::size_t index(std::int64_t x, std::int64_t y, std::int64_t z) const {
    return static_cast<std::size_t>((z * count_[1] + y) * count_[0] + x);
  }
  Vec3 corner(std::size_t n) const {
    const auto i = static_cast<std::int64_t>(n);
    const std::int64_t row = i / count_[0], layer = row / count_[1];
    const Vec3 at(static_cast<double>(i % count_[0]), static_cast<double>(row % count_[1]), static_cast<double>(layer));
    return origin_ + cell_m_ * at;
  }
  bool inside(std::size_t n) const { return level_[n] > 0; }

  // The level is the distance to the nearest ball around a corner that a ball of fill_m reaches from far away, each as
  // large as the triangles let it be (Portaneri 2022).
  void roll_ball() {
    std::vector<float> far_m(level_.size());
    for (std::size_t n = 0; n < far_m.size(); ++n) far_m[n] = static_cast<float>(field_.distance(corner(n)));
    std::ranges::fill(level_, static_cast<float>(cell_m_));
    std::vector<std::size_t> reached{0};
    level_[0] = -far_m[0];
    for (std::size_t i = 0; i < reached.size(); ++i)
      for_neighbours(reached[i], 1, [&](std::size_t n) {
        if (level_[n] < 0 || far_m[n] <= fill_m_) return;
        level_[n] = -far_m[n];
        reached.push_back(n);
      });
    const auto layer_m = static_cast<float>(fill_m_ + kLayerCells * cell_m_);
    for (const std::size_t from : reached) {
      if (far_m[from] > layer_m) continue;
      const Vec3 centre = corner(from);
      for_neighbours(from, static_cast<std::int64_t>(std::ceil(far_m[from] / cell_m_)) + 1, [&](std::size_t n) {
        level_[n] = std::min(level_[n], static_cast<float>((corner(n) - centre).norm()) - far_m[from]);
      });
    }
  }
  // Visits the corners at most so many steps away along each axis, and this one.
  template <class Visit>
  void for_neighbours(std::size_t n, std::int64_t steps, const Visit& visit) const {
    const auto i = static_cast<std::int64_t>(n);
    const std::array<std::int64_t, 3> at{i % count_[0], i / count_[0] % count_[1], i / count_[0] / count_[1]};
    std::array<std::int64_t, 3> low{}, high{};
    for (std::size_t k = 0; k < 3; ++k)
      low[k] = std::max<std::int64_t>(0, at[k] - steps), high[k] = std::min(count_[k] - 1, at[k] + steps);
    for (std::int64_t z = low[2]; z <= high[2]; ++z)
      for (std::int64_t y = low[1]; y <= high[1]; ++y)
        for (std::int64_t x = low[0]; x <= high[0]; ++x) visit(index(x, y, z));
  }

  // Six tetrahedra along the diagonal, which fit those of the next cube.
  void cube(std::int64_t x, std::int64_t y, std::int64_t z) {
    std::array<std::size_t, 8> at{};
    int in = 0;
    for (std::size_t k = 0; k < 8; ++k) {
      at[k] = index(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2));
      in += inside(at[k]);
    }
    if (in == 0 || in == 8) return;
    static constexpr std::array<std::array<std::size_t, 2>, 6> kPaths{
        {{1, 3}, {3, 2}, {2, 6}, {6, 4}, {4, 5}, {5, 1}}};  // from corner 0 to 7, each positively oriented
    for (const auto& [i, j] : kPaths) tetrahedron({at[0], at[i], at[j], at[7]});
  }

  void tetrahedron(const std::array<std::size_t, 4>& t) {
    std::vector<std::size_t> in, out;
    for (const std::size_t n : t) (inside(n) ? in : out).push_back(n);
    if (in.empty() || out.empty()) return;
    if (in.size() == 2) {
      const VertexId a = cut(in[0], out[0]), b = cut(in[0], out[1]), c = cut(in[1], out[1]), d = cut(in[1], out[0]);
      add({a, b, c}, in[0], out[0]);
      add({a, c, d}, in[0], out[0]);
    } else {
      const auto& one = in.size() == 1 ? in : out;
      const auto& three = in.size() == 1 ? out : in;
      add({cut(one[0], three[0]), cut(one[0], three[1]), cut(one[0], three[2])}, in[0], out[0]);
    }
  }

  // With the corner `out` on its outer side.
  void add(std::array<VertexId, 3> t, std::size_t in, std::size_t out) {
    const auto& at = on_grid_;
    const Vec3 normal = (at[t[1]] - at[t[0]]).cross(at[t[2]] - at[t[0]]);
    if (normal.dot(corner(out) - corner(in)) < 0) std::swap(t[1], t[2]);
    soup_.triangles.push_back(t);
  }

  // The place on the edge between two corners at which the level is 0: on the surface, or in a hole of it.
  VertexId cut(std::size_t one, std::size_t other) {
    const auto [low, high] = std::minmax(one, other);
    const auto [in, out] = inside(one) ? std::pair(one, other) : std::pair(other, one);
    const auto [found, is_new] = vertex_.try_emplace(low * level_.size() + high, kNone);
    if (!is_new) return found->second;
    found->second = static_cast<VertexId>(soup_.vertices_body_m.size());
    soup_.vertices_body_m.push_back(place_between(in, out));
    on_grid_.push_back(0.5 * (corner(in) + corner(out)));
    return found->second;
  }

  Vec3 place_between(std::size_t in, std::size_t out) const {
    Vec3 p = corner(in), q = corner(out);
    if (fill_m_ > 0) return p + std::clamp<double>(level_[in] / (level_[in] - level_[out]), 0.02, 0.98) * (q - p);
    for (int step = 0; step < kBisections; ++step) {
      const Vec3 middle = 0.5 * (p + q);
      (field_.winding(middle) > 0.5 ? p : q) = middle;
    }
    return 0.5 * (p + q);
  }

  const SurfaceField& field_;
  double cell_m_;
  double fill_m_;
  Vec3 origin_;
  std::array<std::int64_t, 3> count_{};
  std::vector<float> level_;  // one a corner; positive inside
  TriangleSoup soup_;
  std::vector<Vec3> on_grid_;  // vertices in the middle of their edges: triangles that surely have an area
  std::unordered_map<std::uint64_t, VertexId> vertex_;  // by edge; only looked up, never iterated
};

// Without closed surfaces that are hollows or crumbs. Returns how many.
std::size_t drop_bubbles(TriangleSoup& soup) {
  std::uint32_t count = 0;
  const std::vector<std::uint32_t> part = parts_of(soup, count);
  std::vector<std::vector<std::uint32_t>> members(count);
  for (std::uint32_t t = 0; t < part.size(); ++t) members[part[t]].push_back(t);
  std::vector<double> volume;
  double whole = 0;
  for (const auto& triangles : members) {
    volume.push_back(volume_of(soup, triangles));
    whole += std::max(0.0, volume.back());
  }
  TriangleSoup kept;
  std::vector<VertexId> number(soup.vertices_body_m.size(), kNone);
  std::size_t dropped = 0;
  for (std::uint32_t p = 0; p < count; ++p) {
    if (volume[p] < kLeastShare * whole) {
      ++dropped;
      continue;
    }
    for (const std::uint32_t t : members[p]) {
      auto corners = soup.triangles[t];
      for (VertexId& v : corners) {
        if (number[v] == kNone) {
          number[v] = static_cast<VertexId>(kept.vertices_body_m.size());
          kept.vertices_body_m.push_back(soup.vertices_body_m[v]);
        }
        v = number[v];
      }
      kept.triangles.push_back(corners);
    }
  }
  soup = std::move(kept);
  return dropped;
}

// A step forth and a step back leave the volume about as it is (Taubin 1995).
void smooth(TriangleSoup& soup, int rounds) {
  std::vector<Vec3>& at = soup.vertices_body_m;
  for (int i = 0; i < 2 * rounds; ++i) {
    std::vector<Vec3> sum(at.size(), Vec3::Zero());
    std::vector<double> weight(at.size(), 0);
    for (const auto& t : soup.triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        sum[t[k]] += at[t[(k + 1) % 3]] + at[t[(k + 2) % 3]];
        weight[t[k]] += 2;
      }
    const double share = i % 2 == 0 ? 0.5 : -0.53;
    for (std::size_t v = 0; v < at.size(); ++v) at[v] += share * (sum[v] / weight[v] - at[v]);
  }
}

void inflate_to(TriangleSoup& soup, double volume_m3) {
  for (int i = 0; i < 3; ++i) {
    std::vector<Vec3> normal(soup.vertices_body_m.size(), Vec3::Zero());
    for (const auto& t : soup.triangles) {
      const Vec3& a = soup.vertices_body_m[t[0]];
      const Vec3 n = (soup.vertices_body_m[t[1]] - a).cross(soup.vertices_body_m[t[2]] - a);
      for (const VertexId v : t) normal[v] += n;
    }
    const double by_m = (volume_m3 - volume_of(soup)) / area_m2(soup);
    for (std::size_t v = 0; v < normal.size(); ++v) soup.vertices_body_m[v] += by_m * normal[v].stableNormalized();
  }
}

void measure(const SurfaceField& given, std::span<const Vec3> given_m, Wrapped& w) {
  double sum = 0;
  for (const Vec3& p : w.soup.vertices_body_m) {
    const double far_m = given.distance(p);
    w.furthest_m = std::max(w.furthest_m, far_m);
    sum += far_m;
  }
  w.mean_far_m = sum / static_cast<double>(w.soup.vertices_body_m.size());
  const SurfaceField wrapped(w.soup);
  for (const Vec3& p : given_m)
    if (wrapped.winding(p) < 0.5) w.furthest_m = std::max(w.furthest_m, wrapped.distance(p));
  w.volume_m3 = volume_of(w.soup);
  w.least_angle_rad = smallest_angle_rad(w.soup);
}

}  // namespace

Wrapped wrap(const TriangleSoup& given, double size_m, double fill_sizes) {
  const TriangleSoup turned = turned_outward(given);
  Box3 box;
  for (const Vec3& p : turned.vertices_body_m) box.extend(p);
  if (turned.triangles.empty() || !(box.diagonal().norm() > 0)) throw InputError("there is nothing to wrap");
  Wrapped w;
  // An equilateral triangle has an area of 0.43 edge^2. Doubled surfaces count twice, so the box has a say, too.
  const double largest_m2 =
      2 * (box.sizes().x() * box.sizes().y() + box.sizes().y() * box.sizes().z() + box.sizes().z() * box.sizes().x());
  w.size_m = size_m > 0 ? size_m : std::sqrt(std::min(area_m2(turned), largest_m2) / kTriangles / 0.433);
  if (w.size_m > 0.25 * box.diagonal().norm()) throw InputError("the size is too large for this body");
  const SurfaceField field(turned);
  TriangleSoup surface = GridSurface(field, box, kCell * w.size_m, fill_sizes * w.size_m).run();
  w.bubbles = drop_bubbles(surface);
  const bool only_walls = fill_sizes > 0 && volume_of(surface) < kLeastThickness * w.size_m * area_m2(surface);
  if (surface.triangles.empty() || only_walls)
    throw InputError("its triangles enclose nothing: holes are too wide, or walls thinner than the size");
  const double volume_m3 = volume_of(surface);
  smooth(surface, kSmoothings);
  w.soup = remeshed(surface, w.size_m);
  inflate_to(w.soup, volume_m3);
  measure(field, turned.vertices_body_m, w);
  const SurfaceReport report = check_soup(w.soup);
  if (!report.valid() || w.least_angle_rad < kLeastAngle_rad)
    throw InputError("no good triangles of this size: try another one");
  return w;
}

std::string to_string(const Wrapped& w) {
  return formatted(
      "wrapped: %zu triangles of %.3g mm, smallest angle %.0f deg, %.5g ml, at most %.3g mm and on average "
      "%.2g mm from what was given%s",
      w.soup.triangles.size(), 1e3 * w.size_m, w.least_angle_rad * 180 / M_PI, 1e6 * w.volume_m3, 1e3 * w.furthest_m,
      1e3 * w.mean_far_m, w.bubbles > 0 ? ", hollows filled" : "");
}

}  // namespace sectio
