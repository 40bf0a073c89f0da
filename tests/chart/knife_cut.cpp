#include "tests/chart/knife_cut.h"

#include <map>

#include "common/core/error.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/meshing/fill.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/step/step.h"
#include "sim_server/volume/volume_cutting.h"
#include "tests/support/shapes.h"

namespace sectio::chart {
namespace {

constexpr double kBeside_m = 0.015, kSpeed_m_per_s = 0.05, kRests_s = 0.3;

Scene lying(const ChartScene& s, double tetrahedra) {
  Scene scene;
  scene.file = s.name;
  scene.gravity_m_per_s2.setZero();
  scene.sleep.after_s = 0;
  BodySpec body;
  body.name = "bar";
  body.model = "neo_hookean";
  body.mesh = test::box(4, 4, 4, s.size_m);
  body.volume.tetrahedra = tetrahedra;
  body.material.young_pa = s.young_pa;
  body.material.poisson = s.poisson;
  body.material.density_kg_per_m3 = s.density_kg_per_m3;
  body.material.damping_per_s = 60;
  body.cutting.threshold_force_n = 0.04;
  body.fixed = Box{Vec3(-1, -1, -1), Vec3(1, 1, 1e-6)};
  scene.bodies.push_back(std::move(body));
  ToolSpec knife;
  knife.name = knife.kind = "knife";
  knife.geometry.a_tool_m = Vec3(0, 0, 0);
  knife.geometry.b_tool_m = Vec3(0, 0, 0.05);
  knife.geometry.c_tool_m = Vec3(0.002, 0, 0.03);
  knife.geometry.d_tool_m = Vec3(0.002, 0, 0.05);
  knife.geometry.sharp_length_m = 0.03;
  scene.tools.push_back(std::move(knife));
  return scene;
}

// The stages of Simulation::step() that a cut needs.
void step(SimulatedWorld& world, StepOutput& output, const StepInput& input) {
  begin_step(output, world.scene.step_s);
  StepContext context(input, output, world.bodies.size(), nullptr);
  for (const auto stage : {take_samples, touch, cut, tidy, split, indent, deform, guard}) stage(world, context);
}

TetMesh in_use(const TetMesh& mesh) {
  TetMesh out;
  std::vector<VertexId> number(mesh.vertices_body_m.size(), kNone);
  for (const Tetrahedron& t : mesh.tetrahedra) {
    if (t[0] == kNone) continue;
    out.tetrahedra.emplace_back();
    for (std::size_t k = 0; k < 4; ++k) {
      VertexId& v = number[t[k]];
      if (v == kNone) {
        v = static_cast<VertexId>(out.vertices_body_m.size());
        out.vertices_body_m.push_back(mesh.vertices_body_m[t[k]]);
      }
      out.tetrahedra.back()[k] = v;
    }
  }
  return out;
}

}  // namespace

TetMesh cut_by_knife(const ChartScene& s, double tetrahedra) {
  const Scene scene = prepared(lying(s, tetrahedra));
  SimulatedWorld world(scene, standard_engines());
  StepOutput output;
  const double way_m = s.size_m.y() + 2 * kBeside_m, end_s = way_m / kSpeed_m_per_s + kRests_s;
  for (std::uint64_t n = 1; static_cast<double>(n) * scene.step_s < end_s; ++n) {
    const double t_s = static_cast<double>(n) * scene.step_s;
    Pose pose;
    pose.orientation = Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ());
    pose.position_m = Vec3(s.slit->at_x_m, std::min(way_m, t_s * kSpeed_m_per_s) - kBeside_m, s.slit->from_z_m);
    StepInput input;
    input.samples = {{0, n, t_s, pose, 0}};
    step(world, output, input);
  }
  if (world.bodies.size() != 1) throw InputError("the knife has cut the bar of scene " + s.name + " in two");
  return in_use(dynamic_cast<const VolumeCutting&>(*world.bodies[0]->engines.cutting).volume().mesh());
}

const TetMesh& mesh_of(const ChartScene& s, double tetrahedra) {
  static std::map<std::pair<std::string, double>, TetMesh> known;
  const auto [at, is_new] = known.try_emplace({s.name, tetrahedra});
  if (!is_new) return at->second;
  if (s.cut_by_knife) return at->second = cut_by_knife(s, tetrahedra);
  FillSettings settings;
  settings.tetrahedra = tetrahedra;
  settings.material = {s.young_pa, s.poisson, s.density_kg_per_m3};
  return at->second = fill(test::box(4, 4, 4, s.size_m), settings).mesh;
}

}  // namespace sectio::chart
