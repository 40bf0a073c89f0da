#include "sim_server/net/input_feed.h"

#include <algorithm>

#include "common/core/wall_time.h"
#include "common/messages/codec.h"

namespace sectio {
namespace {

using Seconds = std::chrono::duration<double>;

constexpr std::ptrdiff_t kStepsAtOnce = 512;
constexpr std::size_t kMostStandbyPrograms = 64;

}  // namespace

bool InputFeed::standby_is_there() const {
  return standby_heard_ && Seconds(Clock::now() - *standby_heard_).count() < kPresence_s;
}

void InputFeed::write(std::vector<StepRecord> steps) {
  written_ = Clock::now();
  if (!endpoints_.write(StepInputs{epoch_, newest_step_, std::move(steps)}))
    log_limited(LogLevel::warning, "step inputs", "DDS refused to send inputs to a standby");
}

void InputFeed::send(std::span<const StepRecord> steps) {
  if (standby_is_there())
    for (const StepRecord& step : steps) write({step});
  if (log_) return;
  last_steps_.insert(last_steps_.end(), steps.begin(), steps.end());
  while (last_steps_.size() > kSteps) last_steps_.pop_front();
}

void InputFeed::go_on_after(std::uint64_t steps, std::deque<StepRecord> last) {
  newest_step_ = steps;
  last_steps_ = std::move(last);
  while (!last_steps_.empty() && last_steps_.back().step > steps) last_steps_.pop_back();
  if (log_) last_steps_.clear();
}

std::vector<StepRecord> InputFeed::past_from(std::uint64_t first_step) const {
  if (log_) return log_->read_from(first_step, most_bytes_);
  if (last_steps_.empty() || first_step < last_steps_.front().step) return {};
  const auto from = std::ranges::lower_bound(last_steps_, first_step, {}, &StepRecord::step);
  const auto count = std::min<std::ptrdiff_t>(last_steps_.end() - from, kStepsAtOnce);
  return {from, from + count};
}

void InputFeed::take_requests() {
  while (const auto request = endpoints_.take<StepRequest>()) {
    const ProgramId& program = endpoints_.sender<StepRequest>();
    if (standbys_.size() < kMostStandbyPrograms) standbys_[program] = request->epoch;
    if (request->epoch != epoch_) continue;
    standby_heard_ = Clock::now();
    if (request->first_step == 0)
      wanted_.erase(program);
    else if (wanted_.size() < kMostStandbyPrograms || wanted_.contains(program))
      wanted_[program] = request->first_step;
  }
}

// The program whose turn it is; it asks again for what comes after.
void InputFeed::answer_next() {
  if (wanted_.empty() || !past_bytes_.is_open(steady_now_s())) return;
  auto next = wanted_.upper_bound(answered_);
  if (next == wanted_.end()) next = wanted_.begin();
  answered_ = next->first;
  std::vector<StepRecord> steps = past_from(next->second);
  wanted_.erase(next);
  if (steps.empty()) return;
  past_bytes_.take(static_cast<double>(encode(StepInputs{epoch_, newest_step_, steps}).size()));
  write(std::move(steps));
}

void InputFeed::serve(bool lives) {
  take_requests();
  if (!lives) return;
  answer_next();
  if (standby_is_there() && Seconds(Clock::now() - written_).count() >= kHeartbeat_s) write({});
}

}  // namespace sectio
