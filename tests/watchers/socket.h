// WebSockets to a gateway, any number in one thread. libwebsockets stays inside socket.cpp.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace sectio::watchers {

class Sockets {
 public:
  using Heard = std::function<void(std::size_t socket, const std::vector<std::uint8_t>& frame)>;

  // Opens `count` of them. Throws InputError when libwebsockets can't be started.
  Sockets(int port, std::size_t count, Heard heard);
  ~Sockets();

  // Queues a frame for a socket.
  void send(std::size_t socket, std::vector<std::uint8_t> frame);
  // Waits for whatever comes, a millisecond or so.
  void run_once();
  std::size_t open() const;  // connected sockets

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sectio::watchers
