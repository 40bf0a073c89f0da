// What the hand should feel until the next step: a plane with stiffness, fitted to the last steps of the simulation
// (the bridge evaluates it at 1 kHz). Colgate & Schenkel's bound keeps the loop through the hand stable.
#pragma once

#include <array>
#include <cstddef>

#include "common/math/contact_model.h"
#include "sim_server/step/step_io.h"

namespace sectio {

// One step of the simulation, as one instrument saw it.
struct ContactStep {
  double sim_time_s = 0;
  double tool_time_s = 0;           // of the newest sample used
  Vec3 tip_world_m = Vec3::Zero();  // origin of the tool's frame in that sample
  Vec3 tip_velocity_world_m_per_s = Vec3::Zero();
  Vec3 reaction_world_n = Vec3::Zero();  // of the tissue on the tool
  ContactState state = ContactState::free;
  // The surface under the tip. In the free state too, when it is near: the hand then meets it without the delay of the
  // way to the server and back. `surface_known` false: nothing there.
  bool surface_known = false;
  Vec3 point_world_m = Vec3::Zero();
  Vec3 normal_world = Vec3::UnitZ();  // unit, out of the tissue
  // Of the undisturbed tissue at that point (it breathes, or a body moves), not of the dent that the tool makes.
  Vec3 surface_velocity_world_m_per_s = Vec3::Zero();
};

struct FitterSpec {
  double prior_stiffness_n_per_m = 200;   // 2 E* a of the tool's contact radius a
  double device_damping_n_s_per_m = 0.5;  // b of the weakest device, held by nobody
  double servo_period_s = 0.001;          // T
  double tangential_fraction = 0.5;       // k_t / k_n
  double friction = 0.2;
  double contact_damping_n_s_per_m = 0;
  double yield_n = 5;  // of the threshold to cut, or what the device can do
  double valid_radius_m = 0.01;
  double time_to_live_s = 0.05;
  double force_filter_s = 0.005;  // low-pass of the reaction
};

// One for each instrument. Pure arithmetic on what it is given: no clock, deterministic, O(32) a step.
class ContactModelFitter {
 public:
  static constexpr std::size_t kWindow = 32;  // steps that the stiffness is fitted to

  ContactModelFitter(std::uint32_t tool_id, const FitterSpec& spec);

  // Steps come in order of sim_time_s. Reactions and positions must be finite.
  ContactModel fit(const ContactStep& step);

 private:
  struct Change {
    double force_n = 0;     // along the normal
    double distance_m = 0;  // of the tip out of the tissue, along the normal
  };
  void follow(const ContactStep& step);
  void fit_stiffness();
  ContactModel free_model(ContactModel model, const ContactStep& step) const;

  std::uint32_t tool_id_;
  FitterSpec spec_;
  double stiffness_n_per_m_;
  std::uint64_t sequence_ = 0;
  std::array<Change, kWindow> window_{};  // zero where nothing was measured yet
  std::size_t newest_ = 0;
  bool touching_ = false;
  ContactStep last_;
  Vec3 smooth_force_n_ = Vec3::Zero();
  Vec3 smooth_tip_m_ = Vec3::Zero();
};

}  // namespace sectio
