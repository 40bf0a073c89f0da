#include "sim_server/net/follower.h"

#include <algorithm>

#include "common/messages/codec.h"
#include "common/messages/epoch.h"

namespace sectio {
namespace {

using Seconds = std::chrono::duration<double>;

constexpr double kAsk_s = 0.05;
constexpr std::size_t kMostWaiting = 1u << 16;

}  // namespace

void Follower::listen(std::optional<std::uint64_t> leader) {
  const double passed_s = clock_.look();
  if (epoch_) known_s_ += passed_s;
  if (heard_any_) silence_s_ += passed_s;
  if (!heard_) deaf_s_ += passed_s;
  // While no server has been heard, any one will do: the one that was known may have died.
  if (leader && leader != epoch_ && (!epoch_ || !heard_any_ || takes_over(*leader, *epoch_))) turn_to(*leader);
  while (auto inputs = endpoints_.take<StepInputs>()) {
    if (!epoch_ || inputs->epoch != *epoch_) continue;
    heard_ = heard_any_ = true;
    silence_s_ = deaf_s_ = 0;
    steps_sent_ = std::max(steps_sent_, inputs->newest_step);
    newest_step_ = std::max(newest_step_, inputs->newest_step);
    for (StepRecord& step : inputs->steps) take(std::move(step));
    is_astray_ |= unconfirmed_ && newest_step_ < last_->step;
  }
  while (auto status = endpoints_.take<ServerStatus>())
    if (epoch_ && status->epoch == *epoch_) status_ = std::move(status);
  ask(passed_s);
}

void Follower::turn_to(std::uint64_t leader) {
  epoch_ = leader;
  heard_ = is_astray_ = false;
  unconfirmed_ = last_.has_value();
  status_.reset();
  steps_.clear();
  newest_step_ = steps_sent_ = 0;
  silence_s_ = deaf_s_ = futile_s_ = 0;
}

void Follower::take(StepRecord step) {
  newest_step_ = std::max(newest_step_, step.step);
  if (unconfirmed_ && step.step == last_->step) {
    unconfirmed_ = false;
    is_astray_ = encode(StepInputs{0, 0, {step}}) != encode(StepInputs{0, 0, {*last_}});
  }
  if (step.step >= next_step_ && steps_.size() < kMostWaiting) steps_.try_emplace(step.step, std::move(step));
}

void Follower::begin_after(std::uint64_t steps, std::optional<StepRecord> last) {
  next_step_ = steps + 1;
  last_ = std::move(last);
  unconfirmed_ = last_.has_value();
  is_astray_ = false;
  futile_s_ = 0;
  std::erase_if(steps_, [&](const auto& each) { return each.first <= steps; });
}

bool Follower::is_deaf() {
  if (deaf_s_ < deaf_after_s_) return false;
  deaf_s_ = 0;
  deaf_after_s_ = std::min(2 * deaf_after_s_, kMostDeaf_s);
  return true;
}

void Follower::ask(double passed_s) {
  const std::uint64_t wanted = wanted_step();
  const bool hole = newest_step_ >= wanted && (steps_.empty() || steps_.begin()->first != wanted);
  futile_s_ = hole && wanted_ == wanted ? futile_s_ + passed_s : 0;
  wanted_ = wanted;
  if (Seconds(Clock::now() - asked_).count() < kAsk_s) return;
  asked_ = Clock::now();
  if (!endpoints_.write(StepRequest{epoch_.value_or(0), hole ? wanted : 0, client_}))
    log_limited(LogLevel::warning, "step request", "DDS refused to send a request for inputs");
}

std::optional<StepRecord> Follower::take_step() {
  if (unconfirmed_ || is_astray_ || steps_.empty() || steps_.begin()->first != next_step_) return std::nullopt;
  last_ = std::move(steps_.begin()->second);
  steps_.erase(steps_.begin());
  ++next_step_;
  return last_;
}

}  // namespace sectio
