#include "sim_server/meshing/relax.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace sectio {
namespace {

class Relaxation {
 public:
  Relaxation(TetMesh& mesh, const SurfaceCreases& creases, const std::vector<Seat>& seats)
      : mesh_(mesh),
        creases_(creases),
        seats_(seats),
        boundary_(mesh.vertices_body_m.size(), 0),
        star_(boundary_.size()),
        tried_(boundary_.size(), 0),
        changed_(boundary_.size(), 0) {
    const TetSurface outside = surface_of(mesh);
    for (const VertexId v : outside.of_volume) boundary_[v] = 1;
    for (const auto& t : outside.soup.triangles)
      for (std::size_t i = 0; i < 3; ++i)
        skin_edges_[outside.of_volume[t[i]]].push_back(outside.of_volume[t[(i + 1) % 3]]);
    stiffness_.assign(boundary_.size(), 0);
    volume_.assign(boundary_.size(), 0);
    for (std::uint32_t t = 0; t < mesh.tetrahedra.size(); ++t) {
      for (const VertexId v : mesh.tetrahedra[t]) star_[v].push_back(t);
      add(t, 1);
    }
  }

  void pass(const RelaxWhere& where) {
    for (VertexId v = 0; v < star_.size(); ++v)
      if (may_improve(v) && (!where || where(mesh_.vertices_body_m[v])) && !improve(v)) tried_[v] = ++moment_;
  }

 private:
  // Adds (sign 1) or removes (sign -1) a tetrahedron's share of the sums at its corners; returns the largest D that its
  // corners would have if it were alone.
  double add(std::uint32_t t, double sign) {
    const Tetrahedron& corners = mesh_.tetrahedra[t];
    const double volume = tet_volume_m3(mesh_, corners);
    if (!(volume > 0)) return HUGE_VAL;
    double worst = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto& x = mesh_.vertices_body_m;
      const Vec3& p = x[corners[kTetFaces[i][0]]];
      const double g2 = (x[corners[kTetFaces[i][1]]] - p).cross(x[corners[kTetFaces[i][2]]] - p).squaredNorm() /
                        (36 * volume * volume);
      stiffness_[corners[i]] += sign * volume * g2;
      volume_[corners[i]] += sign * 0.25 * volume;
      worst = std::max(worst, g2);
    }
    return worst;
  }

  struct Score {
    double nodes = 0, elements = 0;
    bool better_than(const Score& o) const { return nodes < 0.999 * o.nodes && elements <= o.elements; }
  };
  Score score(VertexId v, double elements) const {
    Score s{0, elements};
    for (const std::uint32_t t : star_[v])
      for (const VertexId w : mesh_.tetrahedra[t]) s.nodes = std::max(s.nodes, stiffness_[w] / volume_[w]);
    return s;
  }

  // Moves v and updates the sums; false, with nothing changed, if a tetrahedron would be inverted.
  bool move(VertexId v, const Vec3& to, double& worst_element) {
    const Vec3 from = mesh_.vertices_body_m[v];
    for (const std::uint32_t t : star_[v]) add(t, -1);
    mesh_.vertices_body_m[v] = to;
    const bool valid =
        std::ranges::all_of(star_[v], [&](std::uint32_t t) { return tet_volume_m3(mesh_, mesh_.tetrahedra[t]) > 0; });
    if (!valid) mesh_.vertices_body_m[v] = from;
    worst_element = 0;
    for (const std::uint32_t t : star_[v]) worst_element = std::max(worst_element, add(t, 1));
    return valid;
  }

  Vec3 middle_of_neighbours(VertexId v) const {
    Vec3 sum = Vec3::Zero();
    double count = 0;
    if (boundary_[v]) {
      for (const VertexId w : skin_edges_.at(v)) sum += mesh_.vertices_body_m[w], ++count;
      return sum / count;
    }
    for (const std::uint32_t t : star_[v])
      for (const VertexId w : mesh_.tetrahedra[t])
        if (w != v) sum += mesh_.vertices_body_m[w], ++count;
    return sum / count;
  }

  // A vertex that found nothing better needn't look again before something has changed around it.
  bool may_improve(VertexId v) const {
    return std::ranges::any_of(star_[v], [&](std::uint32_t t) {
      return std::ranges::any_of(mesh_.tetrahedra[t], [&](VertexId w) { return changed_[w] >= tried_[v]; });
    });
  }
  void moved(VertexId v) {
    ++moment_;
    for (const std::uint32_t t : star_[v])
      for (const VertexId w : mesh_.tetrahedra[t]) changed_[w] = moment_;
  }

  bool improve(VertexId v) {
    const Vec3 start = mesh_.vertices_body_m[v], middle = middle_of_neighbours(v);
    double elements = 0;
    move(v, start, elements);
    const Score before = score(v, elements);
    for (const double way : {1.0, 0.5, 0.25}) {
      Vec3 to = start + way * (middle - start);
      if (boundary_[v]) to = creases_.closest(to, seats_.empty() ? Seat{} : seats_[v]);
      if (move(v, to, elements) && score(v, elements).better_than(before)) {
        moved(v);
        return true;
      }
      move(v, start, elements);
    }
    return false;
  }

  TetMesh& mesh_;
  const SurfaceCreases& creases_;
  const std::vector<Seat>& seats_;  // empty: no vertex has one
  std::vector<std::uint8_t> boundary_;
  std::vector<std::vector<std::uint32_t>> star_;
  std::map<VertexId, std::vector<VertexId>> skin_edges_;
  std::vector<double> stiffness_, volume_;  // sums over the star
  std::uint64_t moment_ = 0;
  std::vector<std::uint64_t> tried_, changed_;  // by vertex: when it found nothing; when its D changed
};

}  // namespace

void relax(TetMesh& mesh, const SurfaceCreases& creases, const std::vector<Seat>& seats, const RelaxWhere& where,
           int passes) {
  Relaxation relaxation(mesh, creases, seats);
  for (int n = 0; n < passes; ++n) relaxation.pass(where);
}

}  // namespace sectio
