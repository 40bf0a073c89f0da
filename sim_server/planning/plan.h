// "Model no more than a scene needs": which model, how fine, which driver and step a body gets, from what will be done
// to it (body_loads.h), how far from the truth each would be (error_law.h), and what it would cost on this machine.
// Plain data in, plain data out.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "sim_server/planning/body_loads.h"

namespace sectio::planning {

// Processor's time on one machine, measured (prepare/machine_speed.h).
struct Rate {
  double element_ns = 0;  // of a part of a step (or of a sweep), for each element: vertex (M1), tetrahedron, hexahedron
  double vertex_ns = 0;   // of a step, for each vertex, whatever the number of parts
  // The longest part that its driver takes, over cell / sqrt(modulus / density): see modulus_pa() in plan.cpp.
  double limit = 0;
};
struct Calibration {
  std::array<Rate, kMethods> rate{};  // by Method; lattice_beside_faces as lattice
  double touch_ns = 0;                // of a step with an instrument at the surface
  double touched_vertex_ns = 0;       // of a step, for each vertex of a surface that an instrument looks for
};

struct Budgets {
  double error = 0.1;  // relative
  double cpu = 0.5;    // processor's time for a second
};

struct PlanInput {
  std::string body;
  Budgets budgets;
  BodyShape shape;
  double young_pa = 6000, poisson = 0.45, density_kg_per_m3 = 1060;
  std::vector<BodyLoad> loads;
  bool has_tools = false;
  double step_s = 0.001;
  double surface_limit_s = 0;         // the longest step of surface springs on this surface
  std::string no_surface, no_volume;  // why the scene rules out a model with, or without an inside; empty: it doesn't
  double given_tetrahedra = 0;        // the scene brings its own; 0: it doesn't
};

struct Candidate {
  Method method = Method::surface_springs;
  double step_s = 0;
  double cell_m = 0;
  double tetrahedra = 0;  // of a volume
  double elements = 0, vertices = 0;
  int parts = 1;  // of a step; sweeps of the implicit driver
  double error = 0, cpu = 0;
  Load worst = Load::bending;  // where the error is
  bool built = false;          // elements, vertices and parts are counted, not estimated
};

// What came out when one was built.
struct Built {
  double elements = 0, vertices = 0, surface_vertices = 0;
  int parts = 1;
};

struct BodyPlan {
  Candidate chosen;
  bool fits = false;
  std::vector<Candidate> considered;                      // one a method: the one that comes closest
  std::vector<std::pair<Method, std::string>> ruled_out;  // and why
};

// Chooses, has the choice built (when `build` is given) and chooses again with what came out, until it stays. Surface
// springs when they keep both budgets, else the cheapest that does; else that with the smallest max(error / budget,
// cost / budget).
BodyPlan plan(const PlanInput& input, const Calibration& calibration,
              const std::function<Built(const Candidate&)>& build = {});

// For people: loads, what was considered, what was taken and why. Lines end with a newline.
std::string to_text(const PlanInput& input, const BodyPlan& plan);

}  // namespace sectio::planning
