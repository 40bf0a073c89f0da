#include "sim_server/engine/standard_engines.h"

#include "sim_server/deformation/surface_springs.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/planning/error_law.h"
#include "sim_server/surface/surface_engines.h"
#include "sim_server/volume/volume_engines.h"

namespace sectio {

using planning::Elements;
using planning::fitted_laws;

EngineTable standard_engines() {
  EngineTable table;
  table.models = {
      {.traits = {.name = "surface_springs",
                  .meaning = "A surface of springs that is held in its shape by springs to the shape at rest.",
                  .accepts_templates = true},
       .make = surface_spring_engines,
       .methods = {{.name = "surface_springs",
                    .elements = Elements::surface,
                    .is_of_springs = true,
                    .most_parts = SurfaceSprings::kMostParts,
                    .laws = fitted_laws("surface_springs")}}},
      {.traits = {.name = "tetra_springs",
                  .meaning = "A net of springs along the edges of tetrahedra.",
                  .needs_volume = true,
                  .volume_keys = {"second_share", "damper_s"}},
       .make = tetra_spring_engines,
       .prepare = prepare_tetra_springs,
       .methods = {{.name = "tetra_springs", .is_of_springs = true, .laws = fitted_laws("tetra_springs")}}},
      {.traits = {.name = "neo_hookean",
                  .meaning = "Finite elements: tetrahedra of a neo-Hookean solid.",
                  .needs_volume = true},
       .make = neo_hookean_engines,
       .methods = {{.name = "neo_hookean", .laws = fitted_laws("neo_hookean")},
                   {.name = "neo_hookean_implicit", .is_implicit = true, .laws = fitted_laws("neo_hookean_implicit")}}},
      {.traits = {.name = "neo_hookean_lattice",
                  .meaning = "Finite elements: hexahedra of a neo-Hookean solid, which carry the tetrahedra; these "
                             "give the form.",
                  .needs_volume = true,
                  .volume_keys = {"cell_m"}},
       .make = neo_hookean_lattice_engines,
       .prepare = prepare_lattice,
       .methods = {{.name = "lattice",
                    .elements = Elements::cells_on_faces,
                    .laws = fitted_laws("lattice"),
                    .laws_of_partly_empty = fitted_laws("lattice_beside_faces")},
                   {.name = "lattice_beside_faces",
                    .elements = Elements::cells_beside_faces,
                    .laws = fitted_laws("lattice_beside_faces")}}}};
  return table;
}

const EngineTraits& standard_traits() {
  static const EngineTraits traits = standard_engines().traits();
  return traits;
}

}  // namespace sectio
