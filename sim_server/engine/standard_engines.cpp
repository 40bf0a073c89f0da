#include "sim_server/engine/standard_engines.h"

#include "sim_server/surface/surface_engines.h"
#include "sim_server/volume/volume_engines.h"

namespace sectio {

EngineTable standard_engines() {
  return {{{"surface_springs", surface_spring_engines},
           {"tetra_springs", tetra_spring_engines},
           {"neo_hookean", neo_hookean_engines},
           {"neo_hookean_lattice", neo_hookean_lattice_engines}}};
}

}  // namespace sectio
