#include "device_bridge/drivers/haply.h"

#include <libwebsockets.h>

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/core/error.h"
#include "common/core/latest_value.h"
#include "common/core/log.h"
#include "common/core/wall_time.h"

namespace sectio {
namespace {

using nlohmann::json;

constexpr double kSilence_s = 0.1;        // silence of the service before the device is lost
constexpr double kAnswer_s = 0.05;        // wait for an answer before another message goes out
constexpr lws_usec_t kAlive_us = 20'000;  // time between messages while no force is asked for
constexpr lws_usec_t kRetry_us = 500'000;
constexpr std::chrono::seconds kPatience{3};
constexpr double kFarthest_m = 10;
constexpr std::size_t kMaxMessageBytes = 1 << 20;

Vec3 vector_of(const json& xyz) {
  return {xyz.at("x").get<double>(), xyz.at("y").get<double>(), xyz.at("z").get<double>()};
}

// The pen of a grip points along its own y axis, away from the hand; its z axis is up while it points forwards, and
// forwards while it points down: there the sharp edge is.
Eigen::Quaterniond shaft_of(const json& wxyz) {
  const Eigen::Quaterniond grip(wxyz.at("w").get<double>(), wxyz.at("x").get<double>(), wxyz.at("y").get<double>(),
                                wxyz.at("z").get<double>());
  Mat3 instrument;
  instrument.col(0) = Vec3::UnitZ();
  instrument.col(1) = -Vec3::UnitX();
  instrument.col(2) = -Vec3::UnitY();
  if (!(grip.norm() > 0.5)) return Eigen::Quaterniond::Identity();
  return grip.normalized() * Eigen::Quaterniond(instrument);
}

// True from 3.5 on, where a force is a "vector"; before, it was "values".
bool names_vectors(const std::string& version_text) {
  const json version = json::parse(version_text, nullptr, false);
  const auto at = version.is_object() ? version.find("project_version") : version.end();
  if (!version.is_object() || at == version.end() || !at->is_string()) return true;
  const std::string text = at->get<std::string>();
  char* end = nullptr;
  const long major = std::strtol(text.c_str(), &end, 10);
  const long minor = *end == '.' ? std::strtol(end + 1, nullptr, 10) : 0;
  return major > 3 || (major == 3 && minor >= 5);
}

// For both threads: the servo's, and the one that talks to the service.
struct Mailbox {
  LatestValue<HandleState> states;
  LatestValue<Vec3> forces;
  std::atomic<double> heard_s{-1e300};
  std::atomic<bool> stop{false};

  // The thread that opens the device waits for its first state.
  std::mutex mutex;  // guards what follows
  std::condition_variable changed;
  std::string trouble;
  bool ready = false, failed = false;

  void report(const std::string& what, bool has_failed) {
    {
      const std::lock_guard lock(mutex);
      trouble = what;
      failed |= has_failed;
    }
    changed.notify_all();
  }
};

// The thread that talks to the service has this for itself, but for wake().
class Conversation {
 public:
  Conversation(const HaplySpec& spec, Mailbox& mailbox);
  ~Conversation() { lws_context_destroy(context_); }
  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;

  void run();
  void wake() { lws_cancel_service(context_); }  // from any thread: there is something in the mailbox

 private:
  struct Timer {
    lws_sorted_usec_list_t list{};  // first: the callback gets its address
    Conversation* conversation = nullptr;
  };

  static int callback(lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t size);
  static void on_retry(lws_sorted_usec_list_t* timer);
  static void on_alive(lws_sorted_usec_list_t* timer);

  void connect(const char* method);
  int hear_http(lws* wsi, lws_callback_reasons reason, void* in, std::size_t size);
  void fail(const std::string& why);
  void retry() { lws_sul_schedule(context_, 0, &retry_.list, on_retry, kRetry_us); }
  int receive(lws* wsi, const char* bytes, std::size_t size);
  void take(const json& message);
  void ask_to_send();
  int send(lws* wsi);

  const HaplySpec spec_;
  Mailbox& mailbox_;
  std::array<lws_protocols, 2> protocols_{};
  lws_context* context_ = nullptr;
  Timer retry_, alive_;
  lws* socket_ = nullptr;
  std::string version_, incoming_, device_id_;
  bool vectors_ = true, introduced_ = false, asked_ = false;
  double sent_s_ = -1e300, force_s_ = -1e300;
  Vec3 force_n_ = Vec3::Zero();
};

// For the servo thread.
class HaplyHandle : public Handle {
 public:
  explicit HaplyHandle(const HaplySpec& spec) : conversation_(spec, mailbox_) {
    thread_ = std::thread([this] { conversation_.run(); });
    if (const std::string why = wait_for_first_state(spec); !why.empty()) {
      end();
      throw InputError("--device haply: " + why);
    }
  }
  ~HaplyHandle() override { end(); }

  // The device's data sheet names 10 N for moments; this much it holds.
  DeviceLimits limits() const override { return {.largest_force_n = 8, .largest_moment_n_m = 0}; }
  bool latest(HandleState& state) override { return mailbox_.states.load(state); }
  void apply(const Vec3& force_n, const Vec3&) override {
    mailbox_.forces.store(force_n);
    conversation_.wake();
  }
  bool lost() const override { return steady_now_s() - mailbox_.heard_s > kSilence_s; }

 private:
  void end() {
    mailbox_.stop = true;
    conversation_.wake();
    thread_.join();
  }
  // The reason why there is none; empty: it is here.
  std::string wait_for_first_state(const HaplySpec& spec) {
    std::unique_lock lock(mailbox_.mutex);
    mailbox_.changed.wait_for(lock, kPatience, [&] { return mailbox_.ready || mailbox_.failed; });
    if (mailbox_.ready) return {};
    const std::string at = " at ws://" + spec.host + ":" + std::to_string(spec.port), &trouble = mailbox_.trouble;
    if (mailbox_.failed) return "no service answers" + at + " (" + trouble + "); Haply's own must run there";
    return "the service" + at + (trouble.empty() ? " says nothing" : " has " + trouble);
  }

  Mailbox mailbox_;
  Conversation conversation_;
  std::thread thread_;
};

Conversation::Conversation(const HaplySpec& spec, Mailbox& mailbox) : spec_(spec), mailbox_(mailbox) {
  protocols_[0].name = "haply";
  protocols_[0].callback = callback;
  protocols_[0].rx_buffer_size = 1 << 16;
  lws_set_log_level(0, nullptr);
  lws_context_creation_info info{};
  info.port = CONTEXT_PORT_NO_LISTEN;
  info.protocols = protocols_.data();
  info.user = this;
  info.gid = info.uid = static_cast<decltype(info.gid)>(-1);
  info.options = LWS_SERVER_OPTION_DISABLE_IPV6;
  info.timeout_secs = 2;
  context_ = lws_create_context(&info);
  if (!context_) throw InputError("--device haply: libwebsockets can't be started");
  retry_.conversation = alive_.conversation = this;
}

void Conversation::run() {
  connect("GET");
  on_alive(&alive_.list);
  while (!mailbox_.stop && lws_service(context_, 0) >= 0) {
  }
}

void Conversation::on_retry(lws_sorted_usec_list_t* timer) {
  reinterpret_cast<Timer*>(timer)->conversation->connect("GET");
}

// While nobody asks for a force, the service is asked for states all the same.
void Conversation::on_alive(lws_sorted_usec_list_t* timer) {
  Conversation& h = *reinterpret_cast<Timer*>(timer)->conversation;
  if (steady_now_s() - h.sent_s_ > 1e-6 * kAlive_us) h.ask_to_send();
  lws_sul_schedule(h.context_, 0, timer, on_alive, kAlive_us);
}

// First /version with "GET", then the WebSocket, without a method.
void Conversation::connect(const char* method) {
  lws_client_connect_info info{};
  info.context = context_;
  info.address = info.host = info.origin = spec_.host.c_str();
  info.port = spec_.port;
  info.path = method ? "/version" : "/";
  info.method = method;
  info.local_protocol_name = protocols_[0].name;
  if (method) version_.clear();
  if (!lws_client_connect_via_info(&info) && method) fail("no connection");
}

void Conversation::fail(const std::string& why) {
  socket_ = nullptr;
  mailbox_.report(why, true);
  if (!mailbox_.stop) retry();
}

int Conversation::hear_http(lws* wsi, lws_callback_reasons reason, void* in, std::size_t size) {
  if (reason == LWS_CALLBACK_RECEIVE_CLIENT_HTTP) {
    std::array<char, LWS_PRE + 4096> buffer;
    char* at = buffer.data() + LWS_PRE;
    int room = static_cast<int>(buffer.size() - LWS_PRE);
    return lws_http_client_read(wsi, &at, &room) < 0 ? -1 : 0;
  }
  if (reason == LWS_CALLBACK_RECEIVE_CLIENT_HTTP_READ && version_.size() + size < kMaxMessageBytes)
    version_.append(static_cast<const char*>(in), size);
  if (reason == LWS_CALLBACK_CLOSED_CLIENT_HTTP && !mailbox_.stop) {
    vectors_ = names_vectors(version_);
    connect(nullptr);
  }
  return reason == LWS_CALLBACK_COMPLETED_CLIENT_HTTP ? -1 : 0;  // the connection has done its work
}

int Conversation::callback(lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t size) {
  lws_context* context = wsi ? lws_get_context(wsi) : nullptr;
  auto* h = context ? static_cast<Conversation*>(lws_context_user(context)) : nullptr;
  if (!h) return 0;
  switch (reason) {
    case LWS_CALLBACK_RECEIVE_CLIENT_HTTP:
    case LWS_CALLBACK_RECEIVE_CLIENT_HTTP_READ:
    case LWS_CALLBACK_COMPLETED_CLIENT_HTTP:
    case LWS_CALLBACK_CLOSED_CLIENT_HTTP:
      return h->hear_http(wsi, reason, in, size);
    case LWS_CALLBACK_CLIENT_CONNECTION_ERROR:
      h->fail(in ? std::string(static_cast<const char*>(in)) : "refused");
      return 0;
    case LWS_CALLBACK_CLIENT_ESTABLISHED:
      h->socket_ = wsi;
      h->introduced_ = h->asked_ = false;
      h->incoming_.clear();
      return 0;
    case LWS_CALLBACK_CLIENT_RECEIVE:
      return h->receive(wsi, static_cast<const char*>(in), size);
    case LWS_CALLBACK_CLIENT_WRITEABLE:
      return h->send(wsi);
    case LWS_CALLBACK_CLIENT_CLOSED:
      h->fail("it has closed the connection");
      return 0;
    case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
      if (h->mailbox_.forces.load(h->force_n_)) {
        h->force_s_ = steady_now_s();
        h->ask_to_send();
      }
      return 0;
    default:
      return 0;
  }
}

int Conversation::receive(lws* wsi, const char* bytes, std::size_t size) {
  if (incoming_.size() + size > kMaxMessageBytes) return -1;
  incoming_.append(bytes, size);
  if (!lws_is_final_fragment(wsi) || lws_remaining_packet_payload(wsi) > 0) return 0;
  asked_ = false;
  try {
    take(json::parse(incoming_));
  } catch (const json::exception& error) {
    log_limited(LogLevel::warning, "haply",
                "--device haply: a message of the service makes no sense: " + std::string(error.what()));
  }
  incoming_.clear();
  return 0;
}

void Conversation::take(const json& message) {
  const json none = json::array();
  const json& arms = message.contains("inverse3") ? message.at("inverse3") : none;
  const auto arm = std::find_if(arms.begin(), arms.end(), [&](const json& each) {
    return spec_.id.empty() || each.at("device_id").get<std::string>() == spec_.id;
  });
  if (arm == arms.end()) {
    mailbox_.report(spec_.id.empty() ? "no Inverse3" : "no Inverse3 with the id '" + spec_.id + "'", false);
    return;
  }
  device_id_ = arm->at("device_id").get<std::string>();
  HandleState state;
  state.pose.position_m = vector_of(arm->at("state").at("cursor_position"));
  if (!(state.pose.position_m.cwiseAbs().maxCoeff() < kFarthest_m)) return;
  for (const char* kind : {"wireless_verse_grip", "verse_grip"}) {
    if (!message.contains(kind) || message.at(kind).empty()) continue;
    const json& grip = message.at(kind).at(0).at("state");
    if (grip.contains("orientation")) state.pose.orientation = shaft_of(grip.at("orientation"));
    if (grip.contains("button")) state.buttons.grip = grip.at("button").get<bool>();
    if (grip.contains("buttons"))
      state.buttons = {grip.at("buttons").value("b", false), grip.at("buttons").value("a", false)};
    break;
  }
  mailbox_.states.store(state);
  mailbox_.heard_s = steady_now_s();
  const std::lock_guard lock(mailbox_.mutex);
  if (!std::exchange(mailbox_.ready, true)) mailbox_.changed.notify_all();
}

// One message is under way at a time; the service answers each with a state.
void Conversation::ask_to_send() {
  if (!socket_ || device_id_.empty() || (asked_ && steady_now_s() - sent_s_ < kAnswer_s)) return;
  asked_ = true;
  sent_s_ = steady_now_s();
  lws_callback_on_writable(socket_);
}

int Conversation::send(lws* wsi) {
  if (steady_now_s() - force_s_ > kAnswer_s) force_n_.setZero();  // the servo has stopped
  json force{{"x", force_n_.x()}, {"y", force_n_.y()}, {"z", force_n_.z()}};
  json message{{"inverse3",
                {{{"device_id", device_id_},
                  {"commands", {{"set_cursor_force", {{vectors_ ? "vector" : "values", std::move(force)}}}}}}}}};
  if (!introduced_) message["session"] = {{"configure", {{"profile", {{"name", "sectio"}}}}}};
  introduced_ = true;
  const std::string text = message.dump();
  std::vector<unsigned char> padded(LWS_PRE + text.size());
  std::copy(text.begin(), text.end(), padded.begin() + LWS_PRE);
  return lws_write(wsi, padded.data() + LWS_PRE, text.size(), LWS_WRITE_TEXT) < static_cast<int>(text.size()) ? -1 : 0;
}

}  // namespace

std::unique_ptr<Handle> open_haply(const HaplySpec& spec) {
  return std::make_unique<HaplyHandle>(spec);
}

}  // namespace sectio
