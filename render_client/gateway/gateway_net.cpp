#include "render_client/gateway/gateway_net.h"

#include "common/core/log.h"
#include "common/core/unique_id.h"
#include "common/core/wall_time.h"
#include "common/dds/endpoints.h"
#include "common/messages/link.h"
#include "common/messages/session_servers.h"

namespace sectio {

constexpr double kReportInterval_s = 0.5;

struct GatewayNet::Wire {
  explicit Wire(const NetworkOptions& options) : endpoints(options, "gateway") {}

  Endpoints<Reads<SceneInfo, DeltaMessage, KeyframeChunk, StateHeader, StatePiece, ScalarPiece, SessionEvent,
                  ServerStatus, ContactMessage, SessionEnd>,
            Writes<KeyframeRequest, ToolWish, SessionOrder, LinkReport>>
      endpoints;
  std::uint64_t client = unique_id(kProgramIdBits);
  SessionServers servers;
  bool any_scene = false;
  LinkClock clock;
  Ages ages;
  LinkReport link;
  int states = 0;  // since the last report
  double reported_s = steady_now_s();

  void hear(const StateHeader& header) {
    ++states;
    if (clock.known()) ages.add(steady_now_s() + clock.offset_s() - header.sent_s);
  }
  void report();

  template <class Message>
  void pass_on(Gateway& gateway) {
    while (auto message = endpoints.take<Message>()) gateway.feed(std::move(*message));
  }
};

GatewayNet::GatewayNet(const NetworkOptions& options) : wire_(std::make_unique<Wire>(options)) {}

GatewayNet::~GatewayNet() = default;

void GatewayNet::poll(Gateway& gateway) {
  Wire& w = *wire_;
  w.endpoints.renew_after_sleep();
  while (const auto scene = w.endpoints.take<SceneInfo>()) {
    w.any_scene = true;
    w.servers.hear(scene->epoch, steady_now_s());
    gateway.feed(*scene);
  }
  if (!w.any_scene) return;  // the readers keep what comes before the scene
  // Pieces before their header: then a browser gets both in one round.
  w.pass_on<DeltaMessage>(gateway);
  w.pass_on<KeyframeChunk>(gateway);
  w.pass_on<StatePiece>(gateway);
  w.pass_on<ScalarPiece>(gateway);
  while (auto header = w.endpoints.take<StateHeader>()) {
    w.hear(*header);
    gateway.feed(*header);
  }
  w.pass_on<SessionEvent>(gateway);
  while (auto status = w.endpoints.take<ServerStatus>()) {
    w.clock.hear(steady_now_s(), w.client, *status);
    w.servers.hear(status->epoch, steady_now_s());
    gateway.feed(*status);
  }
  w.pass_on<ContactMessage>(gateway);
  while (const auto end = w.endpoints.take<SessionEnd>()) {
    w.servers.end(end->epoch);
    gateway.feed(*end);
  }
}

void GatewayNet::Wire::report() {
  const double now_s = steady_now_s(), span_s = now_s - reported_s;
  if (span_s < kReportInterval_s) return;
  link.client = client;
  link.name = "gateway";
  link.rate_hz = kStateRates_hz.front();
  link.came_per_s = states / span_s;
  ages.take(link);
  clock.stamp(now_s, link);
  if (!endpoints.write(link)) log_limited(LogLevel::warning, "report", "DDS refused to send a report");
  reported_s = now_s;
  states = 0;
}

void GatewayNet::send(Gateway& gateway, double now_s) {
  wire_->report();
  for (KeyframeRequest request : gateway.take_requests(now_s)) {
    request.client = wire_->client;
    if (!wire_->endpoints.write(request)) log_limited(LogLevel::warning, "request", "DDS refused a keyframe request");
  }
  for (const ToolWish& wish : gateway.take_wishes())
    if (!wire_->endpoints.write(wish)) log_limited(LogLevel::warning, "wish", "DDS refused a wish");
  for (const SessionOrder& order : gateway.take_orders())
    if (!wire_->endpoints.write(order)) log_limited(LogLevel::warning, "order", "DDS refused an order");
}

bool GatewayNet::connected() const {
  return wire_->endpoints.met();
}

bool GatewayNet::session_ended() const {
  return wire_->servers.all_ended(steady_now_s());
}

}  // namespace sectio
