#include "sim_server/net/live_server.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <thread>
#include <utility>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/joined.h"
#include "common/core/log.h"
#include "common/messages/epoch.h"
#include "sim_server/net/order.h"
#include "sim_server/net/standby.h"
#include "sim_server/net/standing_orders.h"
#include "sim_server/session/run_files.h"
#include "sim_server/session/trace_player.h"

namespace sectio {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr double kTogether_s = 0.1;  // the most by which a server may be ahead of the slowest one of its session
constexpr double kElsewhere_m = 0.002, kElsewhere_rad = 0.1;  // a hand that rests in a pause moves by less
constexpr double kLongestTask_s = 3600;  // steps that are run again, a report: nobody takes that for a hang
constexpr double kListenToHolder_s = 1;  // before a session goes on: does another server hold it?
constexpr double kUnheard_s = 5;         // so long, when servers are there that have not been heard
constexpr double kListen_s = 0.3;        // before the clock starts: is there another server with our bodies?
constexpr auto kMostBehind = std::chrono::milliseconds(100);  // a journal that is played too fast is played slower
constexpr auto kStartPollPeriod = std::chrono::milliseconds(2);
constexpr auto kRefusedTellPeriod = std::chrono::seconds(1);

Clock::duration steady_duration(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(Seconds(seconds));
}

void yield_to_another_server(const ServerNet& net, const ServeOptions& options) {
  if (net.others().is_replaced())
    throw std::runtime_error("session '" + options.network.session +
                             "': another server has taken it over: this one stands down");
  if (const auto body = net.others().claimed_body())
    throw InputError("session '" + options.network.session + "': another server has the body '" + *body + "'");
}

// Waits for servers that are too far behind this one. Returns the seconds that it took.
double wait_for_the_slowest(ServerNet& net, double sim_time_s) {
  const auto begun = Clock::now();
  const auto too_far = [&] {
    const std::optional<double> slowest_s = net.others().slowest_s();
    return slowest_s && sim_time_s > *slowest_s + kTogether_s;
  };
  if (!too_far()) return 0;
  while (!stop_was_requested() && too_far()) {
    net.show_life();
    std::this_thread::sleep_for(kStartPollPeriod);
  }
  return Seconds(Clock::now() - begun).count();
}

// The reaction to a session that is behind its clock goes into the next step and, when it changes, into the log.
void answer_lag(BudgetPlanner& planner, double behind_s, StepInput& input) {
  const Budget budget = planner.plan(behind_s);
  input.spare_idle_bodies = budget == Budget::reduced;
  input.overrun.clear();
  if (budget == Budget::kept && !planner.changed()) return;
  const std::string text = budget == Budget::kept
                               ? "kept again"
                               : formatted("%s: %.0f ms behind", to_string(budget), 1e3 * std::max(0.0, behind_s));
  if (planner.changed()) input.overrun = text;
  log_limited(LogLevel::warning, to_string(budget), text);
}

bool is_elsewhere(const ToolSample& sample, const JointPose& pose) {
  return (sample.pose_world.position_m - pose.position_m).norm() > kElsewhere_m ||
         sample.pose_world.orientation.angularDistance(pose.orientation) > kElsewhere_rad ||
         std::abs(sample.opening_rad - pose.opening_rad) > kElsewhere_rad;
}

}  // namespace

LiveServer::LiveServer(const Scene& scene, const ServeOptions& options)
    : session_(scene, options),
      planner_(!options.play_traces),
      stall_s_(options.stall_at_s >= 0 ? options.stall_s : 0) {}

// A session that branches off elsewhere has none yet, nor has one that begins.
void LiveServer::recall_orders() {
  const std::string& directory = session_.options.directory;
  if (session_.options.resume != try_directory(directory, session_.options.attempt)) return keep_orders();
  StandingOrders orders;
  try {
    orders = kept_orders(directory);
  } catch (const InputError& error) {
    session_.run->recorder().not_ok(error.what());
  }
  if (orders.speed == 1) orders.speed = session_.pace.speed();  // --speed says it
  session_.adopt(orders);
}

void LiveServer::keep_orders() const {
  keep({session_.pace.speed(), session_.pace.is_paused(), session_.net->frozen_tools()}, session_.options.directory);
}

RunResult LiveServer::run() {
  if (session_.options.standby) {
    Standby standby(session_);
    if (!standby.follow()) return session_.run->recorder().finish();
    standby.take_over();
    keep_orders();
  } else {
    if (!session_.options.resume.empty()) go_on();
    recall_orders();
    wait_for_peers();
    log_info(session_.last_epoch ? "the session goes on" : "the session begins");
  }
  lead();
  return finish();
}

// A session that somebody else holds, perhaps a standby, has gone on without the steps of this journal.
void LiveServer::go_on() {
  const auto begun = Clock::now();
  const auto listens = [&] {
    const double listened_s = Seconds(Clock::now() - begun).count();
    const OtherServers& others = session_.net->others();
    const bool unheard = session_.net->servers_known() > others.count() + others.standbys();
    return listened_s < (unheard ? kUnheard_s : kListenToHolder_s);
  };
  while (!stop_was_requested() && listens()) {
    if (session_.net->others().is_held())
      throw std::runtime_error("session '" + session_.options.network.session +
                               "': another server holds it: nothing to resume");
    std::this_thread::sleep_for(kStartPollPeriod);
  }
  if (!session_.last_epoch) return;  // it had not begun
  session_.net->take_over(session_.succession(*session_.last_epoch));
}

// Waits for viewers, tools and other servers.
void LiveServer::wait_for_peers() {
  std::set<std::uint32_t> tools;
  const auto listen_until = Clock::now() + steady_duration(kListen_s);
  const OtherServers& others = session_.net->others();
  const auto complete = [&] {
    return session_.net->viewers() >= session_.options.wait_for_viewers &&
           (!session_.options.wait_for_tools || tools.size() >= session_.scene.tools.size()) &&
           (!session_.options.wait_for_bodies || others.missing_bodies().empty());
  };
  if (!complete()) log_info("waiting for viewers and tools");
  if (session_.options.wait_for_bodies && !others.missing_bodies().empty())
    log_info("waiting for servers of " + joined(others.missing_bodies()));
  while (!stop_was_requested() && (!complete() || Clock::now() < listen_until)) {
    yield_to_another_server(*session_.net, session_.options);
    session_.input.samples.clear();  // motion before the clock starts is not part of the session
    session_.net->take_samples(session_.input.samples);
    for (const ToolSample& s : session_.input.samples) tools.insert(s.tool_id);
    std::this_thread::sleep_for(kStartPollPeriod);
  }
}

// Instruments of the steps that were run again are where they were; their hands may have gone meanwhile.
void LiveServer::expect_hands() {
  if (session_.past || session_.options.play_traces) return;
  for (std::uint32_t tool = 0; tool < session_.scene.tools.size(); ++tool)
    if (session_.run->simulation().tool_pose_world(tool)) session_.net->expect(tool);
}

void LiveServer::begin_term() {
  expect_hands();
  due_ = Clock::now();
  session_.net->set_pace(session_.pace);
  if (session_.pace.is_paused()) show_now();
}

void LiveServer::lead() {
  begin_term();
  while (session_.has_more_steps()) {
    yield_to_another_server(*session_.net, session_.options);
    if (const auto claim = session_.net->others().false_claim()) keep_session(*claim);
    obey_all(session_.net->take_orders());
    tell_of_refused_orders();
    if (session_.pace.is_paused()) {
      wait_in_pause();
      continue;
    }
    const double next_s = static_cast<double>(session_.run->steps() + 1) * session_.scene.step_s;
    // A body that an instrument touches is never held.
    if (const double waited_s = touched_ ? 0 : wait_for_the_slowest(*session_.net, next_s); waited_s > 0) {
      cost_.waited_for_servers_s += waited_s;
      due_ = Clock::now();
    }
    const bool comes_late = session_.net->others().furthest_s().value_or(0) > next_s + 2 * kTogether_s;
    if (!take_input()) break;
    const auto start = Clock::now();
    run_step();
    if (planner_.now() == Budget::slowed) due_ = start;  // the session runs slower, not in bursts
    due_ += steady_duration(session_.scene.step_s / session_.pace.speed());
    if (comes_late) due_ = Clock::now();  // it runs until it is where the others are
    std::this_thread::sleep_until(due_);
  }
}

void LiveServer::tell(EventKind kind, const std::string& text) {
  log_info(text);
  session_.net->tell({session_.run->steps(), kind, 0, 0, text.substr(0, kMaxEventTextBytes)});
}

void LiveServer::tell_faults() {
  if (const auto fault = session_.record ? session_.record->take_fault() : std::nullopt)
    session_.run->recorder().not_ok(*fault);
  for (const std::string& fault : session_.run->take_faults())
    session_.net->tell(
        {session_.run->steps(), EventKind::recording_stopped, 0, 0, fault.substr(0, kMaxEventTextBytes)});
}

void LiveServer::tell_score() {
  for (const std::string& line : session_.run->recorder().score_lines()) tell(EventKind::score_told, line);
}

void LiveServer::refuse(const SessionOrder& order, const std::string& why) {
  const std::string text = refusal(order, why);
  log_warning(text);
  session_.net->tell({session_.run->steps(), EventKind::order_refused, 0, 0, text.substr(0, kMaxEventTextBytes)});
}

// Once a second, how many came too fast meanwhile.
void LiveServer::tell_of_refused_orders() {
  const std::uint64_t refused = session_.net->orders_refused();
  if (refused == refused_told_ || Clock::now() < next_refused_) return;
  next_refused_ = Clock::now() + kRefusedTellPeriod;
  const auto news = static_cast<unsigned long long>(refused - std::exchange(refused_told_, refused));
  session_.net->tell({session_.run->steps(), EventKind::order_refused, 0, 0,
                      formatted("orders came too fast: %llu are not obeyed", news)});
}

// An order to go somewhere that came while the session was on its way elsewhere is left out when a later one goes there
// as well without it.
void LiveServer::obey_all(std::span<const SessionOrder> orders) {
  for (std::size_t i = 0; i < orders.size(); ++i)
    if (session_.why_not(orders[i]).empty() &&
        std::ranges::any_of(orders.subspan(i + 1), [&](const auto& later) { return stands_for(later, orders[i]); }))
      refuse(orders[i], "another one came at once, and is obeyed instead");
    else
      obey(orders[i]);
}

void LiveServer::obey(const SessionOrder& order) {
  if (const std::string why = session_.why_not(order); !why.empty()) return refuse(order, why);
  if (const auto news = session_.take(order)) {
    tell(news->kind, news->text);
    keep_orders();
  }
  switch (order.kind) {
    case OrderKind::tilt:
    case OrderKind::freeze:
    case OrderKind::thaw:
      return;
    case OrderKind::pause:
    case OrderKind::go_on:
    case OrderKind::set_speed:
      due_ = Clock::now();
      return session_.net->set_pace(session_.pace);
    case OrderKind::begin_anew:
    case OrderKind::seek:
      return go_to(order);
    case OrderKind::tell_score:
      return tell_score();
  }
}

// Another try from the beginning or from an earlier moment, or what is played from another one.
void LiveServer::go_to(const SessionOrder& order) {
  const bool anew = order.kind == OrderKind::begin_anew;
  session_.net->show_life(kLongestTask_s);
  LiveSession::Try next;
  try {
    next = session_.another_try(anew ? 0 : order.sim_time_s);
  } catch (const std::exception& error) {  // a disk that is full, a directory that is gone
    due_ = Clock::now();
    return refuse(order, std::string(kStays) + error.what());
  }
  begin(std::move(next));
  if (anew) {  // no instrument is in the scene at the beginning, and one that is frozen could never come into it
    for (std::uint32_t tool = 0; tool < session_.scene.tools.size(); ++tool) session_.net->set_frozen(tool, false);
    keep_orders();
  }
  displace_hands();
  if (anew) return tell(EventKind::begun_anew, "the session begins anew");
  tell(EventKind::sought,
       formatted("the session %s from %.2f s", session_.past ? "is shown" : "goes on", session_.time_s()));
}

// A hand that was in tissue is in tissue that isn't what it was.
void LiveServer::displace_hands() {
  if (!follows_hands()) return;
  for (std::uint32_t tool = 0; tool < session_.scene.tools.size(); ++tool)
    if (!is_frozen(session_.net->frozen_tools(), tool)) session_.displaced.insert(tool);
}

// Poses that come meanwhile are not part of the session; that a hand has fallen silent is.
void LiveServer::wait_in_pause() {
  session_.net->take_samples(session_.input.samples);
  for (const ToolSample& sample : session_.input.samples) {
    const auto& pose = session_.run->simulation().tool_pose_world(sample.tool_id);
    if (pose && is_elsewhere(sample, *pose))
      went_away_.insert(sample.tool_id);
    else
      went_away_.erase(sample.tool_id);
  }
  session_.input.samples.clear();
  for (const std::uint32_t tool : session_.net->take_silent_tools()) session_.silent.insert(tool);
  std::this_thread::sleep_for(kStartPollPeriod);
  due_ = Clock::now();
}

// Viewers see it as a takeover by another server: they ask for bodies of the new term. So does a standby.
void LiveServer::begin(LiveSession::Try next) {
  tell_score();
  session_.run->recorder().finish();
  tell_faults();
  const auto former = session_.begin(std::move(next));
  if (session_.record) session_.run->recorder().warn(session_.record_file + ": ends where the session was begun anew");
  Succession succession = session_.succession(session_.net->epoch());
  succession.record = nullptr;
  session_.net->take_over(std::move(succession));
  begin_term();
}

// The term after the claimed one, from the program that held the session before, settles who holds it (epoch_owners.h).
void LiveServer::keep_session(std::uint64_t claimed_epoch) {
  log_warning("a program that has not stood by claims the session: this server keeps it");
  session_.net->take_over(session_.succession(claimed_epoch));
  session_.net->set_pace(session_.pace);
  if (session_.pace.is_paused()) show_now();
}

// No step comes in a pause: a new term has told viewers nothing.
void LiveServer::show_now() {
  StepOutput output;
  output.step = session_.run->steps();
  output.sim_time_s = session_.time_s();
  output.publish_now = true;
  view_world(session_.run->simulation(), session_.scene.tools.size(), world_);
  session_.net->publish(output, world_, 0, std::nullopt);
}

// False when there is no further step.
bool LiveServer::take_input() {
  if (session_.past) {
    if (Clock::now() - due_ > kMostBehind) due_ = Clock::now();
    return session_.past->take(*session_.run, session_.input);
  }
  answer_lag(planner_, Seconds(Clock::now() - due_).count(), session_.input);
  if (session_.options.play_traces)
    session_.input.samples = samples_of_traces(session_.scene, session_.run->steps() + 1);
  else
    session_.net->take_samples(session_.input.samples);
  std::set<std::uint32_t> withdrawn = std::exchange(session_.silent, {});
  for (const std::uint32_t tool : session_.net->take_silent_tools()) withdrawn.insert(tool);
  if (follows_hands()) session_.displaced.merge(std::exchange(went_away_, {}));
  for (const std::uint32_t tool : std::exchange(session_.displaced, {})) {
    if (is_frozen(session_.net->frozen_tools(), tool)) continue;  // it is taken out when it thaws
    std::erase_if(session_.input.samples, [&](const ToolSample& sample) { return sample.tool_id == tool; });
    withdrawn.insert(tool);
  }
  session_.input.withdrawn.assign(withdrawn.begin(), withdrawn.end());
  return true;
}

void LiveServer::run_step() {
  const auto start = Clock::now();
  StepRecord record = session_.run->begin_step(session_.net->epoch(), session_.input);
  const StepOutput& output = session_.run->step(session_.input);
  if (stall_s_ > 0 && output.sim_time_s >= session_.options.stall_at_s)
    std::this_thread::sleep_for(Seconds(std::exchange(stall_s_, 0)));
  const double step_wall_time_s = Seconds(Clock::now() - start).count();
  session_.run->end_step(output, step_wall_time_s);
  touched_ =
      std::ranges::any_of(output.contacts, [](const ContactModel& model) { return model.state != ContactState::free; });
  view_world(session_.run->simulation(), session_.scene.tools.size(), world_);
  const auto published = Clock::now();
  tell_faults();
  session_.net->publish(output, world_, step_wall_time_s, std::move(record));
  session_.run->recorder().add_publish(Seconds(Clock::now() - published).count());
  session_.progress.show(output);
  session_.input.samples.clear();
  session_.input.gravity_m_per_s2.reset();
}

RunResult LiveServer::finish() {
  session_.net->show_life(kLongestTask_s);
  if (session_.scene.exercise) tell_score();
  session_.net->end_session(stop_was_requested() ? "stopped" : "complete");
  if (const std::uint32_t lost = session_.net->lost_viewers(); lost > 0)
    log_info("waiting for viewers that went silent: " + std::to_string(lost));
  session_.net->wait_for_viewers_to_leave();
  cost_.copy_bytes = session_.net->copy_bytes();
  cost_.network_total_s = session_.net->busy_s();
  cost_.deferred_steps = planner_.steps(Budget::deferred);
  cost_.reduced_steps = planner_.steps(Budget::reduced);
  cost_.slowed_steps = planner_.steps(Budget::slowed);
  cost_.most_behind_s = planner_.most_behind_s();
  cost_.orders_refused = session_.net->orders_refused();
  session_.run->recorder().set(cost_);
  session_.net.reset();  // its thread writes the record
  if (const auto fault = session_.record ? session_.record->finish() : std::nullopt)
    session_.run->recorder().not_ok(*fault);
  return session_.run->recorder().finish();
}

}  // namespace sectio
