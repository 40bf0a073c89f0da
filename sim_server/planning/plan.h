// Plans a body's model, resolution, integrator and step from the loads on it (body_loads.h), the error of each choice
// (error_law.h) and its cost on this machine: no more than the scene needs. Plain data in, plain data out.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sim_server/planning/body_loads.h"
#include "sim_server/planning/strokes.h"

namespace sectio::planning {

// Processor time on one machine, as measured (prepare/machine_speed.h).
struct Rate {
  double element_ns = 0;  // for each element (vertex of a surface, tetrahedron, hexahedron) and substep or sweep
  double vertex_ns = 0;   // for each vertex and step, whatever the number of substeps
  // The largest substep of the integrator, over cell / sqrt(modulus / density); see modulus_pa() in plan.cpp.
  double limit = 0;
  double part_ns = 0;  // for each substep, whatever the number of elements
  double held_ns = 0;  // for each substep and each vertex that jaws hold
};
// Processor time of cutting. Lengths are in edges: of the lattice's cubes (resolution.h), or of a surface's triangles.
struct CutRate {
  double changes_per_edge = 0;  // changes of the topology while the blade goes one edge
  double change_ns = 0;         // per change; plus
  double deep_ns = 0;           // per change and edge of the blade's depth; plus
  double whole_ns = 0;          // per change and tetrahedron of the body; plus
  double cell_ns = 0;           // per change and cell of a lattice
  double open_ns = 0;           // per later step and squared edge of cut: the lips of the cut
};
struct Calibration {
  std::map<std::string, Rate> rate;    // by name of the method
  std::map<std::string, CutRate> cut;  // by model
  double step_ns = 0;                  // for each step of a body, whatever it is
  double loose_vertex_ns = 0;          // for each step and vertex of a surface that nothing holds
  double touch_ns = 0;                 // for each step with an instrument at the surface
  double touched_vertex_ns = 0;        // for each such step and vertex of the surface
};

struct Budgets {
  double error = 0.1;  // relative
  double cpu = 0.5;    // processor time for a second of simulation
};

struct PlanInput {
  std::string body;
  std::span<const Method> methods;  // from which to choose; they outlive the plan
  Budgets budgets;
  BodyShape shape;
  ElasticMaterial material;
  std::vector<BodyLoad> loads;
  std::vector<Stroke> strokes;
  bool has_tools = false, is_held = true;
  double gripped_share = 0;  // between jaws, of the surface
  double step_s = 0.001;
  double surface_limit_s = 0;         // the largest stable part of a step of a model of the surface alone
  std::string no_surface, no_volume;  // why the scene rules out models without or with an inside; empty: it doesn't
  double given_tetrahedra = 0;        // number of tetrahedra in the scene's own file; 0: there is none
};

struct Candidate {
  const Method* method = nullptr;
  double step_s = 0;
  double cell_m = 0;
  double tetrahedra = 0;  // for a model with an inside
  double elements = 0, vertices = 0;
  int substeps = 1;  // substeps in a step; the step of the implicit integrator is undivided
  double error = 0, cpu = 0;
  double cut_cpu = 0;     // while a blade cuts, with all that it has cut; 0: none does
  double cut_step_s = 0;  // processor's time of a step in which the topology changes
  double elements_after_cut = 0;
  Load worst = Load::bending;     // the load with this error
  bool built = false;             // elements, vertices and substeps are counted, not estimated
  std::optional<double> weighed;  // the error by weight as it was measured; empty: it follows from the law
  std::string unfit;              // why a run with it would not be ok; empty: nothing is known

  double most_cpu() const { return std::max(cpu, cut_cpu); }
};

// The counts of a candidate that was built, its error by weight if that was measured, and why a run with it would not
// be ok; empty: nothing speaks against it, or it was made coarser than it is.
struct Built {
  double elements = 0, vertices = 0, surface_vertices = 0;
  int substeps = 1;
  std::optional<double> weighed = {};
  std::string unfit = {};
};

struct BodyPlan {
  Candidate chosen;
  bool fits = false;
  std::vector<Candidate> considered;                             // the best one of each method
  std::vector<std::pair<const Method*, std::string>> ruled_out;  // with the reason
};

// Chooses a candidate, has it built if `build` is given, and chooses again with its counts and its measured error until
// the choice stays. A candidate that isn't built is judged by a built one of its method (finer()), and one that is
// unfit when built is taken only if all are. The choice is a surface if it keeps both budgets, else the cheapest
// candidate that does, else that with the smallest max(error / budget, cost / budget). The cost of a body that is cut
// is the cost while it is cut.
BodyPlan plan(const PlanInput& input, const Calibration& calibration,
              const std::function<Built(const Candidate&)>& build = {});

// A text for people: loads, candidates, the choice and its reason. Lines end with a newline.
std::string to_text(const PlanInput& input, const BodyPlan& plan);

}  // namespace sectio::planning
