// Fits the contact model that the hand feels until the next step: a plane with a stiffness, from the last steps of the
// simulation. The bridge evaluates it at 1 kHz, within the limits of its device.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/math/contact_model.h"
#include "sim_server/step/step_io.h"

namespace sectio {

// The tissue of one body where an instrument touches it, or would.
struct FeltTissue {
  double stiffness_n_per_m = 200;  // expected before any force is known: 2 E* a of a contact's radius a
  double friction = 0.2;           // Coulomb's coefficient
  double yield_n = kNeverYieldsN;  // the tissue breaks at this force
};

constexpr std::uint32_t kNoBody = 0xffffffffu;

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
  std::uint32_t body_id = kNoBody;  // whose surface
  FeltTissue tissue = {};
  double gap_m = 0;  // of a free tool: how far it is from the surface, along the normal
  Vec3 point_world_m = Vec3::Zero();
  Vec3 normal_world = Vec3::UnitZ();  // unit, out of the tissue
  // The velocity of the undisturbed tissue at that point (breathing, or a moving body), not of the tool's dent.
  Vec3 surface_velocity_world_m_per_s = Vec3::Zero();
};

struct FitterSpec {
  double tangential_fraction = 0.5;  // k_t / k_n
  double valid_radius_m = 0.01;
  double time_to_live_s = 0.05;
  double force_filter_s = 0.005;    // time constant of the reaction's low-pass filter
  double velocity_filter_s = 0.02;  // of the surface's velocity, which the bridge extrapolates: no tremble of a mesh
};

// One fitter for each instrument. Deterministic arithmetic without a clock, O(32) a step.
class ContactModelFitter {
 public:
  static constexpr std::size_t kWindow = 32;  // number of steps to which the stiffness is fitted

  explicit ContactModelFitter(std::uint32_t tool_id, const FitterSpec& spec = {});

  // Call once a step, in order of sim_time_s. Reactions and positions must be finite.
  ContactModel fit(const ContactStep& step);

 private:
  struct Change {
    double force_n = 0;     // along the normal
    double distance_m = 0;  // by which the tip moved out of the tissue, along the normal
  };
  void meet(const ContactStep& step);
  void follow_surface(const ContactStep& step);
  void follow(const ContactStep& step);
  void fit_stiffness();
  ContactModel free_model(ContactModel model, const ContactStep& step) const;

  std::uint32_t tool_id_;
  FitterSpec spec_;
  FeltTissue tissue_;
  double stiffness_n_per_m_ = tissue_.stiffness_n_per_m;
  std::uint64_t sequence_ = 0;
  std::array<Change, kWindow> window_{};  // zero until measured
  std::size_t newest_ = 0;
  bool touching_ = false;
  ContactStep last_;
  std::uint32_t body_id_ = kNoBody;  // that was touched last, or nearest
  bool surface_known_ = false;
  Vec3 surface_velocity_m_per_s_ = Vec3::Zero();
  Vec3 smooth_force_n_ = Vec3::Zero();
  Vec3 smooth_tip_m_ = Vec3::Zero();
};

}  // namespace sectio
