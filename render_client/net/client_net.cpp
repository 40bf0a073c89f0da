#include "render_client/net/client_net.h"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "common/core/log.h"
#include "common/dds/endpoints.h"
#include "common/math/hash.h"

namespace sectio {

struct ClientNet::Wire {
  Endpoints<
      Reads<SceneInfo, DeltaMessage, KeyframeChunk, StateHeader, StatePiece, ScalarPiece, SessionEvent, SessionEnd>,
      Writes<KeyframeRequest, ViewerReport>>
      endpoints;
  // For a record alone.
  std::unique_ptr<Endpoints<Reads<ServerStatus>, Writes<>>> status = {};
};

namespace {

constexpr double kReportInterval_s = 0.5;
constexpr double kKeyframePatience_s = 3;  // after the last wish for one, chunks are heard for so long
constexpr std::size_t kFirstLevelOffHost = 1;
constexpr double kThin_s = 4;
constexpr std::size_t kThinBytes = 400'000;

}  // namespace

ClientNet::ClientNet(const NetworkOptions& options, std::string name)
    : client_(mix64(static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch().count()) ^
                    reinterpret_cast<std::uintptr_t>(this))),
      wire_(new Wire{{options, "render_client " + std::to_string(client_)}}),
      name_(std::move(name)),
      meter_(options.off_host() ? kFirstLevelOffHost : 0),
      off_host_(options.off_host()),
      options_(options) {}

ClientNet::~ClientNet() = default;

template <class Message, class Use>
void ClientNet::drain(const Use& use) {
  while (auto message = wire_->endpoints.take<Message>()) {
    ++messages_;
    if (record_) record_->hear(*message);
    use(std::move(*message));
  }
}

void ClientNet::poll(double now_s, World& world) {
  wire_->endpoints.renew_after_sleep();
  if (wire_->status) wire_->status->renew_after_sleep();
  drain<SceneInfo>([&](const SceneInfo& scene) { world.announce(scene); });
  if (!world.scene()) return;  // the readers keep what comes before the scene

  drain<StateHeader>([&](StateHeader header) {
    meter_.hear(now_s, header);
    world.feed(std::move(header));
  });
  drain<StatePiece>([&](StatePiece piece) {
    meter_.hear(piece);
    world.feed(std::move(piece));
  });
  drain<ScalarPiece>([&](ScalarPiece piece) { world.feed(std::move(piece)); });
  drain<DeltaMessage>([&](DeltaMessage message) { world.feed(std::move(message)); });
  drain<KeyframeChunk>([&](KeyframeChunk chunk) { world.feed(std::move(chunk)); });
  drain<SessionEvent>([&](SessionEvent event) {
    if (!world.knows(event.epoch)) return;
    const auto is_repeated = [&](const SessionEvent& e) { return e.epoch != event.epoch && is_same_event(e, event); };
    if (std::ranges::any_of(events_, is_repeated)) return;
    events_.push_back(std::move(event));
    if (events_.size() > kMaxEvents) events_.pop_front();
  });
  drain<SessionEnd>([&](const SessionEnd& end) { world.feed(end); });
  while (auto status = wire_->status ? wire_->status->take<ServerStatus>() : std::nullopt) record_->hear(*status);
  const std::vector<KeyframeRequest> requests = world.take_requests(now_s);
  choose_channels(now_s, world, !requests.empty());
  for (KeyframeRequest request : requests) {
    request.client = client_;
    if (!wire_->endpoints.write(request))
      log_limited(LogLevel::warning, "request", "DDS refused to send a keyframe request");
  }
  report(now_s);
}

void ClientNet::choose_channels(double now_s, const World& world, bool pulls) {
  Channels wanted = channels_;
  if (pulls) pulled_s_ = now_s;
  if (joined_s_ < 0) joined_s_ = now_s;
  wanted.keyframes = now_s - pulled_s_ < kKeyframePatience_s;
  // Before the bodies are known there is nothing to draw: the link is for their keyframes.
  const bool known = world.knows_all_bodies();
  wanted.level = off_host_ && !known ? kStateRates_hz.size() - 1 : meter_.choose(now_s);
  // A link that hasn't brought them by now bears no stream of changes: the viewer lives on keyframes.
  if (off_host_ && !known && now_s - joined_s_ > kThin_s && world.pulled_bytes() < kThinBytes) wanted.deltas = false;
  if (wanted == channels_) return;
  channels_ = wanted;
  std::vector<std::string> names;
  names.reserve(3);
  names.emplace_back(kStateChannels.at(channels_.level));
  if (channels_.keyframes) names.emplace_back(kKeyframeChannels[0]);
  if (channels_.deltas) names.emplace_back(kDeltaChannels[0]);
  wire_->endpoints.hear(std::move(names));
}

void ClientNet::report(double now_s) {
  if (now_s < next_report_s_) return;
  next_report_s_ = now_s + kReportInterval_s;
  ViewerReport report = meter_.report();
  report.client = client_;
  report.name = name_;
  if (!wire_->endpoints.write(report)) log_limited(LogLevel::warning, "report", "DDS refused to send a report");
}

void ClientNet::record(HeardRecord& record) {
  record_ = &record;
  wire_->status = std::make_unique<Endpoints<Reads<ServerStatus>, Writes<>>>(options_, "render_client record");
}

bool ClientNet::connected() const {
  return wire_->endpoints.met();
}

ClientNetCounts ClientNet::counts() const {
  return {messages_, wire_->endpoints.damaged()};
}

}  // namespace sectio
