// Parts of a volume: tetrahedra that hang together through faces, with all of the surface that they have, cracks and
// hollows inside included.
#pragma once

#include "sim_server/components/splitting_engine.h"
#include "sim_server/volume/volume_cutting.h"

namespace sectio {

class VolumeSplitting final : public SplittingEngine {
 public:
  // `cutting` has the volume, and outlives the last call.
  explicit VolumeSplitting(const VolumeCutting& cutting) : cutting_(cutting) {}

  PartSearch separated(const SharedBody& body, std::span<const TriangleId> changed) override;
  Part whole(const SharedBody& body, TriangleId triangle) override;
  void follow(const SharedBody&, const TopologyChange&) override {}

 private:
  Part part_of(const SharedBody& body, std::span<const std::uint32_t> tetrahedra) const;
  std::uint32_t tetrahedron_at(const SharedBody& body, TriangleId triangle) const;

  const VolumeCutting& cutting_;
};

}  // namespace sectio
