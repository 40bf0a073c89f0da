// A step's cut in a body that is a volume, everything included but the deformation: the blade's way, the plan, the
// surface's delta, the model's rows, the collision tree. One notch of the same size in blocks of a thousand to a
// million tetrahedra of one size; time for each tetrahedron that is cut. The last lines give the growth.
#include <cstdio>
#include <map>
#include <string>

#include "common/core/processor_time.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/volume/volume_cutting.h"
#include "sim_server/world/body.h"
#include "tests/bench/bench.h"
#include "tests/support/tet_shapes.h"

namespace sectio::volume_cut_bench {
namespace {

constexpr double kCell = 0.005;

// A block of cubes, and a blade that goes into it from one side, five cubes deep, a step at a time.
class Notch {
 public:
  Notch(int cubes, const std::string& model) : size_m_(cubes * kCell) {
    scene_.file = "block";
    spec_.name = "block";
    spec_.model = model;
    spec_.volume.least_part_s = 1e-3;
    const TetMesh mesh = test::tet_box(cubes, cubes, cubes, Vec3::Constant(size_m_));
    const TetSurface surface = surface_of(mesh);
    std::vector<VertexId> number(mesh.vertices_body_m.size(), kNone);
    for (const VertexId v : surface.of_volume) take(mesh, v, number);
    for (VertexId v = 0; v < number.size(); ++v) take(mesh, v, number);
    for (Tetrahedron t : mesh.tetrahedra) {
      for (VertexId& v : t) v = number[v];
      spec_.tets.tetrahedra.push_back(t);
    }
    spec_.mesh = surface.soup;
    scene_.gravity_m_per_s2.setZero();
    body_ = std::make_unique<Body>(spec_, scene_, 0, standard_engines().model(model).make);
    const Vec3 at(0.5 * size_m_ + 0.3 * kCell, 0, 0.5 * size_m_ + 0.37 * kCell);
    double closest = 1;
    for (TriangleId t = 0; t < body_->mesh.triangle_slots(); ++t)
      if (const double m = (body_->mesh.rest_body_m(body_->mesh.triangle(t).v[0]) - at).norm(); m < closest)
        closest = m, entry_ = t;
  }

  // Seconds; `cut`: tetrahedra in front of the blade that are gone or divided.
  double cut(std::size_t& tetrahedra) {
    double seconds = 0;
    const auto& volume = dynamic_cast<const VolumeCutting&>(*body_->engines.cutting).volume();
    const std::size_t before = volume.tetrahedra().size();
    for (double y_m = -0.5 * kCell; y_m < 5 * kCell; y_m += 0.5 * kCell) {
      const double start_s = processor_time_s();
      const CutPlan plan = plan_to(y_m);
      const bool accepted = body_->apply(cut_as_planned(plan)).has_value();
      if (accepted && !plan.delta.empty()) seconds += processor_time_s() - start_s;
    }
    tetrahedra = (volume.tetrahedra().size() - before) / 4;  // one that is cut becomes four or six: five
    return seconds;
  }

 private:
  void take(const TetMesh& mesh, VertexId v, std::vector<VertexId>& number) {
    if (number[v] != kNone) return;
    number[v] = static_cast<VertexId>(spec_.tets.vertices_body_m.size());
    spec_.tets.vertices_body_m.push_back(mesh.vertices_body_m[v]);
  }
  // Five cubes long, in the middle of the side y = 0.
  CutPlan plan_to(double y_m) {
    const Vec3 tip(0.5 * size_m_ + 0.3 * kCell, y_m, 0.5 * size_m_ - 2.13 * kCell);
    BladeMotion motion{7, {Blade{tip, Vec3(0.05, 0, 1).normalized()}}};
    motion.path[0].length_m = 5 * kCell;
    std::vector<Entry> entries;
    if (!begun_) entries.push_back({7, entry_, Vec3::Constant(1.0 / 3)});
    begun_ = true;
    return body_->engines.cutting->plan(body_->shared(), entries, std::array{motion});
  }

  double size_m_;
  Scene scene_;
  BodySpec spec_;
  std::unique_ptr<Body> body_;
  TriangleId entry_ = 0;
  bool begun_ = false;
};

std::map<std::string, double> us_per_cut;

void notch(benchmark::State& state, const std::string& model) {
  std::size_t tetrahedra = 0;
  double least_s = 1;
  for (auto _ : state) {
    Notch fresh(static_cast<int>(state.range(0)), model);
    const double seconds = fresh.cut(tetrahedra);
    least_s = std::min(least_s, seconds);
    state.SetIterationTime(seconds);
  }
  state.counters["cut"] = static_cast<double>(tetrahedra);
  us_per_cut[model + "/" + std::to_string(state.range(0))] = 1e6 * least_s / static_cast<double>(tetrahedra);
}

void print_ratios(const bench::BestTimes&) {
  for (const auto& [name, us] : us_per_cut)
    std::fprintf(stderr, "%s: %.2f us for each tetrahedron cut\n", name.c_str(), us);
  for (const auto& [small, large] : {std::pair<const char*, const char*>{"neo_hookean/6", "neo_hookean/58"},
                                     {"tetra_springs/6", "tetra_springs/32"}})
    if (us_per_cut.contains(small) && us_per_cut.contains(large))
      std::fprintf(stderr, "%s against %s: %.2f times as long\n", large, small, us_per_cut[large] / us_per_cut[small]);
}

const bench::Subject subject("volume_cut", [](int argc, char** argv) {
  benchmark::RegisterBenchmark("notch/neo_hookean", notch, "neo_hookean")
      ->Arg(6)
      ->Arg(12)
      ->Arg(32)
      ->Arg(58)
      ->UseManualTime()
      ->Iterations(5);
  benchmark::RegisterBenchmark("notch/tetra_springs", notch, "tetra_springs")
      ->Arg(6)
      ->Arg(12)
      ->Arg(32)
      ->UseManualTime()
      ->Iterations(5);
  return bench::run(argc, argv, print_ratios);
});

}  // namespace
}  // namespace sectio::volume_cut_bench
