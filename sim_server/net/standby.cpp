#include "sim_server/net/standby.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <utility>

#include "common/core/error.h"
#include "common/core/log.h"
#include "common/messages/epoch.h"
#include "common/messages/epoch_owners.h"
#include "sim_server/net/input_feed.h"

namespace sectio {
namespace {

constexpr double kRepeat_s = 0.5;    // a standby that takes over says again what was said so shortly before
constexpr double kMostLost_s = 0.5;  // a standby that is further behind than that can't take over
constexpr int kStepsPerLook = 64;
constexpr std::ptrdiff_t kMostSamplesKept = 4096;
constexpr double kTurn_s = 0.2;     // so much later the next one of several standbys goes on
constexpr double kFirstWord_s = 1;  // for a server that has announced itself to say something
constexpr std::size_t kMostTurns = 8;
constexpr int kChances = 2;      // to some moment before the pasts part, and to the beginning
constexpr double kCutOff_s = 1;  // from such a silence of all on it is said
constexpr double kBack_s = 0.5;  // once somebody speaks again, the server has so long to do so, too
constexpr auto kLookPeriod = std::chrono::milliseconds(1);

}  // namespace

bool Standby::follow() {
  log_info("standing by");
  Follower& server = session_.net->follower();
  begin_after(session_.run->steps());
  if (session_.run->steps() > 0) chances_ = kChances;
  while (!stop_was_requested()) {
    keep_news();
    server.listen(session_.net->others().leader());
    notice_another_server();
    if (server.is_astray()) go_back("its past isn't that of the server");
    int steps = 0;
    for (; steps < kStepsPerLook && !stop_was_requested(); ++steps) {
      const std::optional<StepRecord> record = server.take_step();
      if (!record) break;
      follow_step(*record);
    }
    if (!in_step_ && knows_orders_ && server.newest_step() > 0 && server.steps_taken() >= server.newest_step()) {
      in_step_ = true;
      log_info("it has caught up with the server at step " + std::to_string(session_.run->steps()) +
               (session_.pace.is_paused() ? ", which is paused" : ""));
    }
    if (!server.heard_any() && server.epoch() && session_.net->others().has_ended(*server.epoch()))
      throw std::runtime_error("the session ended before this standby had heard a step of it");
    if (server.is_deaf()) rejoin_if_servers_are_there();
    if (server.is_lost())
      throw std::runtime_error("the server doesn't keep its inputs (--export): a standby must be there when it begins");
    if (steps == 0 && server.heard_any() && is_to_go_on()) return !session_.net->others().has_ended(*server.epoch());
    if (steps == 0) std::this_thread::sleep_for(kLookPeriod);
  }
  return false;
}

// The last step of its past is compared with the server's, when the past is another program's.
void Standby::begin_after(std::uint64_t steps) {
  std::vector<StepRecord> last;
  if (steps > 0 && session_.run->inputs()) last = session_.run->inputs()->read_from(steps, 1);
  session_.net->follower().begin_after(steps, last.empty() ? std::nullopt : std::optional(last.front()));
}

void Standby::notice_another_server() {
  const Follower& server = session_.net->follower();
  if (!server.hears() || followed_ == *server.epoch()) return;
  if (!session_.net->others().has_our_scene(*server.epoch()))
    throw InputError(
        "the server runs another scene, with other bodies, instruments, looks or an exercise of its own: "
        "this is no standby for it");
  if (followed_ != 0) {
    chances_ = kChances;
    in_step_ = false;
  }
  log_info(followed_ == 0 ? "it hears the server" : "it stands by for the server of a later term");
  followed_ = *server.epoch();
}

// All standbys agree on their order, and the next one hears the one before it go on before it is its turn. One that
// can't go on leaves it to all others. One that has just come doesn't know the others yet, and doesn't believe them at
// once (epoch_owners.h).
bool Standby::is_to_go_on() {
  const Follower& server = session_.net->follower();
  const std::size_t before = session_.net->others().standbys_before_this(*server.epoch());
  const double turn_s = kTurn_s * static_cast<double>(is_far_behind() ? kMostTurns : std::min(before, kMostTurns));
  const bool is_silent = server.silence_s() > turn_s + (server.hears() ? Follower::kTakeOver_s : kFirstWord_s) &&
                         server.known_s() > turn_s + EpochOwners::kWaits_s + Follower::kTakeOver_s;
  const double since_s = clock_.now_s() - server.silence_s();
  const bool is_gone =
      session_.net->others().has_ended(*server.epoch()) || company_.shows_that_it_is_gone(since_s, clock_.now_s());
  if (!is_silent) waits_ = false;
  if (!is_gone) gone_since_s_.reset();
  if (is_gone && !gone_since_s_) gone_since_s_ = clock_.now_s();
  if (is_silent && !is_gone && !waits_ && server.silence_s() > kCutOff_s) {
    waits_ = true;
    log_warning("hears neither the server nor the hands of the session: it waits until somebody speaks");
  }
  return is_silent && is_gone && clock_.now_s() - *gone_since_s_ >= turn_s + (waits_ ? kBack_s : 0);
}

void Standby::hear_company() {
  clock_.look();
  const std::uint64_t hands = session_.net->hands_heard(), viewers = session_.net->viewers_heard();
  if (hands != hands_heard_) company_.hear_hand(clock_.now_s());
  if (viewers != viewers_heard_) company_.hear_viewer(clock_.now_s());
  hands_heard_ = hands, viewers_heard_ = viewers;
}

bool Standby::is_far_behind() const {
  const std::uint64_t newest = session_.net->follower().newest_step(), own = session_.run->steps();
  return newest > own && static_cast<double>(newest - own) * session_.scene.step_s > kMostLost_s;
}

// The server has begun anew or gone back, or has never had the last steps that this one has got of the server before.
// Most of the past is common: this one goes back a bit further than the server seems to have gone, and to the beginning
// if that was in vain.
void Standby::go_back(const std::string& why) {
  const Follower& server = session_.net->follower();
  if (chances_ == 0) throw std::runtime_error(why + ": this is no standby for it");
  const auto margin =
      static_cast<std::uint64_t>(kMostLost_s * std::max(1.0, session_.pace.speed()) / session_.scene.step_s);
  const std::uint64_t common = std::min(server.newest_step(), session_.run->steps());
  const bool to_the_beginning = chances_ == 1 || !session_.run->inputs() || common <= margin;
  chances_ = to_the_beginning ? 0 : 1;
  const std::uint64_t steps = to_the_beginning ? 0 : common - margin;
  log_info(why + ": this one goes back to step " + std::to_string(steps));
  LiveSession::Try next = session_.another_try(static_cast<double>(steps) * session_.scene.step_s);
  session_.run->recorder().finish();
  session_.begin(std::move(next));
  begin_after(steps);
  recent_.clear();
  last_inputs_.clear();
  in_step_ = false;
}

// Two programs that start in the same moment on a busy machine may know of each other in one direction alone, for good:
// Fast DDS sends what it believes to be known to a peer never again. A new participant is known to both.
void Standby::rejoin_if_servers_are_there() {
  if (session_.net->others().is_among_strangers())
    log_warning("the session's server has other bodies, and this one can't stand by for it: it waits for another one");
  else if (session_.net->servers_known() > 0)
    session_.net->rejoin("hears nothing of the server for which it stands by");
  else
    log_info("no server of the session is there yet");
}

// Poses and requests that the server may not have used when it dies. Orders may have come before this one was there.
void Standby::keep_news() {
  if (const auto status = session_.net->follower().take_status()) {
    knows_orders_ = true;
    session_.adopt({status->speed_set, status->speed == 0, status->frozen_tools});
  }
  hear_company();
  const std::size_t before = session_.input.samples.size();
  session_.net->take_samples(session_.input.samples);
  if (session_.input.samples.size() > before) company_.hear_hand(clock_.now_s());
  if (session_.input.samples.size() > kMostSamplesKept)
    session_.input.samples.erase(session_.input.samples.begin(), session_.input.samples.end() - kMostSamplesKept);
  for (const std::uint32_t tool : session_.net->take_silent_tools()) session_.silent.insert(tool);
  for (const SessionOrder& order : session_.net->take_orders()) session_.take(order);
}

void Standby::follow_step(const StepRecord& record) {
  if (const std::string why = difference(record, session_.run->simulation()); !why.empty())
    return go_back("step " + std::to_string(record.step) + ": " + why + " from that of the server");
  const auto start = std::chrono::steady_clock::now();
  const StepInput input = input_of(record);
  session_.run->begin_step(*session_.net->follower().epoch(), input);
  const StepOutput& output = session_.run->step(input);
  session_.run->end_step(output, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  session_.run->take_faults();
  session_.progress.show(output);
  for (const ToolPacket& packet : record.packets) {
    session_.silent.erase(packet.tool_id);
    std::erase_if(session_.input.samples, [&](const ToolSample& s) {
      return s.tool_id == packet.tool_id && s.source == packet.source && s.sequence <= packet.samples.back().sequence;
    });
  }
  if (record.turns_gravity) session_.input.gravity_m_per_s2.reset();
  if (!session_.run->inputs()) last_inputs_.push_back(record);
  if (last_inputs_.size() > InputFeed::kSteps) last_inputs_.pop_front();
  recent_.push_back({output.step, output.deltas, output.events});
  const auto kept = static_cast<std::uint64_t>(kRepeat_s / session_.scene.step_s);
  while (!recent_.empty() && recent_.front().step + kept < session_.net->follower().steps_sent()) recent_.pop_front();
}

void Standby::take_over() {
  const Follower& server = session_.net->follower();
  if (is_far_behind())
    throw std::runtime_error("the server died before this standby had caught up: " +
                             std::to_string(server.newest_step() - session_.run->steps()) +
                             " steps are missing; its own journal has them (--resume)");
  Succession succession = session_.succession(*server.epoch());
  for (const Recent& step : recent_) {
    succession.last_deltas.insert(succession.last_deltas.end(), step.deltas.begin(), step.deltas.end());
    succession.last_events.insert(succession.last_events.end(), step.events.begin(), step.events.end());
  }
  succession.last_steps = std::move(last_inputs_);
  session_.net->take_over(std::move(succession));
  recent_.clear();
  log_warning("the server fell silent: this one goes on after step " + std::to_string(session_.run->steps()));
}

}  // namespace sectio
