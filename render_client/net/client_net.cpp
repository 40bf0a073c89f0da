#include "render_client/net/client_net.h"

#include <chrono>

#include "common/core/log.h"
#include "common/dds/convert.h"
#include "common/dds/endpoint.h"
#include "common/math/hash.h"

namespace sectio {

struct ClientNet::State {
  explicit State(const NetworkOptions& options)
      : participant(options, "render_client"),
        scene_reader(participant),
        delta_reader(participant),
        chunk_reader(participant),
        header_reader(participant),
        piece_reader(participant),
        event_reader(participant),
        end_reader(participant),
        request_writer(participant),
        client(mix64(static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch().count()) ^
                     reinterpret_cast<std::uintptr_t>(this))) {}

  // Calls use(value) for each message that holds.
  template <class T, class Use>
  void drain(Reader<T>& reader, const Use& use) {
    T message;
    while (reader.take(message)) {
      ++counts.messages;
      if (auto value = from_wire(message)) {
        use(std::move(*value));
      } else {
        ++counts.damaged;
        log_limited(LogLevel::warning, "damaged", "a damaged message was dropped");
      }
    }
  }

  Participant participant;
  Reader<wire::SceneInfo> scene_reader;
  Reader<wire::TopologyDelta> delta_reader;
  Reader<wire::KeyframeChunk> chunk_reader;
  Reader<wire::StateHeader> header_reader;
  Reader<wire::StatePiece> piece_reader;
  Reader<wire::Event> event_reader;
  Reader<wire::SessionEnd> end_reader;
  Writer<wire::KeyframeRequest> request_writer;

  std::uint64_t client;
  std::deque<SessionEvent> events;
  ClientNetCounts counts;
};

ClientNet::ClientNet(const NetworkOptions& options) : state_(std::make_unique<State>(options)) {}

ClientNet::~ClientNet() = default;

void ClientNet::poll(double now_s, World& world) {
  State& s = *state_;
  s.drain(s.scene_reader, [&](const SceneInfo& scene) { world.announce(scene); });
  if (!world.scene()) return;  // the readers keep what comes before the scene

  s.drain(s.header_reader, [&](StateHeader header) { world.feed(std::move(header)); });
  s.drain(s.piece_reader, [&](StatePiece piece) { world.feed(std::move(piece)); });
  s.drain(s.delta_reader, [&](DeltaMessage message) { world.feed(std::move(message)); });
  s.drain(s.chunk_reader, [&](KeyframeChunk chunk) { world.feed(std::move(chunk)); });
  s.drain(s.event_reader, [&](SessionEvent event) {
    if (!world.knows(event.epoch)) return;
    s.events.push_back(std::move(event));
    if (s.events.size() > kMaxEvents) s.events.pop_front();
  });
  s.drain(s.end_reader, [&](const SessionEnd& end) { world.feed(end); });
  for (KeyframeRequest request : world.take_requests(now_s)) {
    request.client = s.client;
    if (!s.request_writer.write(to_wire(request)))
      log_limited(LogLevel::warning, "request", "DDS refused to send a keyframe request");
  }
}

bool ClientNet::connected() const {
  return state_->delta_reader.writers() > 0;
}

const std::deque<SessionEvent>& ClientNet::events() const {
  return state_->events;
}

const ClientNetCounts& ClientNet::counts() const {
  return state_->counts;
}

}  // namespace sectio
