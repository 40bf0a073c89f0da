#include "sim_server/net/play_record.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/log.h"
#include "common/core/stop_signal.h"
#include "common/messages/epoch.h"
#include "sim_server/net/order.h"
#include "sim_server/net/pace.h"
#include "sim_server/net/played_record.h"

namespace sectio {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kPeriod = std::chrono::milliseconds(2);
constexpr double kMostBehind_s = 0.1;  // a clock that was halted goes on from there

class RecordServer {
 public:
  explicit RecordServer(const ServeOptions& options) : options_(options), record_(options.play), pace_(options.speed) {
    if (options_.network.session.empty()) options_.network.session = record_.world().scene().session;
    if (options_.from_s > record_.end_s()) throw InputError("--from-s: the record ends at " + seconds(record_.end_s()));
    record_.seek(options_.from_s);
    ServerNetOptions net_options;
    net_options.network = options_.network;
    net_ = std::make_unique<ServerNet>(net_options, scene(), record_.world().meshes());
    bodies_count_ = record_.world().meshes().size();
    log_info("session '" + options_.network.session + "' on domain " + std::to_string(options_.network.domain));
  }

  int run() {
    if (net_->viewers() < options_.wait_for_viewers) log_info("waiting for viewers");
    while (!stop_was_requested() && net_->viewers() < options_.wait_for_viewers) listen();
    log_info("the record is shown from " + seconds(record_.time_s()) + " to " + seconds(record_.end_s()));
    net_->set_pace(pace_);
    net_->set_end(record_.end_s());
    show(true);
    Clock::time_point then = Clock::now();
    bool goes_on = true;
    while (goes_on && !stop_was_requested()) {
      listen();
      for (const SessionOrder& order : net_->take_orders()) obey(order);
      const Clock::time_point now = Clock::now();
      const double passed_s = std::chrono::duration<double>(now - then).count();
      then = now;
      if (pace_.is_paused()) continue;
      goes_on = record_.advance(record_.time_s() + pace_.speed() * std::min(passed_s, kMostBehind_s));
      if (record_.world().has_new_state() || !goes_on) show(!goes_on);
    }
    net_->end_session(stop_was_requested() ? "stopped" : "complete");
    net_->wait_for_viewers_to_leave();
    const bool differs = !goes_on && record_.world().differs_from_end();
    if (differs) log_error(options_.play + ": its bodies are others than those that it ends with");
    return differs || record_.is_damaged() ? kExitNotOk : 0;
  }

 private:
  static std::string seconds(double time_s) { return formatted("%.2f s", time_s); }

  SceneInfo scene() {
    SceneInfo scene = record_.world().scene();
    scene.session = options_.network.session;
    return scene;
  }

  void listen() {
    std::this_thread::sleep_for(kPeriod);
    std::vector<ToolSample> nobodys;
    net_->take_samples(nobodys);
    net_->take_silent_tools();
    if (const auto body = net_->others().claimed_body())
      throw InputError("session '" + options_.network.session + "': another server has the body '" + *body + "'");
  }

  void show(bool at_once) {
    PlayedWorld& world = record_.world();
    if (!world.can_be_shown()) return;
    if (world.has_jumped()) begin_term();
    StepOutput news = world.news();
    news.publish_now = at_once;
    // Bodies that were there at the beginning are no news.
    std::erase_if(news.new_bodies, [&](const NewBody& body) { return body.body_id < bodies_count_; });
    bodies_count_ += news.new_bodies.size();
    net_->name_bodies(scene().bodies);
    net_->publish(news, world.view(), 0);
    world.forget_news();
  }

  // Viewers learn of another moment as of a session that is begun anew: by another term of the server.
  void begin_term() {
    PlayedWorld& world = record_.world();
    bodies_count_ = world.meshes().size();
    net_->take_over(
        {.epoch = next_term(net_->epoch()), .scene = scene(), .meshes = world.meshes(), .steps = world.news().step});
    net_->set_pace(pace_);
    world.forget_deltas();
  }

  void tell(EventKind kind, const std::string& text) {
    log_info(text);
    net_->tell({record_.world().news().step, kind, 0, 0, text});
  }

  void refuse(const SessionOrder& order, const std::string& why) {
    tell(EventKind::order_refused, refusal(order, why));
  }

  void go_to(double sim_time_s, EventKind kind, const std::string& text) {
    record_.seek(sim_time_s);
    begin_term();
    show(true);
    tell(kind, text + seconds(record_.time_s()));
  }

  // The session would end there, for all: it waits.
  void go_to_end() {
    pace_.pause();
    go_to(record_.end_s(), EventKind::sought, "paused at the end of the record, ");
  }

  void obey(const SessionOrder& order) {
    const auto news = pace_.take(order);
    if (news) tell(news->kind, news->text);
    switch (order.kind) {
      case OrderKind::pause:
      case OrderKind::go_on:
      case OrderKind::set_speed:
        return net_->set_pace(pace_);
      case OrderKind::begin_anew:
        return go_to(0, EventKind::begun_anew, "the record is shown from its beginning, at ");
      case OrderKind::seek:
        if (order.sim_time_s >= record_.end_s()) return go_to_end();
        return go_to(order.sim_time_s, EventKind::sought, "the record is shown from ");
      case OrderKind::tell_score:
        return refuse(order, "a record is shown, not scored: sim_server replay simulates its inputs, and scores them");
      case OrderKind::freeze:
      case OrderKind::tilt:
        return refuse(order, "what is played again is as it was");
      case OrderKind::thaw:
        return;
    }
  }

  ServeOptions options_;
  PlayedRecord record_;
  std::unique_ptr<ServerNet> net_;
  std::size_t bodies_count_ = 0;  // bodies that viewers have been told of
  Pace pace_;
};

}  // namespace

int play_record(const ServeOptions& options) {
  catch_stop_signals();
  return RecordServer(options).run();
}

}  // namespace sectio
