#include "sim_server/engine/standard_traits.h"

namespace sectio {

const EngineTraits& standard_traits() {
  static const EngineTraits traits = {
      {{.name = "surface_springs",
        .meaning = "A surface of springs that is held in its shape by springs to the shape at rest.",
        .accepts_templates = true},
       {.name = "tetra_springs", .meaning = "A net of springs along the edges of tetrahedra.", .needs_volume = true},
       {.name = "neo_hookean", .meaning = "Finite elements: tetrahedra of a neo-Hookean solid.", .needs_volume = true},
       {.name = "neo_hookean_lattice",
        .meaning =
            "Finite elements: hexahedra of a neo-Hookean solid, which carry the tetrahedra; these give the form.",
        .needs_volume = true}},
      {}};
  return traits;
}

}  // namespace sectio
