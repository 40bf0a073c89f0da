#include "sim_server/planning/plan.h"

#include <algorithm>
#include <cmath>

#include "common/math/lame.h"
#include "sim_server/planning/resolution.h"

namespace sectio::planning {
namespace {

constexpr double kLongStep_s = 0.004;  // the implicit integrator's steps are long; shorter ones cost more than parts
constexpr int kMostSubsteps = 1000;    // in a step
constexpr double kThinnest = 1.5;      // fewest cells across a body of hexahedra
constexpr double kFewestTetrahedra = 200;  // fewer don't represent a body's shape
constexpr double kMostElements = 400000;
constexpr double kBesideFaces = 1.5;  // factor of the number of cells for partly empty ones at the border
const std::vector<double> kAcross = {1.5, 2, 3, 4, 5, 6, 8, 10, 12, 16};

// The modulus of a method's fastest wave: E for springs, lambda + 2 mu for tetrahedra, lambda + 2 mu / 3 for hexahedra.
double modulus_pa(const Method& method, const ElasticMaterial& material) {
  const auto [mu, lambda] = lame(material.young_pa, material.poisson);
  if (method.is_of_springs) return material.young_pa;
  return method.embeds() ? lambda + 2 * mu / 3 : lambda + 2 * mu;
}

// Nothing if there is no law for the load. To a surface a shallow cut is a dent that is as wide as deep.
std::optional<double> error_of(BodyLoad load, const BodyShape& shape, const Method& method, double cell_m) {
  const Vec3 cells = shape.size_m / cell_m;
  load.what.fills_cells = (cells.array() - cells.array().round()).abs().maxCoeff() < kOnCells;
  load.what.sharp_edges = shape.sharp_edges;
  if (method.needs_volume() || load.what.load != Load::opening || load.depth_of_tissue > kShallow)
    return relative_error(load.what, method, cell_m);
  LoadCase dent = load.what;
  dent.load = Load::indentation;
  dent.width_m *= 2;
  return relative_error(dent, method, cell_m);
}

class Planner {
 public:
  Planner(const PlanInput& input, const Calibration& calibration) : in_(input), calibration_(calibration) {}

  BodyPlan run(const std::function<Built(const Candidate&)>& build) {
    for (const Method& method : in_.methods) consider(method);
    for (std::size_t at = best(all_); !all_.empty(); at = best(all_)) {
      if (build && !all_[at].built) {
        take(build(all_[at]), all_[at]);
        continue;
      }
      plan_.chosen = all_[at];
      plan_.fits = worst_ratio(plan_.chosen) <= 1 && plan_.chosen.unfit.empty();
      break;
    }
    for (const Method& method : in_.methods) {
      std::vector<Candidate> own;
      for (const Candidate& c : all_)
        if (c.method == &method) own.push_back(c);
      if (!own.empty()) plan_.considered.push_back(own[best(own)]);
    }
    return std::move(plan_);
  }

 private:
  double worst_ratio(const Candidate& c) const {
    return std::max(c.error / in_.budgets.error, c.most_cpu() / in_.budgets.cpu);
  }
  // A surface if it fits, as it needs no mesh of the inside and a cut changes triangles only; else the cheapest
  // candidate that fits, else the nearest.
  std::size_t best(const std::vector<Candidate>& of) const {
    std::size_t best = 0;
    for (std::size_t i = 1; i < of.size(); ++i) {
      const bool is_fit = of[i].unfit.empty(), best_is_fit = of[best].unfit.empty();
      const bool fits = worst_ratio(of[i]) <= 1, best_fits = worst_ratio(of[best]) <= 1;
      const bool is_surface = !of[i].method->needs_volume();
      const bool better = is_fit != best_is_fit                      ? is_fit
                          : fits != best_fits                        ? fits
                          : fits && is_surface                       ? true
                          : fits && !of[best].method->needs_volume() ? false
                          : !fits                                    ? worst_ratio(of[i]) < worst_ratio(of[best])
                                                                     : of[i].most_cpu() < of[best].most_cpu();
      if (better) best = i;
    }
    return best;
  }

  void rule_out(const Method& method, std::string why) {
    if (std::ranges::none_of(plan_.ruled_out, [&](const auto& r) { return r.first == &method; }))
      plan_.ruled_out.emplace_back(&method, std::move(why));
  }

  // The reason that rules out a method at any resolution; empty if there is none.
  std::string why_not(const Method& method) const {
    const bool surface = !method.needs_volume();
    if (const std::string& why = surface ? in_.no_surface : in_.no_volume; !why.empty()) return why;
    if (surface && in_.step_s > method.most_parts * in_.surface_limit_s)
      return "the step needs more parts than it can be divided into";
    if (method.is_implicit && in_.step_s < kLongStep_s) return "it is for steps of 4 ms and more";
    for (const BodyLoad& l : in_.loads) {
      if (surface && l.what.load == Load::opening && l.depth_of_tissue > kShallow)
        return l.from + (l.depth_of_tissue > 0.95 ? " goes through" : " cuts deeper than 0.3 of the thickness");
      if (!error_of(l, in_.shape, method, 1))
        return std::string("no error law for ") + to_string(l.what.load) + " (" + l.from + ")";
      if (method.is_implicit && !l.is_weight) return "its steps are too long for a hand";
    }
    return {};
  }

  void consider(const Method& method) {
    if (std::string why = why_not(method); !why.empty()) {
      rule_out(method, std::move(why));
      return;
    }
    Candidate c;
    c.method = &method;
    c.step_s = in_.step_s;
    if (!method.needs_volume()) {
      c.cell_m = in_.shape.edge_m;
      c.elements = c.vertices = static_cast<double>(in_.shape.vertices);
      c.substeps = static_cast<int>(std::ceil(in_.step_s / in_.surface_limit_s));
      add(c);
      return;
    }
    if (!method.embeds() && in_.given_tetrahedra > 0) {
      c.cell_m = cube_for(in_.shape.volume_m3, in_.given_tetrahedra);
      divide(c);
      return;
    }
    // Cells on a box's faces divide its smallest side, others divide the thickness.
    const bool is_on_faces = method.elements == Elements::cells_on_faces;
    const double across_m = is_on_faces ? in_.shape.size_m.minCoeff() : in_.shape.thickness_m;
    bool any = false;
    for (const double n : kAcross) {
      c.cell_m = across_m / n;
      if (method.embeds() && in_.shape.thickness_m < kThinnest * c.cell_m) continue;
      if (method.embeds() && lies_on_cells(in_.shape, c.cell_m) != is_on_faces) continue;
      any |= divide(c);
    }
    if (!any)
      rule_out(method, is_on_faces       ? "no box: its faces don't lie on faces of cells"
                       : method.embeds() ? "its faces lie on faces of cells"
                                         : "too many elements");
  }

  // Adds the candidate with the number of elements that cells of this size give; false if it is out of range.
  bool divide(Candidate c) {
    const double volume = in_.shape.volume_m3;
    const bool embeds = c.method->embeds();
    c.tetrahedra = in_.given_tetrahedra > 0 ? in_.given_tetrahedra
                   : embeds                 ? embedded_for(volume, c.cell_m)
                                            : tetrahedra_for(volume, c.cell_m);
    c.elements = c.tetrahedra;
    if (embeds)
      c.elements =
          volume / std::pow(c.cell_m, 3) * (c.method->elements == Elements::cells_beside_faces ? kBesideFaces : 1);
    c.vertices = c.tetrahedra / 4.5;
    const Rate& rate = calibration_.rate.at(c.method->name);
    const double speed = std::sqrt(modulus_pa(*c.method, in_.material) / in_.material.density_kg_per_m3);
    c.substeps = c.method->is_implicit
                     ? 1
                     : static_cast<int>(std::min(1e6, std::ceil(c.step_s * speed / (rate.limit * c.cell_m))));
    if ((in_.given_tetrahedra == 0 && c.tetrahedra < kFewestTetrahedra) || c.tetrahedra > kMostElements ||
        c.elements > kMostElements || c.substeps > kMostSubsteps)
      return false;
    add(c);
    return true;
  }

  void take(const Built& built, Candidate& c) {
    c.built = true;
    c.weighed = built.weighed;
    c.unfit = built.unfit;
    for (Candidate& other : all_)
      if (c.weighed && other.method == c.method) set_error(other);
    c.elements = built.elements;
    c.vertices = built.vertices;
    c.substeps = c.method->is_implicit ? 1 : built.substeps;
    set_cost(c, built.surface_vertices);
  }

  void set_cost(Candidate& c, double surface_vertices) const {
    const Rate& rate = calibration_.rate.at(c.method->name);
    const bool is_loose = !c.method->needs_volume() && !in_.is_held;
    const double part_ns =
        rate.part_ns + rate.element_ns * c.elements + rate.held_ns * in_.gripped_share * surface_vertices;
    const double per_step_ns =
        calibration_.step_ns + part_ns * c.substeps + rate.vertex_ns * c.vertices +
        (is_loose ? calibration_.loose_vertex_ns * c.vertices : 0) +
        (in_.has_tools ? calibration_.touch_ns + calibration_.touched_vertex_ns * surface_vertices : 0);
    c.cpu = 1e-9 * per_step_ns / c.step_s;
    set_cost_of_cuts(c);
  }

  // The blade that costs most, with the cuts of all.
  void set_cost_of_cuts(Candidate& c) const {
    const auto known = calibration_.cut.find(c.method->model);
    if (in_.strokes.empty() || known == calibration_.cut.end()) return;
    const CutRate& rate = known->second;
    const double tetrahedra = c.method->needs_volume() ? c.tetrahedra : 0;
    const double edge_m = tetrahedra > 0 ? cube_for(in_.shape.volume_m3, tetrahedra) : c.cell_m;
    double squares = 0;
    for (const Stroke& stroke : in_.strokes) squares += stroke.area_m2 / (edge_m * edge_m);
    const bool is_cut_itself = c.method->elements == Elements::tetrahedra;
    const double more = is_cut_itself ? kMorePerSquare * squares : 0;
    c.elements_after_cut = c.elements + more;
    const double grown_ns =
        calibration_.rate.at(c.method->name).element_ns * more * c.substeps + rate.open_ns * squares;
    const double open_s = c.step_s * c.cpu + 1e-9 * grown_ns;
    c.cut_cpu = c.cut_step_s = 0;
    for (const Stroke& stroke : in_.strokes) {
      const double steps = std::max(1.0, stroke.time_s / c.step_s);
      const double changes = std::min(steps, rate.changes_per_edge * stroke.way_m / edge_m);
      const double change_s =
          1e-9 * (rate.change_ns + rate.deep_ns * stroke.depth_m() / edge_m + rate.whole_ns * tetrahedra +
                  (c.method->embeds() ? rate.cell_ns * c.elements : 0));
      c.cut_cpu = std::max(c.cut_cpu, (open_s + changes / steps * change_s) / c.step_s);
      c.cut_step_s = std::max(c.cut_step_s, open_s + change_s);
    }
  }

  double error_under(const BodyLoad& load, const Candidate& c) const {
    if (load.is_weight && c.weighed) return *c.weighed;
    const Candidate* nearest = nullptr;
    const auto ratio = [&](const Candidate& other) { return std::abs(std::log(other.cell_m / c.cell_m)); };
    for (const Candidate& other : all_)
      if (other.method == c.method && other.weighed && (!nearest || ratio(other) < ratio(*nearest))) nearest = &other;
    if (!load.is_weight || !nearest) return *error_of(load, in_.shape, *c.method, c.cell_m);
    return *nearest->weighed * finer(*c.method, nearest->cell_m, c.cell_m);
  }
  void set_error(Candidate& c) const {
    c.error = 0;
    for (const BodyLoad& l : in_.loads)
      if (const double e = error_under(l, c); e > c.error) {
        c.error = e;
        c.worst = l.what.load;
      }
  }

  void add(Candidate c) {
    set_error(c);
    // The surface of a volume has a number of vertices proportional to the power 2/3.
    const double shell = std::min(c.vertices, 6 * std::pow(c.vertices, 2.0 / 3));
    set_cost(c, c.method->needs_volume() ? shell : c.vertices);
    all_.push_back(c);
  }

  const PlanInput& in_;
  const Calibration& calibration_;
  std::vector<Candidate> all_;
  BodyPlan plan_;
};

}  // namespace

BodyPlan plan(const PlanInput& input, const Calibration& calibration,
              const std::function<Built(const Candidate&)>& build) {
  return Planner(input, calibration).run(build);
}

}  // namespace sectio::planning
