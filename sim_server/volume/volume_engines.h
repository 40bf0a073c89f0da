// Bodies that are volumes of tetrahedra: models tetra_springs, neo_hookean and neo_hookean_lattice, in which the
// tetrahedra are embedded in hexahedra.
#pragma once

#include "sim_server/engine/engine_table.h"

namespace sectio {

// Collision as for surfaces; cuts as in volume_cutting.h; parts that come off are volumes, too, unless they are
// rigid.
BodyEngines tetra_spring_engines(const EngineSite& site);
BodyEngines neo_hookean_engines(const EngineSite& site);
BodyEngines neo_hookean_lattice_engines(const EngineSite& site);

// The size of the cells where the scene doesn't say, and what came out of it.
void prepare_lattice(BodySpec& body);
// The Young's modulus of the springs before and after their correction.
void prepare_tetra_springs(BodySpec& body);

}  // namespace sectio
