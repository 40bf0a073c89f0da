// Fits the contact model that the hand feels until the next step: a plane with a stiffness, from the last steps of the
// simulation. The bridge evaluates it at 1 kHz; the bound of Colgate & Schenkel (1997) keeps the loop through the hand
// stable.
#pragma once

#include <array>
#include <cstddef>

#include "common/math/contact_model.h"
#include "sim_server/step/step_io.h"

namespace sectio {

// The data of one step of the simulation for one instrument.
struct ContactStep {
  double sim_time_s = 0;
  double tool_time_s = 0;           // time of the newest sample used
  Vec3 tip_world_m = Vec3::Zero();  // origin of the tool's frame in that sample
  Vec3 tip_velocity_world_m_per_s = Vec3::Zero();
  Vec3 reaction_world_n = Vec3::Zero();  // force of the tissue on the tool
  ContactState state = ContactState::free;
  // The surface under the tip, also of a free tool near the surface: then the hand meets the plane without the delay of
  // the round trip to the server. `surface_known` is false if there is no surface near.
  bool surface_known = false;
  Vec3 point_world_m = Vec3::Zero();
  Vec3 normal_world = Vec3::UnitZ();  // unit, out of the tissue
  // The velocity of the undisturbed tissue at that point (breathing, or a moving body), not of the tool's dent.
  Vec3 surface_velocity_world_m_per_s = Vec3::Zero();
};

struct FitterSpec {
  double prior_stiffness_n_per_m = 200;   // 2 E* a of the tool's contact radius a
  double device_damping_n_s_per_m = 0.5;  // b, damping of the device itself when no hand holds it
  double servo_period_s = 0.001;          // T
  double tangential_fraction = 0.5;       // k_t / k_n
  double friction = 0.2;
  double contact_damping_n_s_per_m = 0;
  double yield_n = 5;  // threshold of cutting, or the device's largest force
  double valid_radius_m = 0.01;
  double time_to_live_s = 0.05;
  double force_filter_s = 0.005;  // time constant of the reaction's low-pass filter
};

// One fitter for each instrument. Deterministic arithmetic without a clock, O(32) a step.
class ContactModelFitter {
 public:
  static constexpr std::size_t kWindow = 32;  // number of steps to which the stiffness is fitted

  ContactModelFitter(std::uint32_t tool_id, const FitterSpec& spec);

  // Call once a step, in order of sim_time_s. Reactions and positions must be finite.
  ContactModel fit(const ContactStep& step);

 private:
  struct Change {
    double force_n = 0;     // along the normal
    double distance_m = 0;  // by which the tip moved out of the tissue, along the normal
  };
  void follow(const ContactStep& step);
  void fit_stiffness();
  ContactModel free_model(ContactModel model, const ContactStep& step) const;

  std::uint32_t tool_id_;
  FitterSpec spec_;
  double stiffness_n_per_m_;
  std::uint64_t sequence_ = 0;
  std::array<Change, kWindow> window_{};  // zero until measured
  std::size_t newest_ = 0;
  bool touching_ = false;
  ContactStep last_;
  Vec3 smooth_force_n_ = Vec3::Zero();
  Vec3 smooth_tip_m_ = Vec3::Zero();
};

}  // namespace sectio
