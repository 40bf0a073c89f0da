// Bodies of boxes under one load each, as a scene with model: auto and as a specimen of the chart: what the planner
// takes for the scene is what the specimen is made of, and the chart's references know the truth.
#pragma once

#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/deformation/tetra/tet_solid.h"
#include "sim_server/deformation/tetra/tet_springs.h"
#include "sim_server/engine/standard_engines.h"
#include "sim_server/meshing/fill.h"
#include "sim_server/planning/error_law.h"
#include "sim_server/prepare/choose_model.h"
#include "tests/chart/surface_specimen.h"
#include "tests/chart/tet_specimen.h"
#include "tests/support/shapes.h"

namespace sectio::test {

struct PlannedCase {
  std::string name;
  planning::Load load = planning::Load::bending;
  Vec3 size_m = Vec3(0.1, 0.025, 0.025);
  std::array<int, 3> bricks{4, 1, 1};  // bricks of the reference, across: times 1, 2, 3
  double young_pa = 30000, poisson = 0.45;
  double error_budget = 0.1;
  double ball_m = 0.01, depth_m = 0.002;  // radius of the ball of an indentation; depth of that, or of a cut
  int squares = 4;                        // on the surface, along each side
};

inline ToolSpec tool(const std::string& kind) {
  ToolSpec t;
  t.name = t.kind = kind;
  t.geometry = instrument_of(kind).geometry;
  return t;
}

inline Scene scene_of(const PlannedCase& c) {
  Scene scene;
  scene.file = c.name;
  scene.sleep.after_s = 0;
  scene.gravity_m_per_s2 =
      Vec3(0, 0, c.load == planning::Load::bending || c.load == planning::Load::hanging ? -9.81 : 0);
  BodySpec body;
  body.name = c.name;
  body.model = "auto";
  body.mesh = box(c.squares, c.squares, c.squares, c.size_m);
  body.material.young_pa = c.young_pa;
  body.material.poisson = c.poisson;
  body.material.density_kg_per_m3 = 1050;
  body.material.foundation_radius_m = std::sqrt(c.ball_m * c.depth_m);
  body.plan.error_budget = c.error_budget;
  body.plan.cpu_budget = 4;
  const double far = 1;
  body.fixed = Box{Vec3::Constant(-far), Vec3(1e-6, far, far)};
  if (c.load == planning::Load::hanging) body.fixed = Box{Vec3(-far, -far, c.size_m.z() - 1e-6), Vec3::Constant(far)};
  if (c.load == planning::Load::indentation) body.fixed = Box{Vec3::Constant(-far), Vec3(far, far, 1e-6)};
  const auto add = [&](ToolSpec t, const std::vector<TracePoint>& trace) {
    t.trace = trace;
    scene.tools.push_back(std::move(t));
  };
  const auto turned = [](double rad) { return Eigen::Quaterniond(Eigen::AngleAxisd(rad, Vec3::UnitX())); };
  const Vec3 top(c.size_m.x() / 2, c.size_m.y() / 2, c.size_m.z());
  switch (c.load) {
    case planning::Load::bending:
      break;
    case planning::Load::hanging:
      break;
    case planning::Load::twisting: {
      ToolSpec t = tool("forceps");
      t.grip_radius_m = 0.6 * std::max(c.size_m.y(), c.size_m.z());
      const Vec3 end(c.size_m.x(), c.size_m.y() / 2, c.size_m.z() / 2);
      const Eigen::Quaterniond along(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitY()));  // the shaft goes on from the bar
      const auto held = [&](double rad) { return Pose{end, turned(rad) * along}; };
      add(t, {{0, held(0), 0.3}, {0.1, held(0), 0}, {1, held(M_PI / 4), 0}});
      break;
    }
    case planning::Load::indentation: {
      ToolSpec t = tool("probe");
      t.geometry.sphere_radius_m = c.ball_m;
      const Vec3 touches = top + Vec3(0, 0, c.ball_m);
      add(t, {{0, {touches, turned(0)}, 0}, {1, {touches - Vec3(0, 0, c.depth_m), turned(0)}, 0}});
      break;
    }
    case planning::Load::opening:
      add(tool("scalpel"), {{0, {top, turned(0)}, 0}, {1, {top - Vec3(0, 0, c.depth_m), turned(0)}, 0}});
      break;
  }
  scene.bodies.push_back(std::move(body));
  return scene;
}

inline chart::ChartScene chart_scene_of(const PlannedCase& c) {
  constexpr double kNear = 1e-7;
  chart::ChartScene s;
  const Vec3 size = c.size_m;
  s.name = c.name;
  s.size_m = size;
  s.young_pa = c.young_pa;
  s.poisson = c.poisson;
  s.cells_per_across = c.bricks;
  s.reference_across = 3;
  s.damping_per_s = 60;
  s.load_s = 0.1;
  s.duration_s = 0.5;
  s.held = [=](const Vec3& p) { return p.x() < kNear || p.x() > size.x() - kNear; };
  switch (c.load) {
    case planning::Load::hanging:
    case planning::Load::bending:
      s.held = [=](const Vec3& p) { return p.x() < kNear; };
      s.gravity_m_per_s2 = 9.81;
      s.damping_per_s = 25;
      s.duration_s = 1;
      s.load_s = 1e-9;
      for (int i = 1; i <= 8; ++i) s.probes.push_back({{size.x() * i / 8, size.y() / 2, size.z() / 2}});
      if (c.load == planning::Load::bending) break;
      s.held = [=](const Vec3& p) { return p.z() > size.z() - kNear; };
      s.probes.clear();
      for (int i = 0; i < 8; ++i) s.probes.push_back({{size.x() / 2, size.y() / 2, size.z() * i / 8}});
      break;
    case planning::Load::twisting:
      s.held_at = [=](const Vec3& p, double share) -> Vec3 {
        if (p.x() < size.x() / 2) return p;
        const Vec3 axis(p.x(), size.y() / 2, size.z() / 2);
        return axis + Eigen::AngleAxisd(share * M_PI / 4, Vec3::UnitX()) * (p - axis);
      };
      s.asks_torque = true;
      break;
    case planning::Load::indentation:
      s.held = [=](const Vec3& p) { return p.z() < kNear; };
      s.ball = chart::Ball{c.ball_m, c.depth_m, Vec3::Zero()};
      s.asks_force = true;
      s.duration_s = 0.3;
      break;
    case planning::Load::opening:
      s.held_at = [=](const Vec3& p, double share) -> Vec3 {
        return {p.x() + (p.x() > size.x() / 2 ? share * 0.05 * size.x() : 0), p.y(), p.z()};
      };
      s.slit = Slit{size.x() / 2, size.z() - c.depth_m};
      for (const double z : {0.0, 0.25, 0.5})
        s.probes.push_back({{size.x() / 2, size.y() / 2, size.z() - z * c.depth_m}, true});
      break;
  }
  return s;
}

// The body that was taken, in the hands of the chart.
inline std::unique_ptr<chart::Specimen> specimen_of(const chart::ChartScene& s, const BodySpec& body,
                                                    const PlannedCase& c, double step_s) {
  if (body.model == "surface_springs") return chart::surface_specimen(s, c.squares, step_s);
  FillSettings settings;
  settings.tetrahedra = body.volume.tetrahedra;
  settings.material = {c.young_pa, c.poisson, 1050};
  const TetMesh mesh = fill(body.mesh, settings).mesh;
  const auto driver = body.volume.driver == "implicit" ? VolumeIntegrator::implicit_only : VolumeIntegrator::automatic;
  return chart::tet_specimen(
      s, mesh, step_s, [&](const TetMesh& m, const VolumeMaterial& t, const VolumeSettings& v) -> chart::ChartModel {
        if (body.model == "tetra_springs") return chart::with_forces(std::make_unique<TetSprings>(m, t, v));
        if (body.model == "neo_hookean") return chart::with_forces(std::make_unique<TetSolid>(m, t, v, driver));
        auto solid = std::make_unique<HexSolid>(m, grid_around(m, body.volume.cell_m), t, v);
        const std::size_t cells = solid->lattice().cells.size();
        return {std::move(solid), nullptr, true, cells};
      });
}

// At rest, the mean of the last tenth.
inline std::vector<double> answer_at_rest(chart::Specimen& specimen, const chart::ChartScene& s) {
  const int steps = static_cast<int>(std::lround(s.duration_s / specimen.step_s()));
  std::vector<double> sum;
  int answers = 0;
  for (int i = 1; i <= steps; ++i) {
    specimen.step(i * specimen.step_s());
    if (i <= 0.9 * steps || i % 5 != 0) continue;
    const std::vector<double> now = specimen.answer();
    sum.resize(now.size(), 0);
    for (std::size_t k = 0; k < now.size(); ++k) sum[k] += now[k];
    ++answers;
  }
  for (double& a : sum) a /= answers;
  return sum;
}

}  // namespace sectio::test
