// Bodies that are volumes of tetrahedra: models tetra_springs (M2), neo_hookean (M3) and
// neo_hookean_lattice (M4), where the tetrahedra ride on hexahedra. Part of simulation.*.
#pragma once

#include "sim_server/simulation_engines.h"

namespace sectio {

// The scene with a volume for each body whose model needs one (BodySpec::tets): its surface is filled, or the volume's
// file is read. The body's mesh becomes the volume's surface, whose vertices are the first ones of the volume. What
// came out is said in BodySpec::mesh_notes. Throws InputError that names scene and body.
Scene with_volumes(Scene scene);

// Collision as for surfaces; cuts as in simulation_volume_cut.h; parts that come off are volumes, too, unless they are
// rigid.
BodyEngines tetra_spring_engines(const EngineSite& site);
BodyEngines neo_hookean_engines(const EngineSite& site);
BodyEngines neo_hookean_lattice_engines(const EngineSite& site);

}  // namespace sectio
