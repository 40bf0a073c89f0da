// Tetrahedra of the alternating lattice of five, cut by the simulator's own engine where the scene has a slit, under
// any VolumeModel.
#pragma once

#include "tests/chart/specimen.h"

namespace sectio::chart {

struct ChartModel {
  std::unique_ptr<VolumeModel> model;
  // Elastic forces on the vertices. Nothing: vertices that are moved are dragged there, and the forces on them are the
  // reactions.
  std::function<void(std::span<const Vec4f> position_world_m, std::span<Vec3> force_n)> forces;
  bool drags_all = false;    // held vertices, too
  std::size_t elements = 0;  // 0: the tetrahedra
};
template <class Model>
ChartModel with_forces(std::unique_ptr<Model> model) {
  const Model* const own = model.get();
  return {std::move(model), [own](std::span<const Vec4f> x, std::span<Vec3> f) { own->elastic_forces_n(x, f); }};
}

using MakeVolume = std::function<ChartModel(const TetMesh& mesh, const VolumeMaterial&, const VolumeSettings&)>;

std::unique_ptr<Specimen> tet_specimen(const ChartScene& scene, int across, double step_s, const MakeVolume& make);
// The same of tetrahedra that somebody else made; the scene, which must outlive it, has a slit: they are cut.
std::unique_ptr<Specimen> tet_specimen(const ChartScene& scene, TetMesh mesh, double step_s, const MakeVolume& make);

}  // namespace sectio::chart
