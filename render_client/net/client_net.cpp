#include "render_client/net/client_net.h"

#include <chrono>

#include "common/core/log.h"
#include "common/dds/convert.h"
#include "common/dds/endpoint.h"
#include "common/math/hash.h"
#include "common/messages/chunks.h"

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
        status_reader(participant),
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

  void take_scene(Replica& replica);
  void take_topology(Replica& replica);

  Participant participant;
  Reader<wire::SceneInfo> scene_reader;
  Reader<wire::TopologyDelta> delta_reader;
  Reader<wire::KeyframeChunk> chunk_reader;
  Reader<wire::StateHeader> header_reader;
  Reader<wire::StatePiece> piece_reader;
  Reader<wire::Event> event_reader;
  Reader<wire::ServerStatus> status_reader;
  Reader<wire::SessionEnd> end_reader;
  Writer<wire::KeyframeRequest> request_writer;

  std::uint64_t client;
  KeyframeAssembler assembler;
  std::optional<ServerStatus> status;
  std::optional<SessionEnd> session_end;
  std::deque<SessionEvent> events;
  ClientNetCounts counts;
};

void ClientNet::State::take_scene(Replica& replica) {
  drain(scene_reader, [&](SceneInfo scene) {
    if (replica.scene() && scene.epoch == replica.scene()->epoch) {
      replica.extend(scene);
      if (session_end) replica.feed(*session_end);  // it may have come before the bodies that it names
      return;
    }
    if (replica.scene() && scene.epoch < replica.scene()->epoch) return;
    replica.reset(scene);
    assembler.clear();
    status.reset();
    session_end.reset();
    events.clear();
  });
}

void ClientNet::State::take_topology(Replica& replica) {
  drain(delta_reader, [&](DeltaMessage message) { replica.feed(std::move(message)); });
  drain(chunk_reader, [&](KeyframeChunk chunk) {
    if (chunk.epoch != replica.scene()->epoch || chunk.body_id >= replica.bodies().size()) return;
    const ReplicaBody& body = replica.bodies()[chunk.body_id];
    if (body.known() && chunk.revision <= body.mesh().revision()) return;  // for another viewer
    const std::uint64_t epoch = chunk.epoch;
    const std::uint32_t body_id = chunk.body_id;
    if (const auto bytes = assembler.add(std::move(chunk))) replica.feed_keyframe(epoch, body_id, *bytes);
  });
}

ClientNet::ClientNet(const NetworkOptions& options) : state_(std::make_unique<State>(options)) {}

ClientNet::~ClientNet() = default;

void ClientNet::poll(double now_s, Replica& replica) {
  State& s = *state_;
  s.take_scene(replica);
  if (!replica.scene()) return;  // the readers keep what comes before the scene
  const std::uint64_t epoch = replica.scene()->epoch;

  s.drain(s.header_reader, [&](StateHeader header) { replica.feed(std::move(header)); });
  s.drain(s.piece_reader, [&](StatePiece piece) { replica.feed(std::move(piece)); });
  s.take_topology(replica);
  s.drain(s.event_reader, [&](SessionEvent event) {
    if (event.epoch != epoch) return;
    s.events.push_back(std::move(event));
    if (s.events.size() > kMaxEvents) s.events.pop_front();
  });
  s.drain(s.status_reader, [&](ServerStatus status) {
    if (status.epoch == epoch) s.status = std::move(status);
  });
  s.drain(s.end_reader, [&](SessionEnd end) {
    if (end.epoch != epoch) return;
    replica.feed(end);
    s.session_end = std::move(end);
  });
  for (KeyframeRequest request : replica.take_requests(now_s)) {
    request.client = s.client;
    if (!s.request_writer.write(to_wire(request)))
      log_limited(LogLevel::warning, "request", "DDS refused to send a keyframe request");
  }
}

bool ClientNet::connected() const {
  return state_->delta_reader.writers() > 0;
}

const std::optional<ServerStatus>& ClientNet::status() const {
  return state_->status;
}

const std::optional<SessionEnd>& ClientNet::session_end() const {
  return state_->session_end;
}

const std::deque<SessionEvent>& ClientNet::events() const {
  return state_->events;
}

const ClientNetCounts& ClientNet::counts() const {
  return state_->counts;
}

}  // namespace sectio
