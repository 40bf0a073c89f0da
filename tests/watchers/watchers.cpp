// Measures a gateway: how many of the states that a session publishes reach each of many watchers, and what that costs;
// and how soon a wish is answered by a state, and by a force.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <set>
#include <sstream>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "common/core/wall_time.h"
#include "common/messages/codec.h"
#include "common/messages/contact.h"
#include "common/messages/live.h"
#include "common/messages/live_frame.h"
#include "common/messages/state.h"
#include "common/messages/tool.h"
#include "common/messages/topology.h"
#include "tests/watchers/socket.h"

namespace sectio::watchers {
namespace {

constexpr double kPatience_s = 60, kAskAgain_s = 0.3;

struct Options {
  int port = 0;
  std::uint32_t watchers = 50, process = 0;
  double seconds = 10;
  std::string token;
  std::uint32_t wishes = 0;
};

template <class Message>
std::vector<std::uint8_t> framed(LiveKind kind, const Message& message) {
  std::vector<std::uint8_t> frame;
  append_live(kind, encode(message), frame);
  return frame;
}

double processor_s(std::uint32_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/stat");
  std::string text;
  std::getline(file, text);
  const std::size_t name_end = text.rfind(')');
  if (process == 0 || name_end == std::string::npos) return 0;
  std::istringstream rest(text.substr(name_end + 2));
  std::string word;
  std::array<double, 15> values{};
  for (std::size_t i = 3; i <= 15 && rest >> word; ++i)
    if (i >= 14) values[i - 1] = std::strtod(word.c_str(), nullptr);
  return (values[13] + values[14]) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  std::ranges::sort(values);
  return values[std::min(values.size() - 1, static_cast<std::size_t>(q * static_cast<double>(values.size())))];
}

struct Watcher {
  std::optional<SceneInfo> scene;
  std::size_t states = 0, keyframe_bytes = 0;
  std::uint64_t bytes = 0;
};

void watch(const Options& o) {
  std::vector<Watcher> watchers(o.watchers);
  std::set<std::uint64_t> published;  // steps that anybody has heard of
  bool counts = false;
  Sockets sockets(o.port, o.watchers, [&](std::size_t which, const std::vector<std::uint8_t>& frame) {
    Watcher& w = watchers[which];
    w.bytes += counts ? frame.size() : 0;
    LiveFrameReader reader(frame);
    while (const auto message = reader.next()) {
      if (message->kind == LiveKind::keyframe_chunk) w.keyframe_bytes += message->bytes.size();
      if (message->kind == LiveKind::scene) w.scene = decode<SceneInfo>(message->bytes);
      if (message->kind != LiveKind::state_header || !counts) continue;
      const auto header = decode<StateHeader>(message->bytes);
      if (!header) continue;
      ++w.states;
      published.insert(header->step);
    }
  });
  const auto has_keyframe = [](const Watcher& w) { return w.keyframe_bytes > 0; };
  double asked_s = 0;
  for (const double end_s = steady_now_s() + kPatience_s; !std::ranges::all_of(watchers, has_keyframe);) {
    sockets.run_once();
    // The gateway may not have the bodies yet: a page asks again, too.
    for (std::size_t i = 0; steady_now_s() - asked_s > kAskAgain_s && i < watchers.size(); ++i)
      for (std::uint32_t body = 0; watchers[i].scene && body < watchers[i].scene->bodies.size(); ++body)
        if (!has_keyframe(watchers[i]))
          sockets.send(i, framed(LiveKind::keyframe_request, KeyframeRequest{watchers[i].scene->epoch, body}));
    if (steady_now_s() - asked_s > kAskAgain_s) asked_s = steady_now_s();
    if (steady_now_s() > end_s) throw InputError("not all watchers have got a keyframe");
  }
  counts = true;
  const double begun_s = steady_now_s(), processor_before_s = processor_s(o.process);
  while (steady_now_s() < begun_s + o.seconds) sockets.run_once();
  const double time_s = steady_now_s() - begun_s, processor = processor_s(o.process) - processor_before_s;
  double sum = 0, bytes = 0, least = 1;
  for (const Watcher& w : watchers) {
    const double share = static_cast<double>(w.states) / std::max<double>(1, static_cast<double>(published.size()));
    sum += share;
    least = std::min(least, share);
    bytes += static_cast<double>(w.bytes);
  }
  std::printf("| %u | %.1f | %.1f %% | %.1f %% | %.1f | %.2f |\n", o.watchers,
              static_cast<double>(published.size()) / time_s, 100 * sum / o.watchers, 100 * least,
              1e-6 * bytes / time_s, processor / time_s);
}

// One person with a probe: it hovers and moves sideways, then presses.
class Person {
 public:
  explicit Person(const Options& o)
      : options_(o), sockets_(o.port, 1, [this](std::size_t, const auto& frame) { hear(frame); }) {}

  void measure() {
    sockets_.send(0, framed(LiveKind::hello, Hello{"clock", options_.token}));
    wait("a scene", [&] { return scene_.has_value(); });
    sockets_.send(0, framed(LiveKind::claim, ToolClaim{0, ClaimAction::take}));
    wish_m_ = scene_->camera.target_world_m + Vec3(0, 0, 0.06);
    wait_wishing("the probe in hand", [&] { return (tip_m_ - wish_m_).norm() < 0.001; });
    std::vector<double> to_state_s, to_force_s;
    for (std::uint32_t i = 0; i < options_.wishes; ++i) {
      const Vec3 before_m = tip_m_;
      wish_m_.x() += i % 2 == 0 ? 0.01 : -0.01;
      to_state_s.push_back(time_until([&] { return (tip_m_ - before_m).norm() > 0.0005; }));
      rest();
    }
    while (force_n_ < 0.05) {
      wish_m_.z() -= 0.0005;
      rest(kGoDown_s);
      if (wish_m_.z() < scene_->camera.target_world_m.z() - 0.1) throw InputError("the probe meets no tissue");
    }
    wish_m_.z() -= 0.002;
    rest();
    for (std::uint32_t i = 0; i < options_.wishes; ++i) {
      const double before_n = force_n_;
      wish_m_.z() += i % 2 == 0 ? -0.003 : 0.003;
      to_force_s.push_back(time_until([&] { return std::abs(force_n_ - before_n) > 0.02; }));
      rest();
    }
    std::printf("| a state in which the instrument has moved 0.5 mm | %.0f ms | %.0f ms |\n",
                1000 * quantile(to_state_s, 0.5), 1000 * quantile(to_state_s, 0.99));
    std::printf("| a force that has changed by 20 mN | %.0f ms | %.0f ms |\n", 1000 * quantile(to_force_s, 0.5),
                1000 * quantile(to_force_s, 0.99));
  }

 private:
  static constexpr double kRest_s = 0.3, kGoDown_s = 0.03, kWish_s = 0.016;

  void hear(const std::vector<std::uint8_t>& frame) {
    LiveFrameReader reader(frame);
    while (const auto message = reader.next()) {
      if (message->kind == LiveKind::scene) scene_ = decode<SceneInfo>(message->bytes);
      if (message->kind == LiveKind::state_header)
        if (const auto header = decode<StateHeader>(message->bytes); header && !header->tools.empty())
          tip_m_ = header->tools[0].pose_world.position_m;
      if (message->kind == LiveKind::contact)
        if (const auto contact = decode<ContactMessage>(message->bytes); contact && contact->model.tool_id == 0)
          force_n_ = contact->model.force_world_n.norm();
    }
  }
  template <class Condition>
  void wait(const char* what, const Condition& condition) {
    for (const double end_s = steady_now_s() + kPatience_s; !condition(); sockets_.run_once())
      if (steady_now_s() > end_s) throw InputError(std::string("waited in vain for ") + what);
  }
  template <class Condition>
  void wait_wishing(const char* what, const Condition& condition) {
    wait(what, [&] {
      if (steady_now_s() - wished_s_ > kWish_s) wish();
      return condition();
    });
  }
  void wish() {
    wished_s_ = steady_now_s();
    sockets_.send(0, framed(LiveKind::wish, ToolWish{0, 0, ++sequence_, JointPose{Pose{wish_m_}}, true}));
  }
  template <class Condition>
  double time_until(const Condition& condition) {
    const double begun_s = steady_now_s();
    wish();
    wait_wishing("an answer to a wish", condition);
    return steady_now_s() - begun_s;
  }
  void rest(double time_s = kRest_s) {
    const double end_s = steady_now_s() + time_s;
    wait_wishing("rest", [&] { return steady_now_s() > end_s; });
  }

  Options options_;
  std::optional<SceneInfo> scene_;
  Vec3 tip_m_ = Vec3::Constant(1e9), wish_m_ = Vec3::Zero();
  double force_n_ = 0, wished_s_ = 0;
  std::uint64_t sequence_ = 0;
  Sockets sockets_;
};

int run(int argc, char** argv) {
  Options o;
  Arguments arguments("watchers", "Measures a gateway on this machine.");
  arguments.option("--port", o.port, "of the gateway", Need::required);
  arguments.option("--watchers", o.watchers, "browsers' worth of sockets");
  arguments.option("--seconds", o.seconds, "time to watch");
  arguments.option("--process", o.process, "id of the gateway's process, for its processor time");
  arguments.option("--token", o.token, "of the gateway, for --wishes");
  arguments.option("--wishes", o.wishes, "measures how soon so many wishes are answered, instead of watching");
  if (!arguments.parse(argc, argv)) return 0;
  if (o.wishes > 0)
    Person(o).measure();
  else
    watch(o);
  return 0;
}

}  // namespace
}  // namespace sectio::watchers

int main(int argc, char** argv) {
  return sectio::run_program("watchers", [&] { return sectio::watchers::run(argc, argv); });
}
