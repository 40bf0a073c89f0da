#include "device_bridge/servo/contact_model_follower.h"

#include <algorithm>
#include <cmath>

#include "common/math/low_pass.h"

namespace sectio {
namespace {

constexpr double kShareOfBound = 0.7, kShareOfDamping = 0.95;
constexpr double kShareOfMass = 0.3;     // share of the device's own mass
constexpr double kWrongStiffness = 0.2;  // the part of a fitted stiffness that is taken to be wrong
constexpr double kSideways = 1.5;        // nobody fits the stiffness there
constexpr double kShareOfLoop = 0.8;     // the loop's gain about the resonance, which is highest a little below it
constexpr double kShortestFilter_s = 0.002;
constexpr double kForgets_s = 0.01;     // time in which a correction fades where nothing touches
constexpr double kLeastForce_n = 1e-3;  // smaller ones push in no direction
constexpr double kLeastGrip_n_per_m = 1;

bool in_tissue(const ContactModel& model) {
  return model.state == ContactState::penetration;
}

bool is_anchored(const ContactModel& model) {
  return in_tissue(model) || model.state == ContactState::held;
}

// The filter with which a part of the stiffness that the response lacks gives no energy, whatever the delay.
double filter_of(double lacks_n_per_m, double damping_n_s_per_m, double resonance_rad_per_s) {
  const double gain = lacks_n_per_m / std::max(1e-9, kShareOfLoop * damping_n_s_per_m * resonance_rad_per_s);
  return std::max(kShortestFilter_s, gain > 1 ? std::sqrt(gain * gain - 1) / resonance_rad_per_s : 0);
}

// The part of a force or way that the anchor has to do with.
Vec3 sideways(const ContactModel& model, const Vec3& v) {
  return is_anchored(model) ? v : Vec3(v - v.dot(model.normal_world) * model.normal_world);
}

}  // namespace

double ContactModelFollower::stiffest_n_per_m(double damping_n_s_per_m) const {
  return kShareOfBound * 2 * damping_n_s_per_m * device_.rate_hz;
}

const ContactModelFollower::Felt* ContactModelFollower::felt_at(double time_s) const {
  const double nearest_s = 0.5 / device_.rate_hz;
  const auto at = [&](std::size_t tick) -> const Felt& { return history_[tick % kHistory]; };
  std::size_t first = ticks_ - std::min(ticks_, kHistory), end = ticks_;  // times ascend
  while (first < end) {
    const std::size_t middle = first + (end - first) / 2;
    if (at(middle).tip.time_s > time_s + nearest_s)
      end = middle;
    else
      first = middle + 1;
  }
  if (end == ticks_ - std::min(ticks_, kHistory)) return nullptr;
  const Felt& felt = at(end - 1);
  return felt.tip.time_s > time_s - nearest_s ? &felt : nullptr;
}

void ContactModelFollower::receive(const ContactModel& model) {
  const bool is_known = felt_at(model.tool_time_s) != nullptr;
  const double age_s = tip_.time_s - model.tool_time_s;
  too_old_s_ = !is_known && ticks_ > kHistory && age_s > 0 ? age_s : 0;
  if (!is_known) return;
  next_ = model;
  fresh_ = true;
}

void ContactModelFollower::adopt(bool is_held) {
  fresh_ = false;
  const Felt* then = felt_at(next_.tool_time_s);
  if (!then) return;
  const double damping = device_.damping_n_s_per_m + (is_held ? kHandDamping_n_s_per_m : 0);
  const double half_period_s = 0.5 / device_.rate_hz, stiffest = stiffest_n_per_m(damping);
  if (!has_model_ || (model_.state != next_.state && (is_anchored(model_) || is_anchored(next_)))) {
    anchor_m_ = then->tip.position_m;
    side_correction_n_.setZero();
    grip_n_per_m_ = 0;
  }
  const double before_n = force_n(model_, dent_of(model_, tip_));
  model_ = next_;
  has_model_ = true;
  received_s_ = tip_.time_s;
  // A stiffer spring goes on with the stiffest slope from where it has reached that.
  const ContactModel told = model_;
  const double s = std::min(1.0, stiffest / std::max(stiffest, told.stiffness_n_per_m));
  model_.stiffness_n_per_m *= s;
  model_.soft_depth_m *= s * s;
  model_.damping_n_s_per_m =
      std::min(s * told.damping_n_s_per_m, kShareOfDamping * damping - model_.stiffness_n_per_m * half_period_s);
  model_.mass_kg = std::min(s * told.mass_kg, kShareOfMass * device_.mass_kg);
  model_.side_stiffness_n_per_m = std::min(model_.side_stiffness_n_per_m, stiffest);
  side_filter_s_ = kSideways * device_.mass_kg / damping;
  if (model_.state == ContactState::held) return hang(*then, damping);
  const double resonance = std::sqrt(model_.stiffness_n_per_m / device_.mass_kg);
  const double lacks_n_per_m = (1 + kWrongStiffness) * told.stiffness_n_per_m - model_.stiffness_n_per_m +
                               resonance * (told.damping_n_s_per_m - model_.damping_n_s_per_m) +
                               resonance * resonance * (told.mass_kg - model_.mass_kg);
  filter_s_ = filter_of(lacks_n_per_m, damping, resonance);
  if (lacks_n_per_m > model_.stiffness_n_per_m)
    filter_s_ = std::max(filter_s_, lacks_n_per_m / model_.stiffness_n_per_m * (tip_.time_s - told.tool_time_s));

  const Vec3& f = model_.force_world_n;
  correction_n_ += before_n - force_n(model_, dent_of(model_, tip_));  // another response is no other force
  wrong_n_ = f.dot(model_.normal_world) - force_n(model_, dent_of(model_, then->tip));
  side_wrong_n_ = sideways(model_, f) - sideways(model_, then->spring_n);
}

// A held thing is between free and twice as stiff as told. The anchor is ahead of the model by the velocity of what is
// held, which holds while the device on the spring is slower than the wire: k <= m / age^2. Another spring is no other
// force.
void ContactModelFollower::hang(const Felt& then, double damping_n_s_per_m) {
  const double told = std::max(kLeastGrip_n_per_m, model_.side_stiffness_n_per_m);
  const double age_s = tip_.time_s - model_.tool_time_s;
  const double k = std::clamp(device_.mass_kg / (age_s * age_s), kLeastGrip_n_per_m, told);
  if (grip_n_per_m_ > 0) anchor_m_ = tip_.position_m + grip_n_per_m_ / k * (anchor_m_ - tip_.position_m);
  grip_n_per_m_ = k;
  const double lacks_n_per_m = std::max(k, 2 * told - k);
  filter_s_ =
      std::max(filter_of(lacks_n_per_m, damping_n_s_per_m, std::sqrt(k / device_.mass_kg)), lacks_n_per_m / k * age_s);
  told_anchor_m_ = then.tip.position_m + model_.force_world_n / k + age_s * model_.velocity_world_m_per_s;
  if (audible_ <= 0) anchor_m_ = told_anchor_m_;  // nothing of it is felt yet
}

// The tissue goes on as the newest model tells it, but not through a silence.
Vec3 ContactModelFollower::went_m(double dt_s) const {
  return silent(tip_.time_s) ? Vec3(Vec3::Zero()) : Vec3(dt_s * model_.velocity_world_m_per_s);
}

Vec3 ContactModelFollower::tick(double now_s, const Vec3& tip_world_m, bool is_held) {
  const double dt = ticks_ > 0 ? std::max(0.0, now_s - tip_.time_s) : 0;
  if (ticks_ == 0) tip_ = {now_s, tip_world_m, Vec3::Zero(), Vec3::Zero()};
  tip_.go_on(now_s, tip_world_m);
  if (fresh_) adopt(is_held);
  Felt& felt = history_[ticks_++ % kHistory];
  felt = {tip_, Vec3::Zero()};
  if (!has_model_) return Vec3::Zero();
  const Vec3 push_n = push(dt);
  const Vec3 drag_n = drag(push_n, dt);
  felt.spring_n = drag_n - side_correction_n_;
  const double heard = std::clamp(1 - (now_s - received_s_ - kSilence_s) / kDecay_s, 0.0, 1.0);
  audible_ = std::min(heard, audible_ + dt / kReturn_s);
  return audible_ * (is_anchored(model_) ? drag_n : limited(push_n + drag_n, model_.yield_n));
}

Vec3 ContactModelFollower::push(double dt_s) {
  const Dent dent = dent_of(model_, tip_);
  if (dent.depth_m <= 0 || is_anchored(model_)) {
    correction_n_ *= std::exp(-dt_s / kForgets_s);
    return Vec3::Zero();
  }
  correction_n_ += low_pass_share(dt_s, filter_s_) * (wrong_n_ - correction_n_);
  const double pushed_n = force_n(model_, dent) + correction_n_;
  return pushed_n < 0 ? Vec3(Vec3::Zero()) : Vec3(pushed_n * model_.normal_world);  // no number stays none
}

// A force that the simulation has besides that of the front is added slowly.
Vec3 ContactModelFollower::hold_blade(double dt_s) {
  const double k = model_.side_stiffness_n_per_m;
  anchor_m_ += went_m(dt_s);
  const Vec3 stretched_m = tip_.position_m - anchor_m_;
  const double ahead_m = -stretched_m.dot(model_.normal_world), size_m = stretched_m.norm();
  const double most_m = k > 0 && ahead_m > 0 ? std::min(size_m, model_.yield_n / k * ahead_m / size_m) : 0;
  anchor_m_ = tip_.position_m - (size_m > 0 ? most_m / size_m : 0) * stretched_m;
  side_correction_n_ += low_pass_share(dt_s, side_filter_s_) * (side_wrong_n_ - side_correction_n_);
  return limited(k * (anchor_m_ - tip_.position_m) + side_correction_n_,
                 std::max(model_.yield_n, model_.force_world_n.norm()));
}

// A spring to a point that goes with what is held, as the newest models tell it.
Vec3 ContactModelFollower::hold_grip(double dt_s) {
  const Vec3 goes_m = went_m(dt_s);
  told_anchor_m_ += goes_m;
  anchor_m_ += goes_m;
  anchor_m_ += low_pass_share(dt_s, filter_s_) * (told_anchor_m_ - anchor_m_);
  return limited(grip_n_per_m_ * (anchor_m_ - tip_.position_m), model_.yield_n);
}

// The anchor's spring and the correction together are bounded by friction, or by what the tissue bears.
Vec3 ContactModelFollower::drag(const Vec3& push_n, double dt_s) {
  if (in_tissue(model_)) return hold_blade(dt_s);
  if (is_anchored(model_)) return hold_grip(dt_s);
  const Vec3& f = model_.force_world_n;
  const double k = model_.side_stiffness_n_per_m;
  // An edge that is pressed only sideways keeps its force.
  const double pushed_n = f.dot(model_.normal_world), side_n = sideways(model_, f).norm();
  const double lifted = pushed_n > kLeastForce_n ? std::min(1.0, push_n.norm() / pushed_n) : 1;
  const double most_n = push_n.isZero() ? 0 : std::max(model_.friction * push_n.norm(), lifted * side_n);
  anchor_m_ += went_m(dt_s);
  if (most_n <= 0 || k <= 0) {
    anchor_m_ = tip_.position_m;
    side_correction_n_.setZero();
    return Vec3::Zero();
  }
  side_correction_n_ += low_pass_share(dt_s, side_filter_s_) * (side_wrong_n_ - side_correction_n_);
  const Vec3 wanted_n = sideways(model_, k * (anchor_m_ - tip_.position_m)) + side_correction_n_;
  const Vec3 bounded_n = limited(wanted_n, most_n);
  anchor_m_ += (bounded_n - wanted_n) / k;
  return bounded_n;
}

}  // namespace sectio
