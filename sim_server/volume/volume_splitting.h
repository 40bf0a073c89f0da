// Components of a volume: tetrahedra that are connected through faces, with all of their surface, that of cracks and
// hollows inside included.
#pragma once

#include <memory>
#include <utility>

#include "sim_server/components/splitting_engine.h"
#include "sim_server/volume/volume.h"

namespace sectio {

class VolumeSplitting final : public SplittingEngine {
 public:
  explicit VolumeSplitting(std::shared_ptr<const Volume> volume) : volume_(std::move(volume)) {}

  PartSearch separated(const SharedBody& body, std::span<const TriangleId> changed) override;
  Part whole(const SharedBody& body, TriangleId triangle) override;
  void follow(const SharedBody&, const TopologyChange&) override {}
  void archive(Archive&, const SharedBody&) override {}

 private:
  Part part_of(const SharedBody& body, std::span<const std::uint32_t> tetrahedra) const;
  std::uint32_t tetrahedron_at(const SharedBody& body, TriangleId triangle) const;

  std::shared_ptr<const Volume> volume_;
};

}  // namespace sectio
