// The gateway's end of the wire: takes what the session sends, and writes wishes and requests.
#pragma once

#include <memory>

#include "common/dds/participant.h"
#include "render_client/gateway/gateway.h"

namespace sectio {

// One thread; nothing blocks.
class GatewayNet {
 public:
  // Throws InputError for bad options.
  explicit GatewayNet(const NetworkOptions& options);
  ~GatewayNet();

  // Feeds the gateway with all that has arrived since the last call.
  void poll(Gateway& gateway);
  // Sends what the gateway has for the session.
  void send(Gateway& gateway, double now_s);

  bool connected() const;
  bool session_ended() const;  // it has ended, and nothing of another server has come since

 private:
  struct Wire;
  std::unique_ptr<Wire> wire_;
};

}  // namespace sectio
