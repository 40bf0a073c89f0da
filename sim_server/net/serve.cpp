#include "sim_server/net/serve.h"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <stdexcept>
#include <thread>
#include <utility>

#include "common/core/error.h"
#include "common/core/log.h"
#include "common/messages/epoch.h"
#include "sim_server/net/live_server.h"
#include "sim_server/scene/scene_warnings.h"
#include "sim_server/session/trace_player.h"

namespace sectio {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr double kTogether_s = 0.1;      // the most by which a server may be ahead of the slowest one of its session
constexpr double kLeaveTimeout_s = 5;    // how long the end is served to viewers
constexpr double kListenToHolder_s = 1;  // before a session goes on: does another server hold it?
constexpr double kUnheard_s = 5;         // so long, when servers are there that have not been heard
constexpr double kListen_s = 0.3;        // before the clock starts: is there another server with our bodies?
constexpr auto kMostBehind = std::chrono::milliseconds(100);  // a journal that is played too fast is played slower
constexpr auto kStartPollPeriod = std::chrono::milliseconds(2);

volatile std::sig_atomic_t stop_requested = 0;

void request_stop(int) {
  stop_requested = 1;
}

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
double wait_for_the_slowest(const ServerNet& net, double sim_time_s) {
  const auto begun = Clock::now();
  const auto too_far = [&] {
    const std::optional<double> slowest_s = net.others().slowest_s();
    return slowest_s && sim_time_s > *slowest_s + kTogether_s;
  };
  if (!too_far()) return 0;
  while (!stop_requested && too_far()) std::this_thread::sleep_for(kStartPollPeriod);
  return Seconds(Clock::now() - begun).count();
}

// The reaction to a session that is behind its clock goes into the next step and, when it changes, into the log.
void answer_lag(BudgetPlanner& planner, double behind_s, StepInput& input) {
  const Budget budget = planner.plan(behind_s);
  input.spare_idle_bodies = budget == Budget::reduced;
  input.overrun.clear();
  if (budget == Budget::kept && !planner.changed()) return;
  char text[96];
  std::snprintf(text, sizeof text, "%s: %.0f ms behind", to_string(budget), 1e3 * std::max(0.0, behind_s));
  if (planner.changed()) input.overrun = text;
  log_limited(LogLevel::warning, to_string(budget), text);
}

std::string list_of(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

}  // namespace

bool stop_was_requested() {
  return stop_requested != 0;
}

LiveServer::LiveServer(const Scene& scene, const ServeOptions& options)
    : scene_(scene),
      options_(options),
      steps_(options.endless ? std::nullopt : std::optional(steps_of(scene, options.steps))),
      progress_(steps_),
      pace_(options.speed),
      planner_(!options.play_traces),
      stall_s_(options.stall_at_s >= 0 ? options.stall_s : 0) {
  const std::uint64_t last_step =
      options.until_s < 0 ? ~std::uint64_t{0} : static_cast<std::uint64_t>(options.until_s / scene.step_s);
  run_ = options.resume.empty()
             ? std::make_unique<SessionRun>(scene_, options.directory)
             : SessionRun::resumed(scene_, {options.resume, last_step}, options.directory, last_epoch_);
  if (!options.play.empty()) run_unseen(options.from_s);
  const double duration_s = steps_ ? std::max(scene.duration_s, static_cast<double>(*steps_) * scene.step_s) : HUGE_VAL;
  for (const std::string& text : scene_warnings(scene_, duration_s)) run_->recorder().warn(text);
  ServerNetOptions net_options;
  net_options.network = options.network;
  for (const ToolSpec& tool : scene_.tools)
    net_options.fastest_m_per_s.push_back(options.fastest_m_per_s > 0 ? options.fastest_m_per_s
                                                                      : tool.max_speed_m_per_s);
  net_options.standby = options.standby || last_epoch_;
  net_options.inputs = run_->inputs();
  if (!options.record.empty()) {
    const std::map<std::string, std::string> metadata{{kRecordHeader, to_json(run_->header())}};
    record_ = std::make_unique<SessionRecord>(options.record, metadata);
  }
  net_options.record = record_.get();
  net_ = std::make_unique<ServerNet>(net_options, scene_info_now(scene_, run_->simulation()),
                                     meshes_of(run_->simulation()));
  log_info("session '" + options.network.session + "' on domain " + std::to_string(options.network.domain));
}

RunResult LiveServer::run() {
  if (options_.standby) {
    if (!follow()) return run_->recorder().finish();
    take_over();
  } else {
    if (!options_.resume.empty()) go_on();
    wait_for_peers();
    log_info(last_epoch_ ? "the session goes on" : "the session begins");
  }
  lead();
  return finish();
}

// A session that somebody else holds, perhaps a standby, has gone on without the steps of this journal.
void LiveServer::go_on() {
  const auto begun = Clock::now();
  const auto listens = [&] {
    const double listened_s = Seconds(Clock::now() - begun).count();
    const bool unheard = net_->servers_known() > net_->others().count();
    return listened_s < (unheard ? kUnheard_s : kListenToHolder_s);
  };
  while (!stop_was_requested() && listens()) {
    if (net_->others().is_held())
      throw InputError("session '" + options_.network.session + "': another server holds it: nothing to resume");
    std::this_thread::sleep_for(kStartPollPeriod);
  }
  if (!last_epoch_) return;  // it had not begun
  const Simulation& now = run_->simulation();
  net_->take_over(
      {next_term(*last_epoch_), scene_info_now(scene_, now), meshes_of(now), {}, {}, run_->inputs(), record_.get()});
}

// Waits for viewers, tools and other servers.
void LiveServer::wait_for_peers() {
  std::set<std::uint32_t> tools;
  const auto listen_until = Clock::now() + steady_duration(kListen_s);
  const OtherServers& others = net_->others();
  const auto complete = [&] {
    return net_->viewers() >= options_.wait_for_viewers &&
           (!options_.wait_for_tools || tools.size() >= scene_.tools.size()) &&
           (!options_.wait_for_bodies || others.missing_bodies().empty());
  };
  if (!complete()) log_info("waiting for viewers and tools");
  if (options_.wait_for_bodies && !others.missing_bodies().empty())
    log_info("waiting for servers of " + list_of(others.missing_bodies()));
  while (!stop_was_requested() && (!complete() || Clock::now() < listen_until)) {
    yield_to_another_server(*net_, options_);
    input_.samples.clear();  // motion before the clock starts is not part of the session
    net_->take_samples(input_.samples);
    for (const ToolSample& s : input_.samples) tools.insert(s.tool_id);
    std::this_thread::sleep_for(kStartPollPeriod);
  }
}

void LiveServer::lead() {
  due_ = Clock::now();
  net_->set_speed(pace_.now());
  while (has_more_steps()) {
    yield_to_another_server(*net_, options_);
    for (const SessionOrder& order : net_->take_orders()) obey(order);
    if (pace_.is_paused()) {
      wait_in_pause();
      continue;
    }
    const double next_s = static_cast<double>(run_->steps() + 1) * scene_.step_s;
    if (const double waited_s = wait_for_the_slowest(*net_, next_s); waited_s > 0) {
      cost_.waited_for_servers_s += waited_s;
      due_ = Clock::now();
    }
    if (!take_input()) break;
    const auto start = Clock::now();
    run_step();
    if (planner_.now() == Budget::slowed) due_ = start;  // the session runs slower, not in bursts
    due_ += steady_duration(scene_.step_s / pace_.speed());
    std::this_thread::sleep_until(due_);
  }
}

void LiveServer::tell(EventKind kind, const std::string& text) {
  log_info(text);
  net_->tell({run_->steps(), kind, 0, 0, text.substr(0, kMaxEventTextBytes)});
}

// Keeps what an order sets, also in a standby, which tells nobody.
std::optional<Pace::News> LiveServer::take(const SessionOrder& order) {
  if (order.kind == OrderKind::tilt) input_.gravity_m_per_s2 = order.gravity_m_per_s2;
  return pace_.take(order);
}

void LiveServer::obey(const SessionOrder& order) {
  if (const auto news = take(order)) tell(news->kind, news->text);
  switch (order.kind) {
    case OrderKind::tilt:
      return;
    case OrderKind::pause:
    case OrderKind::go_on:
    case OrderKind::set_speed:
      due_ = Clock::now();
      return net_->set_speed(pace_.now());
    case OrderKind::begin_anew:
      begin_anew(0);
      return tell(EventKind::begun_anew, "the session begins anew");
    case OrderKind::seek:
      return go_back(order.sim_time_s);
    case OrderKind::tell_score:
      for (const std::string& line : run_->recorder().score_lines()) tell(EventKind::score_told, line);
      return;
  }
}

// Another try from an earlier moment, or what is played from another one.
void LiveServer::go_back(double to_s) {
  const double now_s = static_cast<double>(run_->steps()) * scene_.step_s;
  std::string why_not;
  if (!past_ && !run_->inputs()) why_not = "the session keeps no inputs to go back by (--export)";
  if (!past_ && to_s > now_s) why_not = "nobody knows what comes";
  try {
    if (why_not.empty()) begin_anew(to_s);
  } catch (const InputError& error) {
    why_not = error.what();
  }
  if (!why_not.empty()) return tell(EventKind::sought, "it stays where it is: " + why_not);
  char text[64];
  std::snprintf(text, sizeof text, "the session %s from %.2f s", past_ ? "is shown" : "goes on",
                static_cast<double>(run_->steps()) * scene_.step_s);
  tell(EventKind::sought, text);
}

// Poses that come meanwhile are not part of the session; that a hand has fallen silent is.
void LiveServer::wait_in_pause() {
  net_->take_samples(input_.samples);
  input_.samples.clear();
  for (const std::uint32_t tool : net_->take_silent_tools()) silent_.insert(tool);
  std::this_thread::sleep_for(kStartPollPeriod);
  due_ = Clock::now();
}

// Empty: it leaves nothing behind.
std::string LiveServer::directory_of(int attempt) const {
  if (options_.directory.empty() || attempt == 1) return options_.directory;
  return options_.directory + "/try_" + std::to_string(attempt);
}

// The try so far keeps its files; the next one has a directory of its own in it. Viewers learn of it as of a server
// that takes the session over: bodies of another term are asked for anew.
void LiveServer::begin_anew(double from_s) {
  const std::string directory = directory_of(tries_ + 1);
  std::unique_ptr<SessionRun> next;
  if (past_ || from_s <= 0) {
    next = std::make_unique<SessionRun>(scene_, directory);
  } else {
    const auto last_step = static_cast<std::uint64_t>(std::llround(from_s / scene_.step_s));
    log_info("running " + std::to_string(last_step) + " steps again");
    std::optional<std::uint64_t> former_epoch;
    next = SessionRun::resumed(scene_, {directory_of(tries_), last_step}, directory, former_epoch);
  }
  ++tries_;
  for (const std::string& line : run_->recorder().score_lines()) tell(EventKind::score_told, line);
  run_->recorder().finish();
  // The network reads the journal of the former run until it is told of this one.
  const auto former = std::exchange(run_, std::move(next));
  if (record_) run_->recorder().warn(options_.record + ": ends where the session was begun anew");
  if (past_) run_unseen(from_s);
  const Simulation& now = run_->simulation();
  net_->take_over(
      {next_term(net_->epoch()), scene_info_now(scene_, now), meshes_of(now), {}, {}, run_->inputs(), nullptr});
  input_ = {};
  due_ = Clock::now();
  net_->set_speed(pace_.now());
}

// The steps of a journal that come before the ones to be seen.
void LiveServer::run_unseen(double until_s) {
  past_ = std::make_unique<InputLogReader>(options_.play);
  if (past_->header().state_hash != state_hash_of(run_->simulation()))
    throw InputError(options_.play + ": the scene is not the one that it was made with");
  while (static_cast<double>(run_->steps()) * scene_.step_s < until_s && take_past_input()) {
    run_->begin_step(0, input_);
    run_->end_step(run_->step(input_), 0);
  }
}

// False at the end, and where the simulation isn't the one that was recorded.
bool LiveServer::take_past_input() {
  const std::optional<StepInputs> inputs = past_->next();
  if (!inputs) {
    if (!past_->damage().empty()) run_->recorder().warn(past_->damage());
    return false;
  }
  const StepRecord& record = inputs->steps.front();
  const std::string why = difference(record, run_->simulation());
  if (!why.empty()) run_->recorder().warn("step " + std::to_string(record.step) + ": " + why);
  input_ = input_of(record);
  return why.empty();
}

// False when there is no further step.
bool LiveServer::take_input() {
  if (past_) {
    if (Clock::now() - due_ > kMostBehind) due_ = Clock::now();
    return take_past_input();
  }
  answer_lag(planner_, Seconds(Clock::now() - due_).count(), input_);
  if (options_.play_traces)
    input_.samples = samples_of_traces(scene_, run_->steps() + 1);
  else
    net_->take_samples(input_.samples);
  input_.withdrawn = net_->take_silent_tools();
  input_.withdrawn.insert(input_.withdrawn.end(), silent_.begin(), silent_.end());
  silent_.clear();
  return true;
}

void LiveServer::run_step() {
  const auto start = Clock::now();
  StepRecord record = run_->begin_step(net_->epoch(), input_);
  const StepOutput& output = run_->step(input_);
  if (stall_s_ > 0 && output.sim_time_s >= options_.stall_at_s)
    std::this_thread::sleep_for(Seconds(std::exchange(stall_s_, 0)));
  const double step_wall_time_s = Seconds(Clock::now() - start).count();
  run_->end_step(output, step_wall_time_s);
  view_world(run_->simulation(), scene_.tools.size(), world_);
  const auto published = Clock::now();
  for (const std::string& fault : run_->take_faults())
    net_->tell({output.step, EventKind::recording_stopped, 0, 0, fault.substr(0, kMaxEventTextBytes)});
  net_->publish(output, world_, step_wall_time_s, std::move(record));
  run_->recorder().add_publish(Seconds(Clock::now() - published).count());
  progress_.show(output);
  input_.samples.clear();
  input_.gravity_m_per_s2.reset();
}

RunResult LiveServer::finish() {
  net_->end_session(stop_was_requested() ? "stopped" : "complete");
  if (const std::uint32_t lost = net_->lost_viewers(); lost > 0)
    log_info("waiting for viewers that went silent: " + std::to_string(lost));
  net_->wait_for_viewers_to_leave(kLeaveTimeout_s);
  cost_.copy_bytes = net_->copy_bytes();
  cost_.network_total_s = net_->busy_s();
  cost_.deferred_steps = planner_.steps(Budget::deferred);
  cost_.reduced_steps = planner_.steps(Budget::reduced);
  cost_.slowed_steps = planner_.steps(Budget::slowed);
  cost_.most_behind_s = planner_.most_behind_s();
  run_->recorder().set(cost_);
  return run_->recorder().finish();
}

void catch_stop_signals() {
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
}

RunResult serve(const Scene& scene, const ServeOptions& options) {
  catch_stop_signals();
  return LiveServer(scene, options).run();
}

}  // namespace sectio
