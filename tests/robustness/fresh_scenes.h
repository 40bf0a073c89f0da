// Scenes that are drawn from seeds, left as files, and played by the server as a stranger's would be.
// SECTIO_FRESH_BODIES: how many for each test; SECTIO_FRESH_SEED: the first one's seed.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "common/math/trace.h"
#include "common/mesh/obj_text.h"
#include "tests/support/environment.h"
#include "tests/support/process.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"

namespace sectio::test {

class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : random_(seed) {}
  double between(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
  template <class T, std::size_t N>
  T one_of(const std::array<T, N>& all) {
    return all[std::uniform_int_distribution<std::size_t>(0, N - 1)(random_)];
  }

 private:
  Random64 random_;
};

// An instrument that is held by its shaft, and goes ahead.
inline Pose held(const Vec3& tip_m, const Vec3& shaft, const Vec3& ahead) {
  const Vec3 aside = shaft.cross(ahead).normalized();
  Mat3 axes;
  axes << aside.cross(shaft), aside, shaft;
  return {tip_m, Eigen::Quaterniond(axes)};
}

constexpr double kDensity_kg_per_m3 = 1050;

// The modulus at which a bar or a plate that is held at one end sags by so much at the other.
inline double young_pa_of_sag(double hangs_m, double height_m, double sag_m) {
  constexpr double kGravity_m_per_s2 = 9.81;
  return 1.5 * kDensity_kg_per_m3 * kGravity_m_per_s2 * std::pow(hangs_m, 4) / (height_m * height_m * sag_m);
}

// Keys of a body that is cut as a volume. `cutting` and `material`: further keys, each with a comma before it.
struct VolumeKeys {
  std::string model, free_parts;
  int tetrahedra = 0;
  double young_pa = 0;
  std::string cutting = {}, material = {};

  std::string text() const {
    std::ostringstream out;
    out << "    model: " << model << "\n    volume: {mesher: lattice, tetrahedra: " << tetrahedra
        << ", least_part_s: 0.0001}\n    material: {young_pa: " << young_pa
        << (model == "tetra_springs" ? "" : ", poisson: 0.4") << ", density_kg_per_m3: " << kDensity_kg_per_m3
        << ", damping_per_s: 30" << material << "}\n    cutting: {threshold_force_n: 0.04" << cutting
        << "}\n    splitting: {free_parts: " << free_parts << "}\n";
    return out.str();
  }
};

// body.obj and hand.csv, which scene.yaml of the same directory names.
inline void leave_files(const std::string& directory, const TriangleSoup& soup, std::span<const TracePoint> trace) {
  std::filesystem::create_directories(directory);
  std::ofstream mesh(directory + "/body.obj"), hand(directory + "/hand.csv");
  mesh << obj_text(soup, "unit: m");
  hand << trace_columns() << "\n";
  for (const TracePoint& point : trace) {
    std::string row;
    append_trace_point(row, point);
    hand << row << "\n";
  }
}

// A volume that is held from one end up to a place along x, and a knife.
struct KnifeScene {
  std::string session, expect;
  VolumeKeys body;
  double held_to_m = 0, floor_z_m = 0, duration_s = 0;
  double shaft_m = 0, edge_m = 0, sharp_m = 0;  // the knife's back, its edge, and the sharp part of it
};
inline void leave_scene(const std::string& directory, const KnifeScene& scene) {
  std::ofstream(directory + "/scene.yaml")
      << "session: " << scene.session << "\nstep_s: auto\nduration_s: " << scene.duration_s
      << "\nfloor_z_m: " << scene.floor_z_m << "\nexpect: {" << scene.expect << R"(, removed_ml: at most 0.1}
camera: {eye_world_m: [0.11, -0.17, 0.15], target_world_m: [0.01, 0, 0.045], field_of_view_deg: 35}
bodies:
  - name: tissue
    mesh: {file: body.obj, unit: m}
)" << scene.body.text()
      << "    fixed: {min_world_m: [-1, -1, -1], max_world_m: [" << scene.held_to_m << R"(, 1, 1]}
tools:
  - {name: knife, kind: knife, trace: hand.csv, geometry: {a_tool_m: [0, 0, 0], b_tool_m: [0, 0, )"
      << scene.shaft_m << "], c_tool_m:\n     [0.002, 0, " << scene.edge_m << "], d_tool_m: [0.002, 0, "
      << scene.shaft_m << "], sharp_length_m: " << scene.sharp_m << "}}\n";
}
inline std::string about(double expected, double share) {
  std::ostringstream out;
  out << (1 - share) * expected << " to " << (1 + share) * expected;
  return out.str();
}
// One piece, with this volume within 15 %.
inline std::string about_freed(double ml) {
  return "pieces_freed: 1, freed_ml: " + about(ml, 0.15);
}

// make_scene() leaves a scene of that seed in the directory, and returns a line for a person.
using MakeScene = std::function<std::string(std::uint64_t seed, const std::string& directory)>;
inline void play(const MakeScene& make_scene, std::uint64_t bodies = 4, std::uint64_t first_seed = 1) {
  const std::uint64_t first = number_from("SECTIO_FRESH_SEED", first_seed),
                      count = number_from("SECTIO_FRESH_BODIES", bodies);
  std::uint64_t good = 0;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    const std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    const std::string directory = testing::TempDir() + "sectio_fresh_" + name + "_" + std::to_string(seed);
    const std::string drawn = make_scene(seed, directory);
    Process server(SECTIO_BIN_DIR "/sim_server",
                   {"--scene", directory + "/scene.yaml", "--offline", "--log-level", "warning"});
    const auto code = server.exit_code(std::chrono::seconds(300));
    good += code == 0;
    EXPECT_EQ(code, 0) << directory << ": " << drawn << "\n" << server.output().substr(0, 400);
    if (code == 0) std::filesystem::remove_all(directory);
  }
  std::printf("%lu of %lu\n", static_cast<unsigned long>(good), static_cast<unsigned long>(count));
}

}  // namespace sectio::test
