// Fits the contact model with which a hand bridges the time to the server: stiffness, damping and mass of the tissue
// under an instrument, by recursive least squares from the simulation's own forces.
#pragma once

#include <cstdint>

#include "common/math/contact_model.h"

namespace sectio {

// The front of a cut that holds a blade.
struct FeltFront {
  double stiffness_n_per_m = 0;
  double strength_n = 0;                       // it yields here; 0: nothing holds the blade
  Vec3 ahead_world = Vec3::UnitX();            // unit: where the blade cuts
  Vec3 velocity_world_m_per_s = Vec3::Zero();  // it goes along with its body
};

// The tissue of one body where an instrument touches it, or would.
struct FeltTissue {
  double stiffness_n_per_m = 40;    // expected before any force is known
  double damping_per_s = 25;        // per mass of the tissue
  double friction = 0.2;            // Coulomb's coefficient
  double yield_n = kNeverYields_n;  // the tissue breaks at this force

  template <class A>
  void archive(A& a) {
    a(stiffness_n_per_m, damping_per_s, friction, yield_n);
  }
};

// The springs by which jaws hold something.
struct FeltGrip {
  double stiffness_n_per_m = 0, largest_force_n = 0;
  Vec3 velocity_world_m_per_s = Vec3::Zero();  // the velocity of the held thing
  bool is_tissue = false;                      // it is held by its points, without springs
};

constexpr std::uint32_t kNoBody = 0xffffffffu;

// The data of one step of the simulation for one instrument.
struct ContactStep {
  double sim_time_s = 0;
  TipMotion tip;  // the origin of the tool's frame in the newest sample used, after all samples before it
  Vec3 reaction_world_n = Vec3::Zero();  // force of the tissue on the tool
  Vec3 lever_world_m = Vec3::Zero();     // from the tip to where it acts
  ContactState state = ContactState::free;
  // The surface at rest under the tip, also of a free tool near the surface: then the hand meets the plane without the
  // delay of the wire. `surface_known` is false if there is no surface near.
  bool surface_known = false;
  std::uint32_t body_id = kNoBody;  // the surface's body
  FeltTissue tissue = {};
  FeltFront front = {};
  FeltGrip grip = {};  // while jaws hold something
  double gap_m = 0;    // how far the tool is outside of the surface, along the normal; negative beneath it
  Vec3 normal_world = Vec3::UnitZ();  // unit, out of the tissue
  // The velocity of the undisturbed tissue there (breathing, or a moving body), not of the tool's dent.
  Vec3 surface_velocity_world_m_per_s = Vec3::Zero();
};

// One fitter for each instrument. Deterministic arithmetic without a clock, O(1) a step.
class ContactModelFitter {
 public:
  explicit ContactModelFitter(std::uint32_t tool_id) { model_.tool_id = tool_id; }

  // Call once a step, in order of sim_time_s. Reactions and positions must be finite.
  const ContactModel& fit(const ContactStep& step);

  template <class A>
  void archive(A& a) {
    a(model_, body_id_, tissue_, surface_known_, touching_, mean_response_, mean_force_n_, responses_, forces_, theta_,
      until_solved_s_);
  }

 private:
  const ContactModel& hold(const FeltGrip& grip);
  void meet(const ContactStep& step);
  void place(const ContactStep& step);
  void learn(const Vec3& response, double force_n, double dt_s);
  void solve();

  ContactModel model_;
  std::uint32_t body_id_ = kNoBody;  // the body touched last, or nearest
  FeltTissue tissue_;
  bool surface_known_ = false;
  bool touching_ = false;
  // The response is (u, u', u'' + alpha u'). Running means, then sums of products that fade.
  Vec3 mean_response_ = Vec3::Zero();
  double mean_force_n_ = 0;
  Eigen::Matrix3d responses_ = Eigen::Matrix3d::Zero();
  Vec3 forces_ = Vec3::Zero();
  Vec3 theta_ = Vec3::Zero();  // k, c - alpha m, m
  double until_solved_s_ = 0;
};

}  // namespace sectio
