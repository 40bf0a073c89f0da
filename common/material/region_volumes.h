// The volume of each region in a part of a body, at rest, from which an exercise scores marked tissue removed and
// healthy tissue lost. Pure, deterministic functions: the history of the part doesn't matter.
#pragma once

#include <span>
#include <vector>

#include "common/material/regions.h"
#include "common/mesh/tet_mesh.h"

namespace sectio {

struct RegionVolumes {
  std::vector<double> region_m3;  // one a region
  double other_m3 = 0;            // the tissue outside all regions
  double marked_m3(const Regions& regions) const;
  double total_m3() const;
};

constexpr double kRegionResolution_m = 5e-4;

// The volumes in tetrahedra. One that a border may cross is divided until its parts are smaller than the resolution;
// the sum is the volume of the tetrahedra at any resolution.
RegionVolumes region_volumes(const Regions& regions, std::span<const Vec3> vertices_rest_m,
                             std::span<const Tetrahedron> tetrahedra, double resolution_m = kRegionResolution_m);

// The volumes inside a closed, oriented surface, sampled along lines of a grid that is the same for every surface, so
// that the volumes of parts add up to that of the whole. Dead triangles are skipped.
RegionVolumes region_volumes(const Regions& regions, std::span<const Vec3> vertices_rest_m,
                             std::span<const Triangle> triangles, double resolution_m = kRegionResolution_m);

// The region at each point.
std::vector<std::uint32_t> regions_at(const Regions& regions, std::span<const Vec3> rest_m);
// The region at the centroid of each tetrahedron.
std::vector<std::uint32_t> regions_of(const Regions& regions, const TetMesh& mesh);

}  // namespace sectio
