// Methods that the simulator does not have, for the chart only: in floats and registers like those of the simulator,
// except those of the paper.
#pragma once

#include "tests/chart/tet_specimen.h"

namespace sectio::chart {

// Linear tetrahedra, stable neo-Hookean with the pressure of each element, explicit, element by element.
ChartModel plain_tetrahedra(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings);

// Paper C's own springs: edges and second neighbours with one constant each, equal masses, Verlet, loop over springs.
// The two constants share the stiffness that Young's modulus asks for, sum k l^2 = 6 E V, half and half.
ChartModel papers_springs(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings);

// XPBD (Macklin et al. 2016, 2019) with neo-Hookean constraints (Macklin and Mueller 2021), in colours of tetrahedra
// that share no vertex: settings.step_s is a substep, of `iterations` each.
ChartModel xpbd(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings, int iterations);

// Corotational linear tetrahedra (Mueller and Gross 2004): rotations from those of the last step (Kugelstadt et al.
// 2018), and one linearly implicit step (Baraff and Witkin 1998) by conjugate gradients with the diagonal blocks as
// preconditioner, from the last velocity until a thousandth of the largest residual so far is left, at most
// `iterations`.
ChartModel corotational(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings,
                        int iterations);

}  // namespace sectio::chart
