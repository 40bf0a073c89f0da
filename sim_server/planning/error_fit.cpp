#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "sim_server/planning/error_law.h"

namespace sectio::planning {
namespace {

// The chart's scenes: the length that `across` divides, and the length along which n counts cells.
struct ChartLoad {
  const char* scene;
  Load load;
  double across_m, width_m;
};
const std::array<ChartLoad, kLoads> kScenes{{{"bend", Load::bending, 0.025, 0.025},
                                             {"twist", Load::twisting, 0.025, 0.025},
                                             {"indent", Load::indentation, 0.02, 2 * 0.00447213595},
                                             {"open", Load::opening, 0.01, 0.01},
                                             {"hang", Load::hanging, 0.03, 0.03}}};

struct ChartMethod {
  const char* model;   // the chart's table has this name
  const char* driver;  // likewise
  const char* name;    // Method::name
};
constexpr char kOfScene[] = "scene", kExplicit[] = "explicit", kImplicit[] = "1 ms implicit";
// A law each. The one with the implicit driver is that of the explicit one, with what the driver adds.
const std::array<ChartMethod, 6> kRows{{{"surface springs", kExplicit, "surface_springs"},
                                        {"tetra springs", kExplicit, "tetra_springs"},
                                        {"neo-Hookean tetra", kExplicit, "neo_hookean"},
                                        {"neo-Hookean tetra", kImplicit, "neo_hookean_implicit"},
                                        {"hexahedra", kExplicit, "lattice"},
                                        {"hexahedra beside faces", kExplicit, "lattice_beside_faces"}}};
const ChartMethod &kWithExplicit = kRows[2], &kWithImplicit = kRows[3];

constexpr double kFewestAcross = 2;  // the planner never chooses fewer elements

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> parts;
  std::istringstream in(line);
  for (std::string part; std::getline(in, part, ',');) parts.push_back(part);
  return parts;
}

// The errors of the two integrators on the same mesh.
struct Pair {
  double explicit_error = -1, implicit_error = -1;
};

// The sum of absolute, not squared, differences of logarithms, so that outliers, such as an error that crosses zero or
// a run that failed, don't dominate the fit.
double misfit(const ErrorLaw& law, std::span<const MeasuredError> points) {
  double sum = 0;
  for (const MeasuredError& p : points) sum += std::abs(std::log(law.at(p.n) / p.error));
  return sum;
}

constexpr double kLeastFloor = 1e-3;  // the accuracy of the references, and of steps and floats

// Minimises over log c, p and log floor, first on a grid, then by steps that are halved.
ErrorLaw fitted(std::span<const MeasuredError> points) {
  ErrorLaw best;
  double least = HUGE_VAL;
  const auto consider = [&](const ErrorLaw& law) {
    if (law.floor < kLeastFloor) return false;
    const double now = misfit(law, points);
    if (now >= least) return false;
    least = now;
    best = law;
    return true;
  };
  for (double log_c = -3; log_c <= 2.5; log_c += 0.25)
    for (double p = 0; p <= 3.5; p += 0.25)
      for (double log_floor = -6.5; log_floor <= 0; log_floor += 0.5)
        consider({std::exp(log_c), p, std::exp(log_floor)});
  for (double size = 0.25; size > 1e-4; size /= 2)
    for (bool better = true; better;) {
      better = false;
      const ErrorLaw from = best;
      for (const double sign : {-1.0, 1.0}) {
        better |= consider({from.c * std::exp(sign * size), from.p, from.floor});
        better |= from.p + sign * size >= 0 && consider({from.c, from.p + sign * size, from.floor});
        better |= consider({from.c, from.p, from.floor * std::exp(sign * size)});
        better |= consider({from.c * std::exp(sign * size), std::max(0.0, from.p + sign * size), from.floor});
      }
    }
  return best;
}

}  // namespace

std::vector<MeasuredError> read_chart(const std::string& csv) {
  std::istringstream lines(csv);
  std::string line;
  std::getline(lines, line);
  const std::vector<std::string> names = split(line);
  const auto column = [&](const char* name) {
    const auto at = std::ranges::find(names, name);
    if (at == names.end()) throw InputError(std::string("the chart's table: there is no column ") + name);
    return static_cast<std::size_t>(at - names.begin());
  };
  const std::size_t scene_at = column("scene"), model_at = column("model"), driver_at = column("driver"),
                    mesh_at = column("mesh"), across_at = column("across"), error_at = column("error");
  std::vector<MeasuredError> points;
  std::array<std::vector<Pair>, kLoads> pairs;
  while (std::getline(lines, line)) {
    const std::vector<std::string> row = split(line);
    if (row.size() <= error_at) continue;
    const auto scene = std::ranges::find_if(kScenes, [&](const ChartLoad& s) { return row[scene_at] == s.scene; });
    char* end = nullptr;
    const double error = std::strtod(row[error_at].c_str(), &end),
                 across = std::strtod(row[across_at].c_str(), nullptr);
    if (scene == kScenes.end() || row[mesh_at] != kOfScene || end == row[error_at].c_str() || !(error > 0) ||
        across < kFewestAcross)
      continue;
    if (error > 0.999 && scene->load != Load::twisting) continue;
    auto& paired = pairs[static_cast<std::size_t>(scene->load)];
    if (row[model_at] == kWithImplicit.model && (row[driver_at] == kExplicit || row[driver_at] == kImplicit)) {
      paired.resize(std::max(paired.size(), static_cast<std::size_t>(across) + 1));
      Pair& pair = paired[static_cast<std::size_t>(across)];
      (row[driver_at] == kExplicit ? pair.explicit_error : pair.implicit_error) = error;
    }
    for (const ChartMethod& m : kRows)
      if (row[model_at] == m.model && row[driver_at] == m.driver && m.driver == kExplicit)
        points.push_back({scene->load, m.name, across * scene->width_m / scene->across_m, error});
  }
  // The error of the implicit integrator is the explicit one plus the largest difference between the two.
  const std::size_t count = points.size();
  for (int load = 0; load < kLoads; ++load) {
    double added = 0;
    for (const Pair& pair : pairs[static_cast<std::size_t>(load)])
      if (pair.explicit_error > 0 && pair.implicit_error > 0)
        added = std::max(added, std::abs(pair.implicit_error - pair.explicit_error));
    for (std::size_t i = 0; i < count && !pairs[static_cast<std::size_t>(load)].empty(); ++i)
      if (points[i].load == static_cast<Load>(load) && points[i].method == kWithExplicit.name)
        points.push_back({points[i].load, kWithImplicit.name, points[i].n, std::hypot(points[i].error, added)});
  }
  return points;
}

std::vector<FittedLaw> fit_laws(std::span<const MeasuredError> points) {
  std::vector<FittedLaw> laws;
  for (int load = 0; load < kLoads; ++load)
    for (const ChartMethod& method : kRows) {
      std::vector<MeasuredError> own;
      for (const MeasuredError& p : points)
        if (p.load == static_cast<Load>(load) && p.method == method.name) own.push_back(p);
      if (own.size() >= 3) laws.push_back({static_cast<Load>(load), method.name, fitted(own)});
    }
  return laws;
}

std::string to_text(std::span<const FittedLaw> laws) {
  std::string text = "// Fitted to docs/chart.csv by `ninja renew_error_laws`: load, method, {c, p, floor}.\n";
  for (const FittedLaw& l : laws)
    text += formatted("{Load::%s, \"%s\", {%.4g, %.4g, %.4g}},\n", to_string(l.load), l.method.c_str(), l.law.c,
                      l.law.p, l.law.floor);
  return text;
}

}  // namespace sectio::planning
