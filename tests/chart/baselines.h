// Methods that the simulator does not have, written as one would write them down, for the chart only.
#pragma once

#include "tests/chart/tet_specimen.h"

namespace sectio::chart {

// Linear tetrahedra, stable neo-Hookean with the pressure of each element, explicit, loop over elements, double.
ChartModel plain_tetrahedra(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings);

// Paper C's own: edges and second neighbours with one constant each, equal masses, Verlet, loop over springs. The two
// constants share the stiffness that Young's modulus asks for, sum k l^2 = 6 E V, half and half.
ChartModel papers_springs(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings);

// XPBD with small steps (Macklin et al. 2016, 2019) and neo-Hookean constraints (Macklin and Mueller 2021), one after
// the other in the order of the mesh: settings.step_s is a substep, of `iterations` each.
ChartModel xpbd(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings, int iterations);

// Corotational linear tetrahedra (Mueller and Gross 2004), one linearly implicit step by conjugate gradients with the
// diagonal blocks as preconditioner, at most `iterations`, warm from the last velocity (Baraff and Witkin 1998).
ChartModel corotational(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings,
                        int iterations);

}  // namespace sectio::chart
