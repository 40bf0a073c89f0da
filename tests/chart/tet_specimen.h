// Tetrahedra of the alternating lattice of five, cut by the simulator's own engine where the scene has a slit, under
// any VolumeModel.
#pragma once

#include "tests/chart/specimen.h"

namespace sectio::chart {

using MakeVolume =
    std::function<std::unique_ptr<VolumeModel>(const TetMesh& mesh, const VolumeMaterial&, const VolumeSettings&)>;

std::unique_ptr<Specimen> tet_specimen(const ChartScene& scene, int across, double step_s, const MakeVolume& make);

}  // namespace sectio::chart
