// A viewer's end of the wire: takes what has arrived, validates it, feeds the replicas, and asks for keyframes.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>

#include "common/dds/participant.h"
#include "common/messages/session.h"
#include "render_client/replica/world.h"

namespace sectio {

template <class T>
class Reader;

struct ClientNetCounts {
  std::uint64_t messages = 0;
  std::uint64_t damaged = 0;  // dropped by validation
};

// One thread; nothing blocks.
class ClientNet {
 public:
  static constexpr std::size_t kMaxEvents = 64;

  // Throws InputError for options that won't do.
  explicit ClientNet(const NetworkOptions& options);
  ~ClientNet();

  // Everything that has arrived since the last call, from every server of the session. A program that was asleep joins
  // anew; the world keeps what it has.
  void poll(double now_s, World& world);

  bool connected() const;
  const std::deque<SessionEvent>& events() const;  // the newest kMaxEvents
  const ClientNetCounts& counts() const;

 private:
  struct Seat;
  template <class Wire, class Use>
  void drain(Reader<Wire>& reader, const Use& use);

  NetworkOptions options_;
  std::uint64_t client_;
  std::unique_ptr<Seat> seat_, former_seat_;
  std::deque<SessionEvent> events_;
  ClientNetCounts counts_;
};

}  // namespace sectio
