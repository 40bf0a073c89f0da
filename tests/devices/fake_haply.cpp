// Speaks as Haply's service does, without a device: one state for each message, with a handle that plays a trace and
// gives way to force. On SIGUSR1 the trace begins. Prints its port, and at the end what it was told.
// usage: fake_haply TRACE.csv [PORT] [VERSION]
#include <libwebsockets.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

#include "common/core/arguments.h"
#include "common/core/error.h"
#include "common/core/wall_time.h"
#include "common/math/trace.h"

namespace {

using nlohmann::json;
using namespace sectio;

constexpr double kGivesWay_n_per_m = 450;  // a hand that holds it gives way so

volatile std::sig_atomic_t stopped = 0, begun = 0;

struct Service {
  std::vector<TracePoint> trace;
  std::string version;
  double begun_s = -1;
  int messages = 0, answers_due = 0;
  bool inventory_due = false, introduced = false;
  double largest_n = 0;
  Vec3 force_n = Vec3::Zero();
  std::string incoming, key;

  json state() {
    if (begun && begun_s < 0) begun_s = steady_now_s();
    const Pose pose = pose_at(trace, begun_s < 0 ? 0 : steady_now_s() - begun_s);
    const Vec3 at_m = pose.position_m + force_n / kGivesWay_n_per_m;
    Mat3 instrument;  // the axes of an instrument in those of a grip
    instrument << 0, -1, 0, 0, 0, -1, 1, 0, 0;
    const Eigen::Quaterniond grip = pose.orientation * Eigen::Quaterniond(instrument).conjugate();
    const json inverse3 = {{"device_id", "049D"},
                           {"state",
                            {{"cursor_position", {{"x", at_m.x()}, {"y", at_m.y()}, {"z", at_m.z()}}},
                             {"cursor_velocity", {{"x", 0.0}, {"y", 0.0}, {"z", 0.0}}}}}};
    const json verse_grip = {{"device_id", "61548"},
                             {"state",
                              {{"orientation", {{"w", grip.w()}, {"x", grip.x()}, {"y", grip.y()}, {"z", grip.z()}}},
                               {"buttons", {{"a", false}, {"b", false}, {"c", false}}}}}};
    return {{"inverse3", json::array({inverse3})}, {"wireless_verse_grip", json::array({verse_grip})}};
  }

  void hear(const std::string& text) {
    const json message = json::parse(text);
    introduced = introduced || message.contains("/session/configure/profile/name"_json_pointer);
    const json& command = message.at("inverse3").at(0);
    if (command.at("device_id") != "049D") std::abort();
    key = command.at("commands").at("set_cursor_force").begin().key();
    const json& force = command.at("commands").at("set_cursor_force").begin().value();
    force_n = Vec3(force.at("x"), force.at("y"), force.at("z"));
    largest_n = std::max(largest_n, force_n.norm());
    ++messages;
    ++answers_due;
  }
};

int write_text(lws* wsi, const std::string& text, lws_write_protocol kind) {
  std::vector<unsigned char> padded(LWS_PRE + text.size());
  std::copy(text.begin(), text.end(), padded.begin() + LWS_PRE);
  return lws_write(wsi, padded.data() + LWS_PRE, text.size(), kind) < static_cast<int>(text.size()) ? -1 : 0;
}

int callback(lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t size) {
  auto* service = wsi ? static_cast<Service*>(lws_context_user(lws_get_context(wsi))) : nullptr;
  if (!service) return 0;
  switch (reason) {
    case LWS_CALLBACK_HTTP: {
      std::array<unsigned char, LWS_PRE + 1024> buffer;
      unsigned char *start = buffer.data() + LWS_PRE, *at = start, *end = buffer.data() + buffer.size();
      const std::string body = json{{"project_version", service->version}}.dump();
      if (lws_add_http_common_headers(wsi, HTTP_STATUS_OK, "application/json", body.size(), &at, end) ||
          lws_finalize_write_http_header(wsi, start, &at, end))
        return -1;
      lws_callback_on_writable(wsi);
      return 0;
    }
    case LWS_CALLBACK_HTTP_WRITEABLE:
      if (write_text(wsi, json{{"project_version", service->version}}.dump(), LWS_WRITE_HTTP_FINAL)) return -1;
      return lws_http_transaction_completed(wsi) ? -1 : 0;
    case LWS_CALLBACK_ESTABLISHED:
      service->inventory_due = true;
      lws_callback_on_writable(wsi);
      return 0;
    case LWS_CALLBACK_RECEIVE:
      service->incoming.append(static_cast<const char*>(in), size);
      if (!lws_is_final_fragment(wsi) || lws_remaining_packet_payload(wsi) > 0) return 0;
      service->hear(service->incoming);
      service->incoming.clear();
      lws_callback_on_writable(wsi);
      return 0;
    case LWS_CALLBACK_SERVER_WRITEABLE: {
      if (!service->inventory_due && service->answers_due == 0) return 0;
      json answer = service->state();
      if (service->inventory_due)
        answer["session_id"] = 7;
      else
        --service->answers_due;
      service->inventory_due = false;
      if (service->answers_due > 0) lws_callback_on_writable(wsi);
      return write_text(wsi, answer.dump(), LWS_WRITE_TEXT);
    }
    default:
      return 0;
  }
}

int serve(int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') throw InputError("usage: fake_haply TRACE.csv [PORT] [VERSION]");
  Service service;
  service.trace = load_trace(argv[1]);
  service.version = argc > 3 ? argv[3] : "3.5.0.0";
  std::signal(SIGTERM, [](int) { stopped = 1; });
  std::signal(SIGUSR1, [](int) { begun = 1; });
  std::array<lws_protocols, 2> protocols{};
  protocols[0].name = "http";
  protocols[0].callback = callback;
  lws_set_log_level(0, nullptr);
  lws_context_creation_info info{};
  info.port = argc > 2 ? std::atoi(argv[2]) : 0;
  info.iface = "127.0.0.1";
  info.protocols = protocols.data();
  info.user = &service;
  info.gid = info.uid = static_cast<decltype(info.gid)>(-1);
  info.options = LWS_SERVER_OPTION_DISABLE_IPV6 | LWS_SERVER_OPTION_EXPLICIT_VHOSTS;
  lws_context* context = lws_create_context(&info);
  lws_vhost* vhost = context ? lws_create_vhost(context, &info) : nullptr;
  if (!vhost) return 1;
  std::printf("port %d\n", lws_get_vhost_listen_port(vhost));
  std::fflush(stdout);
  while (!stopped && lws_service(context, 0) >= 0) {
  }
  std::printf("%d messages, largest force %.3f N, as %s, %s\n", service.messages, service.largest_n,
              service.key.c_str(), service.introduced ? "introduced" : "not introduced");
  lws_context_destroy(context);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return run_program("fake_haply", [&] { return serve(argc, argv); });
}
