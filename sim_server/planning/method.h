// A model with its integrator, as the planner sees it. Engines tell of theirs (ModelEntry::methods).
#pragma once

#include <cmath>
#include <string>
#include <vector>

namespace sectio::planning {

// The load, and what n counts for it.
enum class Load {
  bending,      // cells across the thickness
  twisting,     // cells across the thickness and the width
  indentation,  // cells along the width of the contact, 2 a
  opening,      // cells along the depth of the cut
  hanging,      // cells across the thickness; also of what stands or lies under its weight
};
constexpr int kLoads = 5;

const char* to_string(Load load);

// error = sqrt((c n^-p)^2 + floor^2)
struct ErrorLaw {
  double c = 0, p = 0, floor = 0;
  double at(double n) const { return std::hypot(c * std::pow(n, -p), floor); }
};
struct LoadLaw {
  Load load = Load::bending;
  ErrorLaw law;
};

// The elements of a model: vertices of a surface, tetrahedra, or cells of a lattice, which carry the tetrahedra.
enum class Elements { surface, tetrahedra, cells_on_faces, cells_beside_faces };  // cells of a box, or of another body

struct Method {
  std::string name;        // in tables and measurements; unique
  std::string model = {};  // name in a scene; filled in from the entry of the model
  Elements elements = Elements::tetrahedra;
  bool is_implicit = false;
  bool is_of_springs = false;      // its net has a Poisson's ratio of its own
  int most_parts = 1;              // in a step of a surface model; the others take as many as they need
  std::vector<LoadLaw> laws = {};  // nothing is planned for a load without one
  // Cells on a box's faces may be partly empty at its far end; these are the laws there.
  std::vector<LoadLaw> laws_of_partly_empty = {};

  bool needs_volume() const { return elements != Elements::surface; }
  bool embeds() const { return elements == Elements::cells_on_faces || elements == Elements::cells_beside_faces; }
};

}  // namespace sectio::planning
