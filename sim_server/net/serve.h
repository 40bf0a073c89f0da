// A live session: take, step, publish, in real time.
#pragma once

#include <cstdint>
#include <string>

#include "sim_server/net/server_net.h"
#include "sim_server/scene/scene.h"
#include "sim_server/session/verdict.h"

namespace sectio {

struct ServeOptions {
  NetworkOptions network;
  std::uint64_t steps = 0;  // 0: the scene's duration; without end when `endless`
  bool endless = false;
  std::string directory;               // for journal, surfaces and report; empty: none are written
  std::uint32_t wait_for_viewers = 0;  // the clock starts when so many are there
  bool wait_for_tools = false;         // and when every tool of the scene has sent a sample
  bool wait_for_bodies = false;        // and when every body of the scene has a server
  bool play_traces = false;            // instruments follow the scene's own traces, step by step; bridges are not heard
  double stall_at_s = -1;              // for tests: the simulation stops once, at this simulated time ...
  double stall_s = 0;                  // ... for so long
};

// Throws InputError when another server of the session has a body of this one. SIGINT and SIGTERM
// end the session in order; nothing is lost.
RunResult serve(const Scene& scene, const ServeOptions& options);

}  // namespace sectio
