// A haptic loop in simulated time: virtual hand, servo, a wire with delay, jitter and loss, and a server that feels the
// tissue at its own rate. Everything that the real programs do between hand and tissue, without clock or socket.
#pragma once

#include <cmath>
#include <deque>
#include <numbers>
#include <vector>

#include "common/math/hash.h"
#include "device_bridge/device/virtual_hand.h"
#include "device_bridge/servo/servo_state.h"
#include "sim_server/haptics/contact_model_fitter.h"

namespace sectio {

struct BenchSpec {
  double tissue_n_per_m = 200;
  double organ_amplitude_m = 0.002;
  double organ_hz = 0.3;
  double hand_amplitude_m = 0.006;  // 12 mm from end to end
  double hand_hz = 1;
  double depth_m = 0.01;  // of the middle of the wish; negative: above the tissue
  double publish_hz = 60;
  double delay_s = 0.025;  // there and back, half each
  double jitter_s = 0;
  double loss = 0;
  bool raw_force = false;              // control: the newest force, held
  double model_stiffness_n_per_m = 0;  // not 0: the model's stiffness, however wrong, instead of the fitted one
  bool surface_velocity_known = true;
  HandSpec hand;
  FeltTissue tissue;
  ServoSpec servo{.device = {.largest_force_n = 100}};
  double duration_s = 10;
  std::uint64_t seed = 7;
};

struct BenchResult {
  double rms_error = 0;       // of the force, relative to the force of the same motion without delay
  double force_ripple_n = 0;  // rms of the force above about 8 Hz
  double largest_force_n = 0;
  double energy_to_hand_w = 0;  // mean power that the hand received
};

class HapticBench {
 public:
  explicit HapticBench(const BenchSpec& spec) : spec_(spec), hand_(wish(), spec.hand), fitter_(0), servo_(spec.servo) {}

  BenchResult run() {
    const auto ticks = static_cast<std::int64_t>(spec_.duration_s * 1000);
    for (std::int64_t i = 0; i < ticks; ++i) tick(static_cast<double>(i) * 0.001);
    const auto n = static_cast<double>(measured_);
    return {std::sqrt(error_ / ideal_), std::sqrt(ripple_ / n), largest_n_, work_j_ / (n * 0.001)};
  }

 private:
  struct Packet {
    double arrives_s;
    ContactModel model;
  };

  std::vector<TracePoint> wish() const {
    std::vector<TracePoint> path;
    for (int i = 0; i <= static_cast<int>(spec_.duration_s * 1000); ++i) {
      const double t = i * 0.001;
      const double z = -spec_.depth_m + spec_.hand_amplitude_m * std::sin(2 * std::numbers::pi * spec_.hand_hz * t);
      path.push_back({t, {Vec3(0, 0, z), Eigen::Quaterniond::Identity()}});
    }
    return path;
  }

  double organ_phase(double t) const { return 2 * std::numbers::pi * spec_.organ_hz * t; }
  Vec3 surface_m(double t) const { return {0, 0, spec_.organ_amplitude_m * std::sin(organ_phase(t))}; }
  Vec3 surface_velocity(double t) const {
    return {0, 0, spec_.organ_amplitude_m * 2 * std::numbers::pi * spec_.organ_hz * std::cos(organ_phase(t))};
  }
  Vec3 tissue_force(const Vec3& tip, double t) const {
    return {0, 0, std::max(0.0, spec_.tissue_n_per_m * (surface_m(t) - tip).z())};
  }
  double uniform() { return static_cast<double>(mix64(spec_.seed + ++draws_) >> 11) * 0x1p-53; }

  void tick(double t) {
    const Pose pose = hand_.pose_world(t);
    poses_.push_back({0, t, pose});
    serve(t);
    const ContactModel* model = arrived(t);
    const ServoRecord record = servo_.tick(t, pose, model);
    if (model != nullptr) held_n_ = model->force_world_n;
    const Vec3 force = spec_.raw_force ? held_n_ : record.force_world_n;
    hand_.apply(force);
    if (t > 1) measure(force, tissue_force(pose.position_m, t));
  }

  void serve(double t) {
    while (poses_.size() > 1 && poses_[1].tool_time_s <= t - spec_.delay_s / 2) poses_.pop_front();
    const PoseSample& newest = poses_.front();
    ContactStep step;
    step.sim_time_s = t;
    step.tool_time_s = newest.tool_time_s;
    step.tip_world_m = newest.pose_world.position_m;
    step.reaction_world_n = tissue_force(step.tip_world_m, t);
    step.state = step.reaction_world_n.z() > 0 ? ContactState::contact : ContactState::free;
    step.surface_known = true;
    step.body_id = 0;
    step.tissue = spec_.tissue;
    step.point_world_m = surface_m(t);
    step.gap_m = std::max(0.0, (step.tip_world_m - surface_m(t)).z());
    if (spec_.surface_velocity_known) step.surface_velocity_world_m_per_s = surface_velocity(t);
    ContactModel model = fitter_.fit(step);
    if (spec_.model_stiffness_n_per_m > 0) model.stiffness_n_per_m = spec_.model_stiffness_n_per_m;
    if (t < next_publish_s_) return;
    next_publish_s_ += 1 / spec_.publish_hz;
    if (uniform() < spec_.loss) return;
    wire_.push_back({t + spec_.delay_s / 2 + spec_.jitter_s * (2 * uniform() - 1), model});
  }

  const ContactModel* arrived(double t) {
    bool any = false;
    while (!wire_.empty() && wire_.front().arrives_s <= t) {
      newest_ = wire_.front().model;
      wire_.pop_front();
      any = true;
    }
    return any ? &newest_ : nullptr;
  }

  void measure(const Vec3& force, const Vec3& ideal) {
    constexpr double kShare = 0.05;  // of a low-pass at 8 Hz
    ++measured_;
    error_ += (force - ideal).squaredNorm();
    ideal_ += ideal.squaredNorm();
    slow_n_ = measured_ == 1 ? force : Vec3(slow_n_ + kShare * (force - slow_n_));
    ripple_ += (force - slow_n_).squaredNorm();
    largest_n_ = std::max(largest_n_, force.norm());
    work_j_ += force.dot(hand_.velocity_world_m_per_s()) * 0.001;
  }

  BenchSpec spec_;
  VirtualHand hand_;
  ContactModelFitter fitter_;
  ServoState servo_;
  std::deque<PoseSample> poses_;
  std::deque<Packet> wire_;
  ContactModel newest_;
  Vec3 held_n_ = Vec3::Zero();
  Vec3 slow_n_ = Vec3::Zero();
  double next_publish_s_ = 0;
  std::uint64_t draws_ = 0;
  std::int64_t measured_ = 0;
  double error_ = 0, ideal_ = 1e-30, ripple_ = 0, largest_n_ = 0, work_j_ = 0;
};

}  // namespace sectio
