// Collision on organs of 10 k, 50 k and 200 k triangles: global queries, the local walk, the update of the tree.
#include <memory>

#include "tests/bench/bench.h"
#include "tests/unit/collision/surfaces.h"

namespace sectio::collision_bench {
namespace {

using namespace collision_test;

// One body of each size for all benchmarks; 8 n^2 triangles.
struct Organ {
  SurfaceBody body;
  SurfaceTree tree;
  explicit Organ(int n) : body(organ(n)), tree(body.view()) {}
};

Organ& organ_of(std::int64_t n) {
  static std::map<std::int64_t, std::unique_ptr<Organ>> organs;
  auto& found = organs[n];
  if (!found) found = std::make_unique<Organ>(static_cast<int>(n));
  return *found;
}

// Upright, the tip some 3 mm deep in the top of the organ, on its way along x.
ToolCorners scalpel_at(const Organ& organ, double x) {
  const auto top = organ.tree.first_hit(organ.body.view(), Vec3(x, 0.003, 0.2), Vec3(x, 0.003, 0));
  const Vec3 tip(x, 0.003, top->point_world_m.z() - 0.003);
  return {{tip, tip + Vec3(0, 0, 0.03), tip + Vec3(0.006, 0, 0.012), tip + Vec3(0.006, 0, 0.03)}};
}

void build(benchmark::State& state) {
  Organ& o = organ_of(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(SurfaceTree(o.body.view()));
  state.SetLabel(std::to_string(o.tree.size()) + " triangles");
}

void global_first_hit(benchmark::State& state) {
  Organ& o = organ_of(state.range(0));
  Random random(1);
  std::vector<std::pair<Vec3, Vec3>> segments;
  for (int k = 0; k < 1024; ++k) {
    const Vec3 out = 0.06 * uniform_vec(random, -1, 1).normalized();
    segments.emplace_back(out, 0.5 * out + uniform_vec(random, -0.01, 0.01));
  }
  std::size_t k = 0;
  for (auto _ : state) {
    const auto& [p, q] = segments[k++ % segments.size()];
    benchmark::DoNotOptimize(o.tree.first_hit(o.body.view(), p, q));
  }
}

void global_swept_segment(benchmark::State& state) {
  Organ& o = organ_of(state.range(0));
  std::vector<ToolCorners> tools;
  for (int k = 0; k < 256; ++k) tools.push_back(scalpel_at(o, -0.02 + 0.00015 * k));
  std::size_t k = 0;
  for (auto _ : state) {
    const auto &from = tools[k % 255].at_world_m, &to = tools[k % 255 + 1].at_world_m;
    benchmark::DoNotOptimize(o.tree.swept(o.body.view(), {from[0], from[2], to[0], to[2]}));
    ++k;
  }
}

// All facts about the instrument, steps of 0.15 mm.
void follow_instrument(benchmark::State& state) {
  Organ& o = organ_of(state.range(0));
  std::vector<ToolCorners> tools;
  for (int k = 0; k < 256; ++k) tools.push_back(scalpel_at(o, -0.02 + 0.00015 * k));
  FrontTracker tracker;
  std::size_t k = 0;
  for (auto _ : state) {
    if (k % 255 == 0) tracker.reset();
    benchmark::DoNotOptimize(tracker.follow(o.body.view(), o.tree, {tools[k % 255], tools[k % 255 + 1]}));
    ++k;
  }
  state.counters["local"] = static_cast<double>(tracker.counters().local_searches) / static_cast<double>(k);
}

void far_instrument(benchmark::State& state) {
  Organ& o = organ_of(state.range(0));
  FrontTracker tracker;
  ToolCorners tool = scalpel_at(o, 0);
  for (Vec3& corner : tool.at_world_m) corner.x() += 0.2;
  for (auto _ : state) benchmark::DoNotOptimize(tracker.follow(o.body.view(), o.tree, {tool, tool}));
}

void update_1000_changed(benchmark::State& state) {
  Organ& o = organ_of(state.range(0));
  std::vector<TriangleId> changed(1000);
  TriangleId next = 0;
  for (auto _ : state) {
    for (TriangleId& t : changed) t = next++ % o.body.mesh.triangle_slots();
    o.tree.update_changed(o.body.view(), changed);
  }
}

// A cut changes some 20 triangles in one step, beside each other.
void update_20_changed(benchmark::State& state) {
  Organ& o = organ_of(state.range(0));
  std::vector<TriangleId> changed(20);
  TriangleId next = 0;
  for (auto _ : state) {
    for (TriangleId& t : changed) t = next++ % o.body.mesh.triangle_slots();
    o.tree.update_changed(o.body.view(), changed);
  }
}

void scan_of_still_vertices(benchmark::State& state) {
  Organ& o = organ_of(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(o.tree.update_moved(o.body.view()));
}

// The whole body goes 1 mm sideways: every box changes.
void refit_of_moved_body(benchmark::State& state) {
  Organ& o = organ_of(state.range(0));
  float shift = 0.001f;
  for (auto _ : state) {
    state.PauseTiming();
    for (Vec3f& x : o.body.x) x.x() += shift;
    shift = -shift;
    state.ResumeTiming();
    o.tree.update_moved(o.body.view());
  }
  if (shift < 0)
    for (Vec3f& x : o.body.x) x.x() += shift;
  o.tree.update_moved(o.body.view());
}

void sizes(benchmark::internal::Benchmark* b) {
  b->Arg(35)->Arg(79)->Arg(158)->Unit(benchmark::kMicrosecond);
}

const bench::Subject subject("collision", [](int argc, char** argv) {
  benchmark::RegisterBenchmark("build", build)->Apply(sizes);
  benchmark::RegisterBenchmark("global_first_hit", global_first_hit)->Apply(sizes);
  benchmark::RegisterBenchmark("global_swept_segment", global_swept_segment)->Apply(sizes);
  benchmark::RegisterBenchmark("follow_instrument", follow_instrument)->Apply(sizes);
  benchmark::RegisterBenchmark("far_instrument", far_instrument)->Apply(sizes);
  benchmark::RegisterBenchmark("update_20_changed", update_20_changed)->Apply(sizes);
  benchmark::RegisterBenchmark("update_1000_changed", update_1000_changed)->Apply(sizes);
  benchmark::RegisterBenchmark("scan_of_still_vertices", scan_of_still_vertices)->Apply(sizes);
  benchmark::RegisterBenchmark("refit_of_moved_body", refit_of_moved_body)->Apply(sizes);
  return bench::run(argc, argv);
});

}  // namespace
}  // namespace sectio::collision_bench
