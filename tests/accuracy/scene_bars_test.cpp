// Bars through the front door: a scene file and a mesh file, aligned with the lattices or turned and shifted against
// them, that sag under their weight. The bar: 0.2 x 0.05 x 0.05 m, 100 kPa, Poisson's ratio 0.4; its end sinks by
// 0.0857 m (quadratic bricks, extrapolated; large displacements).
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "common/core/formatted.h"
#include "common/mesh/check.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/simulation.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"

namespace sectio::test {
namespace {

constexpr double kSag_m = 0.0857;
const Vec3 kBar_m(0.2, 0.05, 0.05);

// The mesh is turned in its file, and the pose turns it back: the bar is level in the world, and beside the lattice,
// which has the axes of the mesh.
struct Turned {
  Eigen::Quaterniond by = Eigen::Quaterniond::Identity();
  Vec3 shift_m = Vec3::Zero();
};
Turned at_random(unsigned seed, double cell_m) {
  test::Random random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-cell_m, cell_m);
  Turned turned;
  turned.by = Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
  turned.shift_m = Vec3(uniform(random), uniform(random), uniform(random));
  return turned;
}

std::filesystem::path scene_of(const std::string& model, const std::string& volume, const Turned& turned) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("bar_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  std::ofstream mesh(folder / "bar.obj");
  mesh.precision(9);
  const TriangleSoup bar = box(16, 4, 4, kBar_m);
  for (const Vec3& p : bar.vertices_body_m) mesh << "v " << (turned.by * p + turned.shift_m).transpose() << "\n";
  for (const auto& t : bar.triangles) mesh << "f " << t[0] + 1 << " " << t[1] + 1 << " " << t[2] + 1 << "\n";
  const Eigen::Matrix3d back = turned.by.inverse().toRotationMatrix();
  const Vec3 place_m = -(back * turned.shift_m);
  const Vec3 angles_deg =
      180 / M_PI * Vec3(std::atan2(back(2, 1), back(2, 2)), std::asin(-back(2, 0)), std::atan2(back(1, 0), back(0, 0)));
  const auto list = [](const Vec3& v) { return formatted("[%.9f, %.9f, %.9f]", v.x(), v.y(), v.z()); };
  std::ofstream scene(folder / "scene.yaml");
  scene << "session: bar\nstep_s: 0.001\nduration_s: 1.4\ngravity_m_per_s2: [0, 0, -9.81]\nsleep: {after_s: 0}\n"
        << "bodies:\n  - name: bar\n    mesh: {file: bar.obj, unit: m}\n    model: " << model << "\n    volume: {"
        << volume << "}\n    pose: {position_world_m: " << list(place_m) << ", rotation_deg: " << list(angles_deg)
        << "}\n    material: {young_pa: 100000, poisson: 0.4, density_kg_per_m3: 1000, damping_per_s: 25}\n"
        << "    fixed: {min_world_m: [-1, -1, -1], max_world_m: [0.0001, 1, 1]}\n";
  return folder / "scene.yaml";
}

struct Outcome {
  double error = 0;   // in the sag of the end; positive: too soft
  double volume = 0;  // inside the surface that moves, over the volume of the bar, at rest
  double elements = 0;
};

double elements_of(const BodySpec& body) {
  const std::string name = "hexahedra: ";
  for (const std::string& note : body.mesh_notes)
    if (note.starts_with(name)) return std::stod(note.substr(name.size()));
  return static_cast<double>(body.tets.tetrahedra.size());
}

Outcome outcome_of(const std::string& model, const std::string& volume, const Turned& turned = {}) {
  const std::filesystem::path file = scene_of(model, volume, turned);
  const Scene scene = prepared(load_scene(file.string(), standard_traits()));
  std::filesystem::remove_all(file.parent_path());
  Simulation simulation(scene);
  for (int i = 0; i < 1400; ++i) simulation.step({});
  const TriangleMesh& mesh = simulation.mesh(0);
  const Pose& pose = scene.bodies[0].pose;
  // The displacement near the end is fitted by an affine field, with the square of the distance to it.
  Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> right = Eigen::Matrix<double, 5, 1>::Zero();
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) {
    const Vec3 rest = pose.to_world(mesh.rest_body_m(v)) - Vec3(kBar_m.x(), kBar_m.y() / 2, kBar_m.z() / 2);
    if (rest.x() < -0.0175) continue;
    Eigen::Matrix<double, 5, 1> row;
    row << 1, rest / kBar_m.x(), std::pow(rest.x() / kBar_m.x(), 2);
    normal += row * row.transpose();
    right += row * (rest.z() + kBar_m.z() / 2 - double{simulation.positions_world_m(0)[v].z()});
  }
  const double sag_m = normal.ldlt().solve(right)[0];
  return {sag_m / kSag_m - 1, check_soup(scene.bodies[0].mesh).volume_m3 / kBar_m.prod(), elements_of(scene.bodies[0])};
}

TEST(SceneBar, A_22_refining_the_lattice_makes_it_better) {
  double before = 1;
  for (const auto& [cell_m, demanded] : {std::pair{"0.025", 0.02}, {"0.0125", 0.01}, {"0.00625", 0.005}}) {
    const Outcome o = outcome_of("neo_hookean_lattice", std::string("cell_m: ") + cell_m);
    std::printf("cells of %s m: %.0f of them, %+.2f %%\n", cell_m, o.elements, 100 * o.error);
    EXPECT_NEAR(o.error, 0, demanded);
    EXPECT_LT(std::abs(o.error), before);
    EXPECT_EQ(o.elements, kBar_m.prod() / std::pow(std::atof(cell_m), 3)) << "cells of the bar alone";
    before = std::abs(o.error);
  }
}

TEST(SceneBar, A_22_it_does_not_matter_how_the_bar_lies_to_the_lattice) {
  double squares = 0, largest = 0, most_elements = 0;
  constexpr int kPoses = 24;
  for (unsigned pose = 0; pose < kPoses; ++pose) {
    const Outcome o = outcome_of("neo_hookean_lattice", "cell_m: 0.0125", at_random(pose, 0.0125));
    std::printf("pose %u: %.0f cells, %+.2f %%\n", pose, o.elements, 100 * o.error);
    EXPECT_NEAR(o.volume, 1, 0.002);
    squares += o.error * o.error / kPoses;
    largest = std::max(largest, std::abs(o.error));
    most_elements = std::max(most_elements, o.elements);
  }
  std::printf("root mean square %.2f %%, largest %.2f %%\n", 100 * std::sqrt(squares), 100 * largest);
  EXPECT_LT(std::sqrt(squares), bound(0.018, 0.024));
  EXPECT_LT(largest, bound(0.037, 0.047));  // aim: 0.02, README.md
  EXPECT_LT(most_elements, 3 * 256);
}

TEST(SceneBar, A_22_tetrahedra_keep_volume_and_edges) {
  for (unsigned pose = 0; pose < 4; ++pose) {
    const Outcome o = outcome_of("neo_hookean", "tetrahedra: 2400", pose == 0 ? Turned{} : at_random(pose, 0.0125));
    std::printf("pose %u: %.0f tetrahedra, %+.2f %%, volume %.4f\n", pose, o.elements, 100 * o.error, o.volume);
    EXPECT_NEAR(o.error, 0, pose == 0 ? 0.06 : 0.08);
    EXPECT_NEAR(o.volume, 1, 0.002);
  }
}

}  // namespace
}  // namespace sectio::test
