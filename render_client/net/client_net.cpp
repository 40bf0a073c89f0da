#include "render_client/net/client_net.h"

#include <chrono>
#include <utility>

#include "common/core/log.h"
#include "common/dds/convert.h"
#include "common/dds/endpoint.h"
#include "common/dds/renew_after_sleep.h"
#include "common/math/hash.h"

namespace sectio {

// Left and taken anew by a program that slept.
struct ClientNet::Seat {
  Seat(const NetworkOptions& options, std::uint64_t client)
      : participant(options, "render_client " + std::to_string(client)),
        scene_reader(participant),
        delta_reader(participant),
        chunk_reader(participant),
        header_reader(participant),
        piece_reader(participant),
        event_reader(participant),
        end_reader(participant),
        request_writer(participant) {}

  Participant participant;
  Reader<wire::SceneInfo> scene_reader;
  Reader<wire::TopologyDelta> delta_reader;
  Reader<wire::KeyframeChunk> chunk_reader;
  Reader<wire::StateHeader> header_reader;
  Reader<wire::StatePiece> piece_reader;
  Reader<wire::Event> event_reader;
  Reader<wire::SessionEnd> end_reader;
  Writer<wire::KeyframeRequest> request_writer;
};

ClientNet::ClientNet(const NetworkOptions& options)
    : options_(options),
      client_(mix64(static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch().count()) ^
                    reinterpret_cast<std::uintptr_t>(this))),
      seat_(std::make_unique<Seat>(options_, client_)) {}

ClientNet::~ClientNet() = default;

// Calls use(value) for each message that holds.
template <class Wire, class Use>
void ClientNet::drain(Reader<Wire>& reader, const Use& use) {
  Wire message;
  while (reader.take(message)) {
    ++counts_.messages;
    if (auto value = from_wire(message)) {
      use(std::move(*value));
    } else {
      ++counts_.damaged;
      log_limited(LogLevel::warning, "damaged", "a damaged message was dropped");
    }
  }
}

void ClientNet::poll(double now_s, World& world) {
  if (auto slept = renew_after_sleep(seat_, [&] { return std::make_unique<Seat>(options_, client_); }))
    former_seat_ = std::move(slept);
  if (former_seat_ && connected()) former_seat_.reset();  // not sooner: servers would think that it has left
  Seat& s = *seat_;
  drain(s.scene_reader, [&](const SceneInfo& scene) { world.announce(scene); });
  if (!world.scene()) return;  // the readers keep what comes before the scene

  drain(s.header_reader, [&](StateHeader header) { world.feed(std::move(header)); });
  drain(s.piece_reader, [&](StatePiece piece) { world.feed(std::move(piece)); });
  drain(s.delta_reader, [&](DeltaMessage message) { world.feed(std::move(message)); });
  drain(s.chunk_reader, [&](KeyframeChunk chunk) { world.feed(std::move(chunk)); });
  drain(s.event_reader, [&](SessionEvent event) {
    if (!world.knows(event.epoch)) return;
    events_.push_back(std::move(event));
    if (events_.size() > kMaxEvents) events_.pop_front();
  });
  drain(s.end_reader, [&](const SessionEnd& end) { world.feed(end); });
  for (KeyframeRequest request : world.take_requests(now_s)) {
    request.client = client_;
    if (!s.request_writer.write(to_wire(request)))
      log_limited(LogLevel::warning, "request", "DDS refused to send a keyframe request");
  }
}

bool ClientNet::connected() const {
  return seat_->delta_reader.writers() > 0;
}

const std::deque<SessionEvent>& ClientNet::events() const {
  return events_;
}

const ClientNetCounts& ClientNet::counts() const {
  return counts_;
}

}  // namespace sectio
