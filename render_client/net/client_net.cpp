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
  Endpoints<Reads<SceneInfo, DeltaMessage, KeyframeChunk, StateHeader, StatePiece, ScalarPiece, SessionEvent,
                  SessionEnd, ServerStatus>,
            Writes<KeyframeRequest, LinkReport>>
      endpoints;
};

namespace {

constexpr double kReportInterval_s = 0.5;
constexpr double kKeyframePatience_s = 3;  // after the last wish for one, chunks are heard for so long
constexpr std::size_t kFirstLevelOffHost = 1;
constexpr double kThin_s = 10;
constexpr std::size_t kThinBytes = 400'000;

}  // namespace

ClientNet::ClientNet(const NetworkOptions& options, std::string name)
    : client_(mix64(static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch().count()) ^
                    reinterpret_cast<std::uintptr_t>(this))),
      wire_(new Wire{{options, "render_client " + std::to_string(client_)}}),
      name_(std::move(name)),
      meter_(options.off_host() ? kFirstLevelOffHost : 0),
      off_host_(options.off_host()) {
  if (!off_host_) return;
  channels_.states = false;
  hear_channels();
}

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
  equality_.compare(world);
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
  drain<KeyframeChunk>([&](KeyframeChunk chunk) {
    if (pull_began_s_ < 0) pull_began_s_ = now_s;
    world.feed(std::move(chunk));
  });
  drain<SessionEvent>([&](SessionEvent event) {
    if (!world.shows(event.epoch)) return;
    const auto is_repeated = [&](const SessionEvent& e) { return e.epoch != event.epoch && is_same_event(e, event); };
    if (std::ranges::any_of(events_, is_repeated)) return;
    events_.push_back(std::move(event));
    if (events_.size() > kMaxEvents) events_.pop_front();
  });
  drain<SessionEnd>([&](const SessionEnd& end) {
    equality_.hear(end.epoch, end.bodies);
    world.feed(end);
  });
  drain<ServerStatus>([&](const ServerStatus& status) {
    equality_.hear(status.epoch, status.bodies);
    world.feed(status);
    if (!world.shows(status.epoch)) return;
    speed_ = status.speed;
    clock_.hear(now_s, client_, status);
    if (clock_.known()) meter_.set_clock_offset(clock_.offset_s());
  });
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
  if (known && !channels_.states) meter_.begin(now_s - pull_began_s_);
  wanted.states = channels_.states || known;
  wanted.level = meter_.choose(now_s);
  // A link that hasn't brought them by now bears no stream of changes: the viewer lives on keyframes.
  if (off_host_ && !known && now_s - joined_s_ > kThin_s && world.pulled_bytes() < kThinBytes) wanted.deltas = false;
  if (wanted == channels_) return;
  channels_ = wanted;
  hear_channels();
}

void ClientNet::hear_channels() {
  std::vector<std::string> names;
  names.reserve(3);
  if (channels_.states) names.emplace_back(kStateChannels.at(channels_.level));
  if (channels_.keyframes) names.emplace_back(kKeyframeChannels[0]);
  if (channels_.deltas) names.emplace_back(kDeltaChannels[0]);
  wire_->endpoints.hear(std::move(names));
}

void ClientNet::report(double now_s) {
  if (now_s < next_report_s_) return;
  next_report_s_ = now_s + kReportInterval_s;
  LinkReport report = meter_.report();
  report.client = client_;
  report.name = name_;
  clock_.stamp(now_s, report);
  if (!wire_->endpoints.write(report)) log_limited(LogLevel::warning, "report", "DDS refused to send a report");
}

void ClientNet::record(HeardRecord& record) {
  record_ = &record;
}

bool ClientNet::connected() const {
  return wire_->endpoints.met();
}

std::optional<double> ClientNet::state_age_s() const {
  if (!clock_.known() || meter_.report().came_per_s == 0) return std::nullopt;
  return meter_.report().age_median_s;
}

ClientNetCounts ClientNet::counts() const {
  return {messages_, wire_->endpoints.damaged()};
}

}  // namespace sectio
