#include "sim_server/session/count_cuts.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/math/disjoint_sets.h"
#include "common/mesh/check.h"

namespace sectio {
namespace {

constexpr double kCell_m = 2e-3;
constexpr double kBesideGroove_m = 5e-4;  // corners of walls that face each other lie no further apart than this

// Corners of walls by the cell of space in which they lie.
class Places {
 public:
  struct Corner {
    std::uint32_t family, id;
    Vec3 at_m;
    double near_m;  // at most a cell
  };

  // Calls near(id) for those before it that are near.
  template <class Near>
  void add(const Corner& corner, const Near& near) {
    const Vec3 cell = (corner.at_m / kCell_m).array().floor();
    for (double x = -1; x <= 1; ++x)
      for (double y = -1; y <= 1; ++y)
        for (double z = -1; z <= 1; ++z)
          if (const auto found = cells_.find(key(cell + Vec3(x, y, z))); found != cells_.end())
            for (const Corner& other : found->second)
              if (other.family == corner.family && (other.at_m - corner.at_m).norm() <= corner.near_m) near(other.id);
    cells_[key(cell)].push_back(corner);
  }

 private:
  static std::uint64_t key(const Vec3& cell) {
    std::uint64_t key = 0;
    for (const double c : cell) key = key << 21 ^ (static_cast<std::uint64_t>(static_cast<std::int64_t>(c)) & 0x1fffff);
    return key;
  }
  std::unordered_map<std::uint64_t, std::vector<Corner>> cells_;
};

}  // namespace

std::size_t count_cuts(std::span<const CutSurface> surfaces) {
  std::uint32_t slots = 0;
  for (const CutSurface& surface : surfaces) slots += surface.mesh->vertex_slots();
  DisjointSets walls(slots);  // numbers: the vertices of all surfaces, one after the other
  std::vector<std::uint8_t> is_corner(slots, 0);
  Places places;
  std::uint32_t first = 0;
  for (const CutSurface& surface : surfaces) {
    const TriangleMesh& mesh = *surface.mesh;
    const std::vector<std::uint32_t> component = component_of_triangle(mesh);
    const std::vector<double> volume_m3 = component_rest_volumes_m3(mesh, component);
    const double near_m = std::min(surface.groove_m + kBesideGroove_m, kCell_m);
    for (TriangleId t = 0; t < mesh.triangle_slots(); ++t) {
      const Triangle& triangle = mesh.triangle(t);
      if (!triangle.alive() || triangle.surface != Surface::wall || volume_m3[component[t]] < kLeastPiece_m3) continue;
      for (const VertexId v : triangle.v) {
        const std::uint32_t id = first + v;
        if (!std::exchange(is_corner[id], 1))
          places.add({surface.family, id, surface.at_rest_world.to_world(mesh.rest_body_m(v)), near_m},
                     [&](std::uint32_t other) { walls.join(other, id); });
        walls.join(id, first + triangle.v[0]);
      }
    }
    first += mesh.vertex_slots();
  }
  std::size_t cuts = 0;
  for (std::uint32_t id = 0; id < slots; ++id) cuts += is_corner[id] && walls.root(id) == id;
  return cuts;
}

}  // namespace sectio
