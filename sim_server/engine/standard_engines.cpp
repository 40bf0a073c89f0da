#include "sim_server/engine/standard_engines.h"

#include "sim_server/engine/standard_traits.h"
#include "sim_server/surface/surface_engines.h"
#include "sim_server/volume/volume_engines.h"

namespace sectio {

EngineTable standard_engines() {
  EngineTable table;
  table.models = {
      {{.name = "surface_springs",
        .meaning = "A surface of springs that is held in its shape by springs to the shape at rest.",
        .accepts_templates = true},
       surface_spring_engines},
      {{.name = "tetra_springs",
        .meaning = "A net of springs along the edges of tetrahedra.",
        .needs_volume = true,
        .volume_keys = {"second_share", "damper_s"}},
       tetra_spring_engines,
       prepare_tetra_springs},
      {{.name = "neo_hookean", .meaning = "Finite elements: tetrahedra of a neo-Hookean solid.", .needs_volume = true},
       neo_hookean_engines},
      {{.name = "neo_hookean_lattice",
        .meaning =
            "Finite elements: hexahedra of a neo-Hookean solid, which carry the tetrahedra; these give the form.",
        .needs_volume = true,
        .volume_keys = {"cell_m"}},
       neo_hookean_lattice_engines,
       prepare_lattice}};
  return table;
}

const EngineTraits& standard_traits() {
  static const EngineTraits traits = standard_engines().traits();
  return traits;
}

}  // namespace sectio
