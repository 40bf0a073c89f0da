// A render client without a renderer, in the test's own process.
#pragma once

#include <chrono>
#include <functional>
#include <vector>

#include "common/dds/participant.h"
#include "common/messages/session.h"
#include "render_client/net/client_net.h"
#include "render_client/replica/world.h"

namespace sectio::test {

struct ReplicaViewer {
  explicit ReplicaViewer(const NetworkOptions& network) : net(network) {}

  // True: `frame` is new.
  bool look();
  // It knows every body at this version.
  bool knows(const std::vector<BodyVersion>& versions);
  bool agrees_with(const std::vector<BodyVersion>& versions) {
    look();
    return knows(versions);
  }

  ClientNet net;
  World replica;
  Frame frame;
  int frames = 0;
};

// The version at which a server's mesh is.
template <class Mesh>
BodyVersion version_of(const Mesh& mesh) {
  return {mesh.revision(), mesh.hash()};
}

}  // namespace sectio::test
