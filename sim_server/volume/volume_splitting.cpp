#include "sim_server/volume/volume_splitting.h"

#include <algorithm>

#include "common/core/sort_unique.h"

namespace sectio {

std::uint32_t VolumeSplitting::tetrahedron_at(const SharedBody& body, TriangleId triangle) const {
  const TetTopology& volume = volume_->topology;
  const Corners3 corners = volume_->surface.in_volume(body.mesh.triangle(triangle));
  for (const std::uint32_t t : volume.star(corners[0]))
    if (std::ranges::all_of(corners, [&](VertexId v) {
          return std::ranges::find(volume.tetrahedra()[t], v) != volume.tetrahedra()[t].end();
        }))
      return t;
  return kNone;
}

Part VolumeSplitting::part_of(const SharedBody& body, std::span<const std::uint32_t> tetrahedra) const {
  const TetTopology& volume = volume_->topology;
  Part part;
  for (const std::uint32_t t : tetrahedra)
    for (std::size_t corner = 0; corner < 4; ++corner) {
      if (volume.across(t, corner) != kNone) continue;
      const Tetrahedron& c = volume.tetrahedra()[t];
      const auto& [i, j, k] = kTetFaces[corner];
      const TriangleId triangle = volume_->surface.triangle_of(body.mesh, {c[i], c[j], c[k]});
      if (triangle == kNone) continue;
      part.triangles.push_back(triangle);
      const auto& v = body.mesh.triangle(triangle).v;
      part.vertices.insert(part.vertices.end(), v.begin(), v.end());
    }
  for (auto* list : {&part.triangles, &part.vertices}) {
    sort_unique(*list);
  }
  return part;
}

PartSearch VolumeSplitting::separated(const SharedBody& body, std::span<const TriangleId> changed) {
  const TetTopology& volume = volume_->topology;
  std::vector<std::uint32_t> seeds;
  for (const TriangleId t : changed)
    if (t < body.mesh.triangle_slots() && body.mesh.triangle(t).alive()) seeds.push_back(tetrahedron_at(body, t));
  sort_unique(seeds);
  PartSearch result;
  if (seeds.empty()) return result;
  const Separated found = sectio::separated(seeds, [&](std::uint32_t t, std::vector<std::uint32_t>& neighbours) {
    for (std::size_t corner = 0; corner < 4; ++corner)
      if (const std::uint32_t u = volume.across(t, corner); u != kNone) neighbours.push_back(u);
  });
  result.visited = found.visited;
  for (const auto& tetrahedra : found.parts) result.parts.push_back(part_of(body, tetrahedra));
  // The rest is named by any of its triangles that changed.
  for (const TriangleId t : changed) {
    if (result.rest != kNone || t >= body.mesh.triangle_slots() || !body.mesh.triangle(t).alive()) continue;
    const bool came_off = std::ranges::any_of(
        result.parts, [&](const Part& part) { return std::ranges::binary_search(part.triangles, t); });
    if (!came_off) result.rest = t;
  }
  return result;
}

Part VolumeSplitting::whole(const SharedBody& body, TriangleId triangle) {
  return part_of(body, volume_->topology.connected({tetrahedron_at(body, triangle)}));
}

}  // namespace sectio
