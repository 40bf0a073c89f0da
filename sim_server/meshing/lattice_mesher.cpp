#include "sim_server/meshing/lattice_mesher.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/sort_unique.h"
#include "common/math/intersect.h"
#include "sim_server/meshing/lattice.h"
#include "sim_server/meshing/relax.h"
#include "sim_server/meshing/sharpen.h"

namespace sectio {
namespace {

// Fractions of a long and of a short edge within which a vertex is moved to the crossing (Labelle and Shewchuk 2007).
constexpr double kWarpLong = 0.24999;
constexpr double kWarpShort = 0.41189;

enum class Side : std::int8_t { outside = -1, surface = 0, inside = 1 };

struct EdgeCrossing {
  std::uint64_t edge;
  double at;  // 0 at the lattice point that the edge belongs to
  bool operator<(const EdgeCrossing& o) const { return edge != o.edge ? edge < o.edge : at < o.at; }
};

class LatticeMesher {
 public:
  LatticeMesher(const TriangleSoup& surface, double cell_m) : surface_(surface), lattice_(bounds(surface), cell_m) {}

  TetMesh run() {
    find_crossings();
    find_sides();
    warp();
    fill();
    return compact();
  }

 private:
  static Box3 bounds(const TriangleSoup& surface) {
    Box3 box;
    for (const Vec3& p : surface.vertices_body_m) box.extend(p);
    return box;
  }

  void find_crossings() {
    for (const auto& t : surface_.triangles) {
      const Corners corners{surface_.vertices_body_m[t[0]], surface_.vertices_body_m[t[1]],
                            surface_.vertices_body_m[t[2]]};
      Box3 box;
      for (const Vec3& p : corners) box.extend(p);
      lattice_.for_edges_near(box, [&](std::uint64_t edge, const Vec3& p, const Vec3& q) {
        if (!overlaps(p, q, box)) return;
        if (const auto crossing = cross_segment(p, q, corners)) crossings_.push_back({edge, crossing->parameter});
      });
    }
    std::sort(crossings_.begin(), crossings_.end());
  }

  std::span<const EdgeCrossing> crossings_of(std::uint64_t edge) const {
    const auto first = std::lower_bound(crossings_.begin(), crossings_.end(), EdgeCrossing{edge, -1});
    auto last = first;
    while (last != crossings_.end() && last->edge == edge) ++last;
    return {first, last};
  }
  bool crosses(std::uint64_t edge) const { return crossings_of(edge).size() % 2 == 1; }
  // The crossing of an edge with the surface; the middle one of several.
  double crossing_at(std::uint64_t edge) const {
    const auto all = crossings_of(edge);
    return std::clamp(all[all.size() / 2].at, 0.0, 1.0);
  }

  // Counts crossings along paths of lattice edges from the first corner, which lies outside.
  void find_sides() {
    side_.assign(lattice_.slots(), Side::outside);
    lattice_.for_points([&](std::uint32_t v, std::uint32_t from, std::uint64_t edge) {
      side_[v] = crosses(edge) == (side_[from] == Side::outside) ? Side::inside : Side::outside;
    });
    for (std::size_t n = 0; n < crossings_.size(); ++n) {
      const auto [a, b] = lattice_.ends(crossings_[n].edge);
      if ((side_[a] != side_[b]) != crosses(crossings_[n].edge)) throw InputError("the surface is not closed");
    }
    at_.resize(lattice_.slots());
    for (std::uint32_t v = 0; v < at_.size(); ++v) at_[v] = lattice_.point(v);
  }

  bool is_cut(std::uint32_t a, std::uint32_t b) const {
    return static_cast<int>(side_[a]) * static_cast<int>(side_[b]) < 0;
  }

  void warp() {
    std::vector<std::uint32_t> near;
    for (const EdgeCrossing& c : crossings_) {
      const auto [a, b] = lattice_.ends(c.edge);
      near.insert(near.end(), {a, b});
    }
    sort_unique(near);
    for (const std::uint32_t v : near) {
      double closest = 1;
      Vec3 target;
      lattice_.for_edges_at(v, [&](std::uint64_t edge, std::uint32_t a, std::uint32_t b) {
        if (!is_cut(a, b)) return;
        const double t = crossing_at(edge), from_v = v == a ? t : 1 - t;
        const double limit = lattice_.is_long(edge) ? kWarpLong : kWarpShort;
        if (from_v >= limit || from_v / limit >= closest) return;
        closest = from_v / limit;
        target = lattice_.point(a) + t * (lattice_.point(b) - lattice_.point(a));
      });
      if (closest == 1) continue;
      at_[v] = target;
      side_[v] = Side::surface;
    }
  }

  // The vertex at which an edge is bisected; these are numbered after all lattice points.
  VertexId cut_vertex(std::uint64_t edge) {
    const auto found = std::lower_bound(cut_.begin(), cut_.end(), edge);
    SECTIO_ASSERT(found != cut_.end() && *found == edge, "every cut edge has its vertex");
    return static_cast<VertexId>(lattice_.slots() + static_cast<std::size_t>(found - cut_.begin()));
  }

  void make_cut_vertices() {
    for (const EdgeCrossing& c : crossings_) {
      const auto [a, b] = lattice_.ends(c.edge);
      if (is_cut(a, b) && (cut_.empty() || cut_.back() != c.edge)) cut_.push_back(c.edge);
    }
    for (const std::uint64_t edge : cut_) {
      const auto [a, b] = lattice_.ends(edge);
      at_.push_back(lattice_.point(a) + crossing_at(edge) * (lattice_.point(b) - lattice_.point(a)));
      side_.push_back(Side::surface);
    }
  }

  void fill() {
    make_cut_vertices();
    lattice_.for_tetrahedra([&](const Tetrahedron& t) {
      int inside = 0, outside = 0;
      for (const VertexId v : t) (side_[v] == Side::inside ? inside : outside) += side_[v] != Side::surface;
      if (inside == 0) return;
      if (outside == 0)
        tetrahedra_.push_back(t);
      else
        split(t);
    });
  }

  void split(const Tetrahedron& t) {
    struct CutEdge {
      bool is_short;
      std::uint64_t edge;
      VertexId a, b;
    };
    std::vector<CutEdge> cuts;
    for (const auto& [i, j] : kTetEdges) {
      if (!is_cut(t[i], t[j])) continue;
      const std::uint64_t edge = lattice_.edge_between(t[i], t[j]);
      cuts.push_back({!lattice_.is_long(edge), edge, t[i], t[j]});
    }
    std::sort(cuts.begin(), cuts.end(), [](const CutEdge& x, const CutEdge& y) {
      return x.is_short != y.is_short ? y.is_short : x.edge < y.edge;
    });
    std::vector<Tetrahedron> pieces{t};
    for (const CutEdge& cut : cuts) {
      const VertexId middle = cut_vertex(cut.edge);
      for (std::size_t n = 0, end = pieces.size(); n < end; ++n) {
        const auto a = std::find(pieces[n].begin(), pieces[n].end(), cut.a);
        const auto b = std::find(pieces[n].begin(), pieces[n].end(), cut.b);
        if (a == pieces[n].end() || b == pieces[n].end()) continue;
        Tetrahedron other = pieces[n];
        other[static_cast<std::size_t>(a - pieces[n].begin())] = middle;
        *b = middle;
        pieces.push_back(other);
      }
    }
    for (const Tetrahedron& piece : pieces)
      if (std::ranges::none_of(piece, [&](VertexId v) { return side_[v] == Side::outside; }))
        tetrahedra_.push_back(piece);
  }

  TetMesh compact() const {
    TetMesh mesh;
    std::vector<VertexId> new_id(at_.size(), kNone);
    for (const Tetrahedron& t : tetrahedra_)
      for (const VertexId v : t) new_id[v] = 0;
    for (VertexId v = 0; v < new_id.size(); ++v) {
      if (new_id[v] == kNone) continue;
      new_id[v] = static_cast<VertexId>(mesh.vertices_body_m.size());
      mesh.vertices_body_m.push_back(at_[v]);
    }
    for (const Tetrahedron& t : tetrahedra_)
      mesh.tetrahedra.push_back({new_id[t[0]], new_id[t[1]], new_id[t[2]], new_id[t[3]]});
    return mesh;
  }

  const TriangleSoup& surface_;
  Lattice lattice_;
  std::vector<EdgeCrossing> crossings_;  // sorted
  std::vector<Side> side_;               // lattice points, then cut vertices
  std::vector<Vec3> at_;                 // likewise
  std::vector<std::uint64_t> cut_;       // edges that are bisected, ascending
  std::vector<Tetrahedron> tetrahedra_;
};

}  // namespace

double cell_for_tetrahedra(double volume_m3, double tetrahedra) {
  return std::cbrt(12 * volume_m3 / tetrahedra);
}

TetMesh fill_with_lattice(const TriangleSoup& surface, double cell_m, const RelaxWhere& relaxes) {
  TetMesh mesh = LatticeMesher(surface, cell_m).run();
  if (mesh.tetrahedra.empty()) throw InputError("the surface is thinner than the cells of the lattice everywhere");
  const SurfaceCreases creases(surface, cell_m);
  if (!creases.empty()) {
    TetMesh sharp = mesh;
    const std::vector<Seat> seats = sharpen(sharp, creases, cell_m);
    relax(sharp, creases, seats, relaxes);
    if (check(sharp).valid) return sharp;
  }
  relax(mesh, creases, {}, relaxes);
  const TetReport report = check(mesh);
  if (!report.valid) {
    throw InputError(formatted("cells of %.4g m can't follow the surface: ", cell_m) + report.first_defect +
                     "; smaller cells may");
  }
  return mesh;
}

}  // namespace sectio
