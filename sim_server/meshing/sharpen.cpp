#include "sim_server/meshing/sharpen.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/core/error.h"
#include "common/core/sort_unique.h"

namespace sectio {
namespace {

constexpr double kFlat = 1e-3;         // cells; a lower tetrahedron is flat
constexpr double kLeastHeight = 0.04;  // cells; of the tetrahedra that an edit leaves
constexpr int kRounds = 6;             // an edit may make another one possible

using Edge = std::array<VertexId, 2>;

class Sharpening {
 public:
  Sharpening(TetMesh& mesh, const SurfaceCreases& creases, double cell_m)
      : mesh_(mesh), creases_(creases), cell_m_(cell_m), star_(mesh.vertices_body_m.size()), seat_(star_.size()) {
    for (std::uint32_t t = 0; t < mesh.tetrahedra.size(); ++t)
      for (const VertexId v : mesh.tetrahedra[t]) star_[v].push_back(t);
    for (const VertexId v : surface_of(mesh).of_volume) seat_[v] = creases.seat_of(mesh.vertices_body_m[v]);
  }

  std::vector<Seat> run() {
    for (int round = 0; round < kRounds; ++round) {
      std::size_t done = 0;
      for (const Edge& e : passing_edges()) done += mend(e);
      for (const Face& f : passing_faces()) done += mend(f);
      if (done == 0) break;
    }
    compact();
    return std::move(seat_);
  }

 private:
  using Face = std::array<VertexId, 3>;
  using Place = SurfaceCreases::Place;

  // A change of the mesh around one vertex, which is new or moves.
  struct Edit {
    VertexId vertex = kNone;
    Place place;
    std::vector<std::uint32_t> removed;
    std::vector<Tetrahedron> added;
  };
  struct Undo {
    VertexId vertex = kNone;
    bool is_new = false;
    Place place;
    std::vector<std::pair<std::uint32_t, Tetrahedron>> removed;
    std::vector<std::uint32_t> added;
  };

  bool is_boundary(std::uint32_t t, std::size_t corner) const {
    const Tetrahedron& c = mesh_.tetrahedra[t];
    const auto v = [&](std::size_t n) { return c[kTetFaces[corner][n]]; };
    return std::ranges::none_of(star_[v(0)], [&](std::uint32_t u) {
      return u != t && has(mesh_.tetrahedra[u], v(1)) && has(mesh_.tetrahedra[u], v(2));
    });
  }
  template <class Visit>
  void for_boundary_faces(Visit visit) const {
    for (std::uint32_t t = 0; t < mesh_.tetrahedra.size(); ++t) {
      const Tetrahedron& c = mesh_.tetrahedra[t];
      if (c == kNoTetrahedron) continue;
      for (std::size_t i = 0; i < 4; ++i) {
        const Face f{c[kTetFaces[i][0]], c[kTetFaces[i][1]], c[kTetFaces[i][2]]};
        if (std::ranges::none_of(f, [&](VertexId v) { return seat_[v].empty(); }) && is_boundary(t, i)) visit(f);
      }
    }
  }
  bool passes(VertexId p, VertexId q) const { return common_faces(seat_[p], seat_[q]).empty(); }

  std::vector<Edge> passing_edges() const {
    std::vector<Edge> edges;
    for_boundary_faces([&](const Face& f) {
      for (std::size_t i = 0; i < 3; ++i)
        if (const auto [p, q] = std::minmax(f[i], f[(i + 1) % 3]); passes(p, q)) edges.push_back({p, q});
    });
    sort_unique(edges);
    return edges;
  }
  std::vector<Face> passing_faces() const {
    std::vector<Face> faces;
    for_boundary_faces([&](const Face& f) {
      if (passes(f[0], f[1]) || passes(f[1], f[2]) || passes(f[2], f[0])) return;
      if (common_faces(common_faces(seat_[f[0]], seat_[f[1]]), seat_[f[2]]).empty()) faces.push_back(f);
    });
    return faces;
  }

  std::vector<std::uint32_t> around(VertexId p, VertexId q) const {
    std::vector<std::uint32_t> both;
    for (const std::uint32_t t : star_[p])
      if (has(mesh_.tetrahedra[t], q)) both.push_back(t);
    return both;
  }

  Edit moving(VertexId v, const Place& place) const {
    Edit edit{v, place, star_[v], {}};
    for (const std::uint32_t t : star_[v]) edit.added.push_back(mesh_.tetrahedra[t]);
    return edit;
  }
  // Replaces each of these tetrahedra by one for each of the corners, which is replaced by the new vertex.
  Edit inserting(const std::vector<std::uint32_t>& in, std::span<const VertexId> corners, const Place& place) const {
    Edit edit{static_cast<VertexId>(star_.size()), place, in, {}};
    for (const std::uint32_t t : in)
      for (const VertexId v : corners) {
        edit.added.push_back(mesh_.tetrahedra[t]);
        *std::ranges::find(edit.added.back(), v) = edit.vertex;
      }
    return edit;
  }

  bool mend(const Edge& e) {
    const auto [p, q] = e;
    const std::vector<std::uint32_t> in = around(p, q);
    if (in.empty() || !passes(p, q) || !is_boundary_edge(p, q)) return false;
    const Vec3 &x = mesh_.vertices_body_m[p], &y = mesh_.vertices_body_m[q];
    const auto place = creases_.between(x, seat_[p], y, seat_[q]);
    if (!place) return false;
    std::vector<Edit> edits{inserting(in, e, *place)};
    for (const VertexId v : e)
      if (std::ranges::includes(place->seat, seat_[v]))
        edits.push_back(moving(v, {creases_.closest(mesh_.vertices_body_m[v], place->seat), place->seat}));
    return take_best(edits);
  }

  bool mend(const Face& f) {
    std::vector<std::uint32_t> in;
    for (const std::uint32_t t : around(f[0], f[1]))
      if (has(mesh_.tetrahedra[t], f[2])) in.push_back(t);
    if (in.size() != 1) return false;
    Seat all;
    Vec3 middle = Vec3::Zero();
    for (const VertexId v : f) {
      all.insert(all.end(), seat_[v].begin(), seat_[v].end());
      middle += mesh_.vertices_body_m[v] / 3;
    }
    sort_unique(all);
    const auto corner = creases_.corner_of(middle, all);
    if (!corner) return false;
    std::vector<Edit> edits{inserting(in, f, *corner)};
    for (std::size_t i = 0; i < 3; ++i) {
      edits.push_back(moving(f[i], *corner));
      const Edge e{f[i], f[(i + 1) % 3]};
      edits.push_back(inserting(around(e[0], e[1]), e, *corner));
    }
    return take_best(edits);
  }

  bool take_best(const std::vector<Edit>& edits) {
    const Edit* best = nullptr;
    double most = kLeastHeight;
    for (const Edit& edit : edits) {
      Undo undo;
      const double height = take(edit, undo);
      take_back(undo);
      if (!(height > most)) continue;
      most = height;
      best = &edit;
    }
    Undo undo;
    if (best) take(*best, undo);
    return best != nullptr;
  }

  // The least height of the tetrahedra that it leaves, in cells; negative if it can't be taken.
  double take(const Edit& edit, Undo& undo) {
    undo.vertex = edit.vertex;
    undo.is_new = edit.vertex == star_.size();
    if (undo.is_new) {
      mesh_.vertices_body_m.emplace_back();
      star_.emplace_back();
      seat_.emplace_back();
    }
    undo.place = {mesh_.vertices_body_m[edit.vertex], seat_[edit.vertex]};
    const auto remove = [&](std::uint32_t t) {
      undo.removed.emplace_back(t, mesh_.tetrahedra[t]);
      detach(t);
    };
    for (const std::uint32_t t : edit.removed) remove(t);
    mesh_.vertices_body_m[edit.vertex] = edit.place.point;
    seat_[edit.vertex] = edit.place.seat;
    for (const Tetrahedron& t : edit.added) {
      undo.added.push_back(static_cast<std::uint32_t>(mesh_.tetrahedra.size()));
      mesh_.tetrahedra.push_back(kNoTetrahedron);
      attach(undo.added.back(), t);
    }
    std::vector<std::uint32_t> flat;
    double least = HUGE_VAL;
    for (const std::uint32_t t : undo.added) {
      const double height = height_of(mesh_.tetrahedra[t]) / cell_m_;
      if (std::abs(height) < kFlat)
        flat.push_back(t);
      else
        least = std::min(least, height);
    }
    // One that is removed may bare another.
    for (bool again = true; again && !flat.empty();) {
      again = false;
      for (std::size_t n = 0; n < flat.size(); ++n) {
        if (!can_peel(flat[n])) continue;
        detach(flat[n]);
        flat.erase(flat.begin() + static_cast<std::ptrdiff_t>(n--));
        again = true;
      }
    }
    return flat.empty() ? least : -1;
  }

  void take_back(const Undo& undo) {
    for (const std::uint32_t t : undo.added)
      if (mesh_.tetrahedra[t] != kNoTetrahedron) detach(t);
    mesh_.tetrahedra.resize(mesh_.tetrahedra.size() - undo.added.size());
    for (const auto& [t, corners] : undo.removed) attach(t, corners);
    if (undo.is_new) {
      mesh_.vertices_body_m.pop_back();
      star_.pop_back();
      seat_.pop_back();
    } else {
      mesh_.vertices_body_m[undo.vertex] = undo.place.point;
      seat_[undo.vertex] = undo.place.seat;
    }
  }

  void attach(std::uint32_t t, const Tetrahedron& corners) {
    mesh_.tetrahedra[t] = corners;
    for (const VertexId v : corners) star_[v].insert(std::ranges::lower_bound(star_[v], t), t);
  }
  void detach(std::uint32_t t) {
    for (const VertexId v : mesh_.tetrahedra[t]) std::erase(star_[v], t);
    mesh_.tetrahedra[t] = kNoTetrahedron;
  }

  // The least height over a face, with the sign of the volume.
  double height_of(const Tetrahedron& t) const {
    const auto& x = mesh_.vertices_body_m;
    double largest = 0;
    for (const auto& [i, j, k] : kTetFaces)
      largest = std::max(largest, (x[t[j]] - x[t[i]]).cross(x[t[k]] - x[t[i]]).norm());
    return largest > 0 ? 6 * tet_volume_m3(mesh_, t) / largest : 0;
  }

  bool is_boundary_edge(VertexId p, VertexId q) const {
    for (const std::uint32_t t : around(p, q))
      for (std::size_t i = 0; i < 4; ++i) {
        const VertexId v = mesh_.tetrahedra[t][i];
        if (v != p && v != q && is_boundary(t, i)) return true;
      }
    return false;
  }

  // Whether the boundary stays a manifold without this tetrahedron: two of its faces are on the boundary, and the edge
  // between the others is not.
  bool can_peel(std::uint32_t t) const {
    const Tetrahedron& c = mesh_.tetrahedra[t];
    std::vector<VertexId> opposite, rest;
    for (std::size_t i = 0; i < 4; ++i) (is_boundary(t, i) ? opposite : rest).push_back(c[i]);
    if (opposite.size() != 2) return false;
    return !is_boundary_edge(opposite[0], opposite[1]) && around(rest[0], rest[1]).size() == 1;
  }

  void compact() {
    std::erase(mesh_.tetrahedra, kNoTetrahedron);
    std::vector<VertexId> number(star_.size(), kNone);
    VertexId used = 0;
    for (VertexId v = 0; v < number.size(); ++v) {
      if (star_[v].empty()) continue;
      mesh_.vertices_body_m[used] = mesh_.vertices_body_m[v];
      seat_[used] = seat_[v];
      number[v] = used++;
    }
    mesh_.vertices_body_m.resize(used);
    seat_.resize(used);
    for (Tetrahedron& t : mesh_.tetrahedra)
      for (VertexId& v : t) v = number[v];
  }

  TetMesh& mesh_;
  const SurfaceCreases& creases_;
  double cell_m_;
  std::vector<std::vector<std::uint32_t>> star_;  // ascending
  std::vector<Seat> seat_;
};

}  // namespace

std::vector<Seat> sharpen(TetMesh& mesh, const SurfaceCreases& creases, double cell_m) {
  return Sharpening(mesh, creases, cell_m).run();
}

}  // namespace sectio
