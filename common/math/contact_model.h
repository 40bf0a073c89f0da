// The local contact model, which the server sends to the device bridge: the tissue under an instrument as a plane with
// three numbers, and the force that the simulation had for one sample of the hand. The bridge knows its own motion at
// that sample and now, evaluates the same response at both, and adds the difference to the force (Smith 1957; local
// models: Adachi et al. 1995, Mark et al. 1996). Pure functions; no allocation, no lock.
#pragma once

#include <cstdint>

#include "common/math/types.h"

namespace sectio {

enum class ContactState : std::uint8_t {
  free = 0,
  contact = 1,
  penetration = 2,
  held = 3,  // jaws hold tissue or a piece, which pulls in every direction like a spring
};

constexpr double kNeverYields_n = 1e6;  // ContactModel::yield_n of tissue that the instrument can't break

struct ContactModel {
  std::uint32_t tool_id = 0;
  std::uint64_t sequence = 0;
  double sim_time_s = 0;
  double tool_time_s = 0;  // time stamp, by the bridge's own clock, of the newest tool sample that the server had used
  ContactState state = ContactState::free;
  Vec3 force_world_n = Vec3::Zero();  // from the tissue on the tool for that sample, as simulated
  Vec3 lever_world_m = Vec3::Zero();  // from the origin of the tool's frame to where the force acts
  // The surface at rest as a plane, also before the touch: the origin of the tool's frame is in it when the tool begins
  // to touch. It goes on with its velocity after that sample.
  Vec3 point_world_m = Vec3::Zero();
  // Unit, out of the tissue. If the front of a cut holds the blade, it points against the direction of cutting.
  Vec3 normal_world = Vec3::UnitZ();
  Vec3 velocity_world_m_per_s = Vec3::Zero();
  // The response to a dent: see Dent.
  double stiffness_n_per_m = 0;
  double damping_n_s_per_m = 0;
  double mass_kg = 0;
  double soft_depth_m = 0.0015;
  double side_stiffness_n_per_m = 0;  // tissue sideways, a front that holds a blade, or a held thing
  double friction = 0;                // Coulomb's coefficient
  double yield_n = kNeverYields_n;    // at this force tissue breaks or slips out of jaws; the hand feels no more

  template <class A>
  void archive(A& a) {
    a(tool_id, sequence, sim_time_s, tool_time_s, state, force_world_n, lever_world_m, point_world_m, normal_world,
      velocity_world_m_per_s, stiffness_n_per_m, damping_n_s_per_m, mass_kg, soft_depth_m, side_stiffness_n_per_m,
      friction, yield_n);
  }
};

// The motion of an instrument's tip, told by its samples: the same arithmetic on both sides of the wire.
struct TipMotion {
  double time_s = 0;
  Vec3 position_m = Vec3::Zero();
  Vec3 velocity_m_per_s = Vec3::Zero();  // through a low-pass of kVelocityFilter_s, since encoders have steps
  Vec3 acceleration_m_per_s2 = Vec3::Zero();

  static constexpr double kVelocityFilter_s = 0.002;
  void go_on(double to_s, const Vec3& position_m);  // times ascend; else only the position is taken

  template <class A>
  void archive(A& a) {
    a(time_s, position_m, velocity_m_per_s, acceleration_m_per_s2);
  }
};

// The dent of a tip in a model's plane. With d the depth, d_r the soft depth, n the plane's normal and p its point:
//
//   d = -n.(x - p),  u(d) = 0 (d <= 0),  2/3 d sqrt(d/d_r) (d < d_r),  d - d_r/3 (else)      Hertz, then straight
//   force Y = k u + c u' + m u'',  with u' = (du/dd) d' and u'' = (du/dd) d''                 k, c, m >= 0
//
// It is passive for constant k, c and m (the mass where the dent is straight).
struct Dent {
  double depth_m = 0;
  double spring_m = 0;        // u
  double damper_m_per_s = 0;  // u'
  double mass_m_per_s2 = 0;   // u''
};
Dent dent_of(const ContactModel& model, const TipMotion& tip);
inline double force_n(const ContactModel& model, const Dent& dent) {
  return model.stiffness_n_per_m * dent.spring_m + model.damping_n_s_per_m * dent.damper_m_per_s +
         model.mass_kg * dent.mass_m_per_s2;
}

}  // namespace sectio
