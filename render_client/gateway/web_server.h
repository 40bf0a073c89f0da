// HTTP and WebSocket on one port: the page's files, /metrics, /version, /frame.jpg, and the sockets of browsers.
// libwebsockets stays inside web_server.cpp.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace sectio {

struct WebServerOptions {
  std::string address = "127.0.0.1";
  int port = 0;  // 0: any that is free
  std::string
      directory;  // with index.html, page.css, page.js, hand.js, headset.js, orders.js, tries.js, sectio.js, sectio.wasm
  std::string protocol;  // the WebSocket subprotocol; others are refused
  std::size_t max_message_bytes = 4096;
  std::size_t max_connections = 256;  // a further one takes the place of the oldest that asks for nothing
};

// The server's callbacks; all of them are called in run().
struct WebServerHandlers {
  std::function<bool(std::uint64_t socket)> opened;  // false: no room
  std::function<void(std::uint64_t socket)> closed;
  std::function<void(std::uint64_t socket, const std::vector<std::uint8_t>& frame)> received;
  std::function<bool(std::uint64_t socket, std::vector<std::uint8_t>& frame)> next_frame;  // false: nothing to send
  std::function<std::string(std::uint64_t socket)> title;                                  // for a line about it
  std::function<std::string()> metrics;
  std::function<std::string()> tries;          // tries of the exercise, as JSON
  std::function<std::uint64_t()> ask_picture;  // returns the number of the picture that will answer
  std::function<std::shared_ptr<const std::string>(std::uint64_t number)> picture;  // null: not yet
  std::function<bool()> tick;                                                       // every 4 ms; false: run() returns
};

struct WebServerCounts {
  std::uint64_t versions_refused = 0;
  std::uint64_t messages_too_long = 0;
  std::uint64_t cut = 0;  // connections that were ended because of anything that isn't in the handlers' hands
};

// Throws InputError when a file of the page is missing there: for who chooses WebServerOptions::directory.
void check_page(const std::string& directory);

// One thread. A socket that takes nothing holds up no other one.
class WebServer {
 public:
  // Throws InputError when the address can't be used or a file of the page is missing.
  WebServer(const WebServerOptions& options, WebServerHandlers handlers);
  ~WebServer();

  int port() const;
  void run();
  // There is something to send on this socket. In run() only.
  void wants_to_send(std::uint64_t socket);
  // Ends a connection, and says so in a line: `fault` is a sentence about the client without its subject, one of few.
  // In run() only.
  void cut(std::uint64_t socket, const std::string& fault);
  const WebServerCounts& counts() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sectio
