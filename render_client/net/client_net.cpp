#include "render_client/net/client_net.h"

#include <chrono>
#include <utility>

#include "common/core/log.h"
#include "common/dds/endpoints.h"
#include "common/math/hash.h"

namespace sectio {

struct ClientNet::Wire {
  Endpoints<
      Reads<SceneInfo, DeltaMessage, KeyframeChunk, StateHeader, StatePiece, ScalarPiece, SessionEvent, SessionEnd>,
      Writes<KeyframeRequest>>
      endpoints;
};

ClientNet::ClientNet(const NetworkOptions& options)
    : client_(mix64(static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch().count()) ^
                    reinterpret_cast<std::uintptr_t>(this))),
      wire_(new Wire{{options, "render_client " + std::to_string(client_)}}) {}

ClientNet::~ClientNet() = default;

template <class Message, class Use>
void ClientNet::drain(const Use& use) {
  while (auto message = wire_->endpoints.take<Message>()) {
    ++messages_;
    use(std::move(*message));
  }
}

void ClientNet::poll(double now_s, World& world) {
  wire_->endpoints.renew_after_sleep();
  drain<SceneInfo>([&](const SceneInfo& scene) { world.announce(scene); });
  if (!world.scene()) return;  // the readers keep what comes before the scene

  drain<StateHeader>([&](StateHeader header) { world.feed(std::move(header)); });
  drain<StatePiece>([&](StatePiece piece) { world.feed(std::move(piece)); });
  drain<ScalarPiece>([&](ScalarPiece piece) { world.feed(std::move(piece)); });
  drain<DeltaMessage>([&](DeltaMessage message) { world.feed(std::move(message)); });
  drain<KeyframeChunk>([&](KeyframeChunk chunk) { world.feed(std::move(chunk)); });
  drain<SessionEvent>([&](SessionEvent event) {
    if (!world.knows(event.epoch)) return;
    events_.push_back(std::move(event));
    if (events_.size() > kMaxEvents) events_.pop_front();
  });
  drain<SessionEnd>([&](const SessionEnd& end) { world.feed(end); });
  for (KeyframeRequest request : world.take_requests(now_s)) {
    request.client = client_;
    if (!wire_->endpoints.write(request))
      log_limited(LogLevel::warning, "request", "DDS refused to send a keyframe request");
  }
}

bool ClientNet::connected() const {
  return wire_->endpoints.met();
}

ClientNetCounts ClientNet::counts() const {
  return {messages_, wire_->endpoints.damaged()};
}

}  // namespace sectio
