#include "sim_server/deformation/implicit_driver.h"

#include <algorithm>
#include <cmath>

namespace sectio {

void ImplicitDriver::step(ElasticEnergy& energy, const Motion& motion, const Particles& particles,
                          std::span<const PointConstraint> constraints, const ConstraintSupports& supports,
                          std::span<Reaction> reactions, const Smoother& smoother) {
  start_position_.assign(particles.position_world_m.begin(), particles.position_world_m.end());
  start_velocity_.assign(particles.velocity_m_per_s.begin(), particles.velocity_m_per_s.end());
  from_.resize(constraints.size());
  for (std::size_t n = 0; n < constraints.size(); ++n) from_[n] = carried(supports.of(n), start_position_);
  products_ = iterations_ = 0;
  look_back(motion.step_s);
  const std::vector<NewtonStep::Borne> borne = newton_.borne();
  const auto attempt = [&](int parts, Ending ending) {
    parts_ = parts;
    if (products_ > 0) {
      std::ranges::copy(start_position_, particles.position_world_m.begin());
      std::ranges::copy(start_velocity_, particles.velocity_m_per_s.begin());
      newton_.begin_with(borne);
    }
    const Smoother& used = parts > 2 ? smoother : Smoother{};
    return take(energy, motion, particles, constraints, supports, reactions, parts, ending, used);
  };
  // Dividing may make worse a step that was nearly met: then the attempt that came closest counts.
  bool met = false;
  int closest = 0;  // its parts; 0: none was near
  double least = kNear;
  for (int parts = 1; parts <= kMostParts; parts *= 2) {
    const bool is_last = parts == kMostParts && closest == 0;
    met = attempt(parts, is_last ? Ending::anyhow : Ending::only_when_met);
    if (met || (closest > 0 && residual_ > least)) break;
    if (!is_last && residual_ < least) closest = parts, least = residual_;
  }
  if (!met && closest > 0) attempt(closest, Ending::anyhow);
  not_met_ += !met;
  before_position_.clear();
  if (!motion.is_long || parts_ > 1) return;
  before_position_ = start_position_, before_velocity_ = start_velocity_;
  left_position_.assign(particles.position_world_m.begin(), particles.position_world_m.end());
  left_velocity_.assign(particles.velocity_m_per_s.begin(), particles.velocity_m_per_s.end());
}

void ImplicitDriver::look_back(double step_s) {
  if (before_position_.empty()) return;
  const std::size_t known = std::min(before_position_.size(), start_position_.size());
  const auto h = static_cast<float>(step_s);
  before_position_.resize(start_position_.size()), before_velocity_.resize(start_position_.size());
  for (std::size_t i = 0; i < start_position_.size(); ++i) {
    const Vec4f &x = start_position_[i], &v = start_velocity_[i];
    if (i >= known) {
      before_position_[i] = x - h * v, before_velocity_[i] = v;
      continue;
    }
    const Vec4f pushed = v - left_velocity_[i];
    before_position_[i] += x - left_position_[i] - h * pushed;
    before_velocity_[i] += pushed;
  }
}

bool ImplicitDriver::is_thrown(const Particles& particles, double furthest_m) const {
  for (std::size_t i = 0; i < now_.size(); ++i)
    if (!((now_[i] - particles.position_world_m[i].head<3>().cast<double>()).norm() <= furthest_m)) return true;
  return false;
}

// The smoother alone moves particles; the speed with which they came is dropped.
void ImplicitDriver::stand_still(const Particles& particles, double furthest_m, double part_s,
                                 const Smoother& smoother) {
  const auto place = [&](std::size_t i) -> Vec3 { return particles.position_world_m[i].head<3>().cast<double>(); };
  for (std::size_t i = 0; i < now_.size(); ++i) inertial_[i] = now_[i] = place(i);
  if (smoother) smoother(part_s, inertial_, now_);
  for (std::size_t i = 0; i < now_.size(); ++i) {
    if (particles.inverse_mass_per_kg[i] == 0) continue;
    particles.velocity_m_per_s[i].setZero();
    const Vec3 moved = now_[i] - place(i);
    if (moved.norm() <= furthest_m) particles.position_world_m[i].head<3>() = now_[i].cast<float>();
  }
  newton_.begin_with({});
}

// To where the particles come without forces of the tissue, and to where Newton's method begins.
void ImplicitDriver::begin_part(const Part& part, const Particles& particles) {
  for (std::size_t i = 0; i < now_.size(); ++i) {
    const Vec3 x = particles.position_world_m[i].head<3>().cast<double>();
    inertial_[i] = now_[i] = base_[i] = x;
    const double inverse = particles.inverse_mass_per_kg[i];
    if (inverse == 0) continue;
    Vec3 v = particles.velocity_m_per_s[i].head<3>().cast<double>();
    now_[i] += part.start_s * v;
    if (part.has_past) {
      base_[i] += (x - before_position_[i].head<3>().cast<double>()) / 3;
      v += (v - before_velocity_[i].head<3>().cast<double>()) / 3;
    }
    inertial_[i] = base_[i] + part.kept_s * v + particles.mass_kg[i] * inverse * part.fall_m;
  }
}

void ImplicitDriver::end_part(const Part& part, const Particles& particles, double furthest_m) {
  for (std::size_t i = 0; i < now_.size(); ++i) {
    if (particles.inverse_mass_per_kg[i] == 0) continue;
    const Vec3 from = particles.position_world_m[i].head<3>().cast<double>();
    Vec3 moved = now_[i] - from;
    const double distance_m = moved.norm();
    if (distance_m > furthest_m) moved *= furthest_m / distance_m;
    particles.position_world_m[i].head<3>() = (from + moved).cast<float>();
    particles.velocity_m_per_s[i].head<3>() = ((from + moved - base_[i]) / part.length_s).cast<float>();
  }
}

bool ImplicitDriver::take(ElasticEnergy& energy, const Motion& motion, const Particles& particles,
                          std::span<const PointConstraint> constraints, const ConstraintSupports& supports,
                          std::span<Reaction> reactions, int parts, Ending ending, const Smoother& smoother) {
  const bool has_past = motion.is_long && parts == 1 && !before_position_.empty();
  const double h = motion.step_s / parts, length = has_past ? 2 * h / 3 : h;  // H
  const double kept = length / (1 + motion.damping_per_s * length), start = h / (1 + motion.damping_per_s * h);
  const Part part{h, length, kept, start, has_past, length * kept * motion.gravity_m_per_s2};
  const std::size_t count = particles.position_world_m.size();
  part_.assign(constraints.begin(), constraints.end());
  taken_along_.resize(constraints.size());
  of_part_.resize(constraints.size());
  std::ranges::fill(reactions, Reaction{});
  inertial_.resize(count), now_.resize(count), base_.resize(count);
  residual_ = 0;
  bool met = true;
  int left = kMostProducts, stood = 0;
  for (int n = 0; n < parts; ++n) {
    for (std::size_t c = 0; c < part_.size(); ++c)
      if (!constraints[c].unilateral)  // a pressing target stays where it will be
        part_[c].target_world_m = from_[c] + (n + 1.0) / parts * (constraints[c].target_world_m - from_[c]);
    for (std::size_t c = 0; c < part_.size(); ++c) {
      taken_along_[c] = h * part_[c].target_velocity_m_per_s;
      for (const auto& [particle, weight] : supports.of(c))
        taken_along_[c] += weight * particles.position_world_m[particle].head<3>().cast<double>();
    }
    begin_part(part, particles);
    if (smoother) smoother(h, inertial_, now_);
    // x = X + H V / (1 + alpha H) + H^2 / (1 + alpha H) (f / m + g)
    const NewtonStep::Problem problem{std::sqrt(length * kept),
                                      motion.is_long ? NewtonStep::kLongTolerance : NewtonStep::kTolerance,
                                      particles.mass_kg,
                                      particles.inverse_mass_per_kg,
                                      inertial_,
                                      part_,
                                      &supports,
                                      taken_along_,
                                      left / (parts - n)};
    const NewtonOutcome outcome = newton_.solve(energy, problem, now_);
    products_ += outcome.products;
    left -= outcome.products;
    iterations_ += outcome.iterations;
    residual_ = std::max(residual_, std::isfinite(outcome.residual) ? outcome.residual : HUGE_VAL);
    residual_m_ = outcome.last_move_m;
    met &= outcome.met;
    if (!met && ending == Ending::only_when_met) return false;
    const double furthest_m = motion.largest_speed_m_per_s * h;
    if (!outcome.met && (!(outcome.residual < kLost) || is_thrown(particles, furthest_m))) {
      stand_still(particles, furthest_m, h, smoother);
      ++stood;
      continue;
    }
    end_part(part, particles, furthest_m);
    newton_.finish(problem, h, particles.velocity_m_per_s, of_part_);
    for (std::size_t c = 0; c < of_part_.size(); ++c) {
      reactions[c].force_on_tool_n += of_part_[c].force_on_tool_n / parts;
      reactions[c].active |= of_part_[c].active;
      reactions[c].work_j += of_part_[c].work_j;
    }
  }
  for (Reaction& reaction : reactions) reaction.is_known = stood < parts;
  return met;
}

}  // namespace sectio
