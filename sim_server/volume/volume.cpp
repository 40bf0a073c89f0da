#include "sim_server/volume/volume.h"

#include <algorithm>
#include <map>
#include <utility>

namespace sectio {

Volume::Volume(const TetMesh& mesh, std::vector<VertexId> vertex_of, VolumeDeformation& moves, IsFixed fixed)
    : deformation(moves),
      is_fixed(std::move(fixed)),
      topology(mesh),
      surface(std::move(vertex_of), mesh.vertices_body_m.size()),
      mean_edge_m(sectio::mean_edge_m(mesh)) {
  visited.begin(topology.vertex_count());
}

TetVertexState Volume::state_of(const SharedBody& body, VertexId v) const {
  const Vec4f &x = body.particles.position_world_m[v], &u = body.particles.velocity_world_m_per_s[v];
  return {topology.vertex(v).rest_body_m, x.head<3>().cast<double>(), u.head<3>().cast<double>()};
}

// A vertex in which two components touch has slots of both, and doesn't tell which of them is meant.
std::vector<std::uint32_t> Volume::tetrahedra_of(std::span<const VertexId> slots) const {
  std::vector<VertexId> sorted(slots.begin(), slots.end());
  std::ranges::sort(sorted);
  std::vector<std::uint32_t> begin;
  for (const VertexId slot : slots) {
    const VertexId v = surface.vertex_of(slot);
    if (!std::ranges::all_of(surface.slots_of(v), [&](VertexId s) { return std::ranges::binary_search(sorted, s); }))
      continue;
    begin.insert(begin.end(), topology.star(v).begin(), topology.star(v).end());
  }
  return topology.connected(std::move(begin));
}

VolumePart Volume::part(std::span<const VertexId> slots) const {
  VolumePart part;
  std::map<VertexId, VertexId> number;
  const auto number_of = [&](VertexId v) {
    const auto [it, is_new] = number.try_emplace(v, static_cast<VertexId>(number.size()));
    if (is_new) {
      part.mesh.vertices_body_m.push_back(topology.vertex(v).rest_body_m);
      part.vertex_from.push_back(v);
    }
    return it->second;
  };
  for (const VertexId slot : slots) part.vertex_of.push_back(number_of(surface.vertex_of(slot)));
  for (const std::uint32_t t : tetrahedra_of(slots)) {
    Tetrahedron corners = topology.tetrahedra()[t];
    for (VertexId& v : corners) v = number_of(v);
    part.mesh.tetrahedra.push_back(corners);
  }
  return part;
}

// A vertex that the deformation does not have yet has no momentum. The topology may not have all of them any more.
Volume::Momentum Volume::momentum(const SharedBody& body, std::vector<VertexId> ascending) const {
  Momentum sum{std::move(ascending)};
  for (const VertexId v : sum.vertices)
    if (v < body.particles.size())
      sum.sum_n_s += deformation.model().mass_kg(v) * body.particles.velocity_world_m_per_s[v].head<3>().cast<double>();
  return sum;
}

Volume::Momentum Volume::momentum(const SharedBody& body, std::span<const TetEdit> edits) const {
  VertexId end = 0;
  const auto each_corner = [&](const auto& visit) {
    for (const TetEdit& e : edits)
      for (const Tetrahedron& t : {e.before, e.after})
        for (const VertexId v : t)
          if (v != kNone) visit(v);
  };
  each_corner([&](VertexId v) { end = std::max(end, v + 1); });
  visited.begin(std::max<std::size_t>(end, topology.vertex_count()));
  each_corner([&](VertexId v) { visited.insert(v); });
  const std::span<const VertexId> sorted = visited.sorted();
  return momentum(body, std::vector<VertexId>(sorted.begin(), sorted.end()));
}

void Volume::conserve_momentum(const SharedBody& body, const Momentum& before) {
  if (before.vertices.empty()) return;
  const Vec3 missing_n_s = before.sum_n_s - momentum(body, before.vertices).sum_n_s;
  const auto is_free = [&](VertexId v) {
    return v < body.particles.size() && deformation.model().inverse_mass_per_kg(v) > 0;  // not fixed, not gone
  };
  double free_kg = 0;
  for (const VertexId v : before.vertices)
    if (is_free(v)) free_kg += deformation.model().mass_kg(v);
  if (free_kg == 0) return;
  const Vec3 faster = missing_n_s / free_kg;
  for (const VertexId v : before.vertices)
    if (is_free(v)) body.particles.velocity_world_m_per_s[v].head<3>() += faster.cast<float>();
}

}  // namespace sectio
