#include "sim_server/prepare/machine_speed.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "common/core/log.h"
#include "common/core/processor_time.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/planning/resolution.h"
#include "sim_server/prepare/cache_folder.h"
#include "sim_server/prepare/calibration_block.h"
#include "sim_server/prepare/cut_speed.h"
#include "sim_server/simulation.h"
#include "sim_server/world/body.h"

namespace sectio {
namespace {

using planning::Calibration;
using planning::CutRate;
using planning::Elements;
using planning::Method;
using planning::Rate;

constexpr int kTries = 7, kSteps = 6, kHeld = 40;
constexpr double kSoft_pa = 2000, kStiff_pa = 4e6, kCell_m = kBlockCell_m, kDensity = 1060,
                 kNu = 0.45;                       // Poisson's ratio of MaterialSpec
constexpr double kBall_m = 0.01, kDent_m = 0.002;  // contact in a dent takes twice as long as that of a ball that rests
constexpr int kDentSteps = 200;                    // steps in which the ball comes down
constexpr char kFirstLine[] = "sectio calibration 7", kEnd[] = "end";

struct Blocks {
  Scene filled, embedded, small;  // for tetrahedra, for a lattice of kCell_m, and for either: of few elements
};

// The block sags.
class Specimen {
 public:
  Specimen(Scene scene, const EngineTable& engines)
      : scene_(std::move(scene)), body_(scene_.bodies[0], scene_, 0, engines.model(scene_.bodies[0].model).make) {}

  // Jaws hold vertices of the surface from now on.
  void hold(std::size_t count) {
    for (VertexId v = 0; v < body_.mesh.vertex_slots() && held_.size() < count; ++v)
      if (!body_.engines.deformation->fixed(v)) held_.push_back(sectio::hold(v, body_.mesh.rest_body_m(v)));
    reactions_.resize(held_.size());
  }
  // The time of a step, s: the least of several tries.
  double step_s() {
    double least = HUGE_VAL;
    for (int t = 0; t < kTries; ++t) {
      const double start = processor_time_s();
      for (int i = 0; i < kSteps; ++i) body_.deform(held_, reactions_, scene_.step_s);
      least = std::min(least, (processor_time_s() - start) / kSteps);
    }
    return least;
  }
  // The time in which an instrument looks for the surface after a step, s.
  double look_s() {
    double least = HUGE_VAL;
    for (int t = 0; t < kTries; ++t) {
      body_.deform({}, {}, scene_.step_s);
      const double start = processor_time_s();
      body_.tree();
      least = std::min(least, processor_time_s() - start);
    }
    return least;
  }
  double surface_vertices() const { return body_.mesh.vertex_count(); }
  ModelSize size() { return body_.engines.deformation->size(body_.shared()); }

 private:
  Scene scene_;
  Body body_;
  std::vector<PointConstraint> held_;
  std::vector<Reaction> reactions_;
};

// The cost of a surface, as a report tells that of its body, which a ball dents or nothing does.
double reported_step_s(bool touched) {
  Scene scene = surface_block();
  if (touched) {
    scene.tools.resize(1);
    scene.tools[0].kind = "probe";
    scene.tools[0].geometry = instrument_of("probe").geometry;
    scene.tools[0].geometry.sphere_radius_m = kBall_m;
  }
  Simulation simulation(scene);
  simulation.measure_with(processor_time_s);
  StepInput input;
  std::uint64_t n = 0;
  double so_far_s = 0;
  const auto step = [&](double depth_m) {
    Pose pose;
    pose.position_m = Vec3(0.03, 0.03, 0.04 + kBall_m - depth_m);
    ++n;
    if (touched) input.samples = {{0, n, static_cast<double>(n) * scene.step_s, pose, 0}};
    so_far_s = simulation.step(input).report.processor_s[0];
  };
  for (int i = 0; i < kDentSteps; ++i) step(kDent_m * i / kDentSteps);
  double least = HUGE_VAL;
  for (int t = 0; t < kTries; ++t) {
    const double start_s = so_far_s;
    for (int i = 0; i < kSteps; ++i) step(kDent_m);
    least = std::min(least, (so_far_s - start_s) / kSteps);
  }
  return least;
}

// The tissue's fastest wave squared, over Young's modulus over density.
double stiffening(const Method& method) {
  const double mu = 1 / (2 * (1 + kNu)), lambda = 2 * mu * kNu / (1 - 2 * kNu);
  return method.is_of_springs ? 1 : method.embeds() ? lambda + 2 * mu / 3 : lambda + 2 * mu;
}

// The costs of a block that is soft, of which a step has few parts, and stiff, of which it has many.
struct Parted {
  double elements = 0, vertices = 0, part_s = 0, rest_s = 0, held_s = 0, limit = 0;
};
Parted parted(const Scene& block, const Method& method, double cell_m, double stiff_pa, const EngineTable& engines) {
  Specimen soft(with_model(block, method, kSoft_pa, cell_m), engines),
      stiff(with_model(block, method, stiff_pa, cell_m), engines);
  const double few = soft.size().parts, many = stiff.size().parts;
  const double fast_s = soft.step_s(), slow_s = stiff.step_s();
  Parted p{stiff.size().elements, soft.size().vertices};
  p.part_s = std::max(1e-12, slow_s - fast_s) / (many - few);
  p.rest_s = std::max(0.0, fast_s - few * p.part_s);
  stiff.hold(kHeld);
  p.held_s = std::max(0.0, stiff.step_s() - slow_s) / (many * kHeld);
  p.limit = stiff.size().part_limit_s / (kCell_m / std::sqrt(stiff_pa * stiffening(method) / kDensity));
  return p;
}

// The part of a small block tells what a part costs by itself.
Rate explicit_rate(const Blocks& blocks, const Method& method, const EngineTable& engines) {
  const Scene& block = method.embeds() ? blocks.embedded : blocks.filled;
  const Parted large = parted(block, method, kCell_m, kStiff_pa, engines),
               small = parted(blocks.small, method, 2 * kCell_m, kStiff_pa, engines);
  const double element_s =
      std::clamp((large.part_s - small.part_s) / (large.elements - small.elements), 0.0, large.part_s / large.elements);
  Rate rate;
  rate.part_ns = 1e9 * (large.part_s - element_s * large.elements);
  rate.element_ns = std::max(1e-3, 1e9 * element_s);
  rate.vertex_ns = 1e9 * large.rest_s / large.vertices;
  rate.held_ns = 1e9 * large.held_s;
  rate.limit = large.limit;
  return rate;
}

// The rate of long steps while the block sags and swings. Costs for each vertex are those of the explicit one.
Rate implicit_rate(Scene block, Rate rate, const Method& method, const EngineTable& engines) {
  block.step_s = 1.0 / 60;
  Specimen implicit(with_model(std::move(block), method, kSoft_pa), engines);
  rate.part_ns = rate.held_ns = 0;
  rate.element_ns =
      std::max(1e-3, 1e9 * implicit.step_s() - rate.vertex_ns * implicit.size().vertices) / implicit.size().elements;
  return rate;
}

Rate surface_rate(Scene scene, const Method& method, const EngineTable& engines) {
  scene.bodies[0].model = method.model;
  Specimen surface(std::move(scene), engines);
  Rate rate;
  rate.element_ns = 1e9 * surface.step_s() / surface.surface_vertices();
  return rate;
}

std::string processor_name() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown";
}

}  // namespace

Calibration measure_calibration(const EngineTable& engines) {
  const double tetrahedra = planning::tetrahedra_for(kBlockVolume_m3, kCell_m);
  const Blocks blocks{filled_block(tetrahedra), filled_block(planning::embedded_for(kBlockVolume_m3, kCell_m)),
                      filled_block(tetrahedra / 8)};
  Calibration c;
  const CutSpeed cuts(engines);
  std::map<std::string, Rate> explicit_of;  // by model
  for (const Method& method : engines.methods()) {
    if (!method.needs_volume()) {
      c.rate[method.name] = surface_rate(surface_block(), method, engines);
      Scene loose = surface_block();
      loose.bodies[0].fixed.reset();
      c.loose_vertex_ns =
          std::max(0.0, surface_rate(std::move(loose), method, engines).element_ns - c.rate[method.name].element_ns);
      c.cut[method.model] = cuts.of(method, c.rate[method.name]);
      continue;
    }
    const auto [known, is_new] = explicit_of.try_emplace(method.model);
    if (is_new) {
      Method with_explicit = method;
      with_explicit.is_implicit = false;
      known->second = explicit_rate(blocks, with_explicit, engines);
    }
    c.rate[method.name] =
        method.is_implicit ? implicit_rate(blocks.filled, known->second, method, engines) : known->second;
    if (!c.cut.contains(method.model)) c.cut[method.model] = cuts.of(method, known->second);
  }
  Specimen surface(surface_block(), standard_engines());
  const double step_s = surface.step_s(), look_s = surface.look_s(), reported_s = reported_step_s(false);
  c.step_ns = 1e9 * std::max(0.0, reported_s - step_s);
  c.touched_vertex_ns = 1e9 * look_s / surface.surface_vertices();
  c.touch_ns = 1e9 * std::max(0.0, reported_step_s(true) - reported_s - look_s);
  return c;
}

std::string to_text(const Calibration& c, const std::string& processor) {
  std::ostringstream out;
  out.precision(6);
  out << kFirstLine << "\n" << processor << "\n";
  out << c.step_ns << " " << c.touch_ns << " " << c.touched_vertex_ns << " " << c.loose_vertex_ns << " " << c.cut.size()
      << "\n";
  for (const auto& [model, r] : c.cut)
    out << model << " " << r.changes_per_edge << " " << r.change_ns << " " << r.deep_ns << " " << r.whole_ns << " "
        << r.cell_ns << " " << r.open_ns << "\n";
  for (const auto& [name, r] : c.rate)
    out << name << " " << r.element_ns << " " << r.vertex_ns << " " << r.limit << " " << r.part_ns << " " << r.held_ns
        << "\n";
  out << kEnd << "\n";
  return out.str();
}

std::optional<Calibration> calibration_from(const std::string& text, const std::string& processor) {
  std::istringstream in(text);
  std::string first, name;
  if (!std::getline(in, first) || first != kFirstLine || !std::getline(in, name) || name != processor)
    return std::nullopt;
  Calibration c;
  const auto good = [](double x) { return std::isfinite(x) && x >= 0 && x < 1e9; };
  std::size_t cuts = 0;
  if (!(in >> c.step_ns >> c.touch_ns >> c.touched_vertex_ns >> c.loose_vertex_ns >> cuts) || !good(c.step_ns) ||
      !good(c.touch_ns) || !good(c.touched_vertex_ns) || !good(c.loose_vertex_ns) || cuts > 100)
    return std::nullopt;
  for (; cuts > 0; --cuts) {
    std::string model;
    in >> model;
    CutRate& r = c.cut[model];
    for (double* x : {&r.changes_per_edge, &r.change_ns, &r.deep_ns, &r.whole_ns, &r.cell_ns, &r.open_ns})
      if (!(in >> *x) || !good(*x)) return std::nullopt;
  }
  std::string method;
  while (in >> method && method != kEnd) {
    Rate& r = c.rate[method];
    for (double* x : {&r.element_ns, &r.vertex_ns, &r.limit, &r.part_ns, &r.held_ns})
      if (!(in >> *x) || !good(*x)) return std::nullopt;
  }
  if (method != kEnd) return std::nullopt;
  return c;
}

Calibration calibration_of_this_machine(const EngineTable& engines, bool anew) {
  const std::string processor = processor_name();
  const std::filesystem::path folder = cache_folder(), file = folder / "calibration.txt";
  if (std::ifstream in(file); in && !anew) {
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    const auto known = calibration_from(text, processor);
    const auto has_rate = [&](const Method& method) { return known->rate.contains(method.name); };
    if (known && std::ranges::all_of(engines.methods(), has_rate)) return *known;
    log_info(file.string() + ": not of this processor, of other models or damaged; measured anew");
  }
  const Calibration measured = measure_calibration(engines);
  const std::string text = to_text(measured, processor);
  if (!folder.empty()) write_to_cache(file, text);
  return calibration_from(text, processor).value_or(measured);  // to as many digits as the next run will read
}

}  // namespace sectio
