// The driver takes a step that Newton's method can't solve.
#include "sim_server/deformation/implicit_driver.h"

#include <gtest/gtest.h>

#include <vector>

namespace sectio::deformation_test {
namespace {

// Springs to the origin that say that they are a million times softer than they are while `lies` is true: every
// iteration goes far beyond the place that it should reach, and its energy is what it would have to be for that.
class Misleading final : public ElasticEnergy {
 public:
  double energy_j(std::span<const Vec3> /*x*/) override { return lies ? -(calls_ += 1.0) * 1e9 : 0; }
  void add_forces(std::span<const Vec3> x, std::span<Vec3> force_n) override {
    for (std::size_t i = 0; i < x.size(); ++i) force_n[i] -= kStiffness_n_per_m * x[i];
  }
  void linearise(std::span<const Vec3>) override {}
  void add_product(std::span<Vec4f> p_m, std::span<Vec4f> force_n) const override {
    for (std::size_t i = 0; i < p_m.size(); ++i) force_n[i] += static_cast<float>(said()) * p_m[i];
  }
  void add_blocks(std::span<Mat3> blocks_n_per_m) const override {
    for (Mat3& block : blocks_n_per_m) block.diagonal().array() += said();
  }

  bool lies = true;

 private:
  static constexpr double kStiffness_n_per_m = 1e7;
  double said() const { return lies ? 1e-6 * kStiffness_n_per_m : kStiffness_n_per_m; }
  double calls_ = 0;
};

TEST(ImplicitDriver, tissue_stands_still_where_newton_s_method_has_lost_its_way_and_goes_on_when_it_finds_it) {
  const std::vector<double> mass_kg(3, 1e-3), inverse{1e3, 1e3, 0};
  const Vec4f start(0.001F, 0.002F, -0.001F, 0);
  std::vector<Vec4f> x(3, start), v(3, Vec4f(1, 0, 0, 0));
  std::vector<PointConstraint> held{hold(0, Vec3(0.001, 0.002, 0.003))};
  ConstraintSupports supports;
  corners_of(held, supports);
  std::vector<Reaction> reactions(1);
  Misleading energy;
  ImplicitDriver driver;
  driver.step(energy, {}, {mass_kg, inverse, x, v}, held, supports, reactions);
  EXPECT_EQ(driver.steps_not_met(), 1u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(x[i], start) << i;
  EXPECT_TRUE(v[0].isZero(0) && v[1].isZero(0));
  EXPECT_EQ(v[2], Vec4f(1, 0, 0, 0)) << "what is held is left alone";
  EXPECT_TRUE(reactions[0].force_on_tool_n.isZero(0)) << "the hand feels none of it";
  energy.lies = false;
  driver.step(energy, {}, {mass_kg, inverse, x, v}, {}, {}, {});
  EXPECT_EQ(driver.steps_not_met(), 1u);
  EXPECT_LT(x[1].norm(), start.norm());
}

}  // namespace
}  // namespace sectio::deformation_test
