// How much of each region a part of a body contains, at rest: "marked tissue removed, healthy tissue lost". Pure
// functions, deterministic, whatever the part has been through.
#pragma once

#include <span>
#include <vector>

#include "common/material/regions.h"
#include "common/mesh/tet_mesh.h"

namespace sectio {

struct RegionVolumes {
  std::vector<double> region_m3;  // one a region
  double other_m3 = 0;            // of the tissue around them
  double marked_m3(const Regions& regions) const;
  double total_m3() const;
};

constexpr double kRegionResolution_m = 5e-4;

// Of tetrahedra. Those with a border inside are divided until their parts are smaller than the resolution; the sum is
// the volume of the tetrahedra, however coarse that is.
RegionVolumes region_volumes(const Regions& regions, std::span<const Vec3> vertices_rest_m,
                             std::span<const Tetrahedron> tetrahedra, double resolution_m = kRegionResolution_m);

// Of what a closed, oriented surface encloses: along lines of a grid that is the same for every surface, so that the
// volumes of parts add up to that of the whole. Dead triangles are none.
RegionVolumes region_volumes(const Regions& regions, std::span<const Vec3> vertices_rest_m,
                             std::span<const Triangle> triangles, double resolution_m = kRegionResolution_m);

// The region at each point.
std::vector<std::uint32_t> regions_at(const Regions& regions, std::span<const Vec3> rest_m);
// And in the middle of each tetrahedron.
std::vector<std::uint32_t> regions_of(const Regions& regions, const TetMesh& mesh);

}  // namespace sectio
