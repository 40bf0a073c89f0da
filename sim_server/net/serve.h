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
  std::string directory;               // for journals, surfaces and report; empty: none are written
  int attempt = 1;                     // the try in this directory that goes on (run_files.h)
  std::string record;                  // file for everything that is sent (MCAP); empty: none
  bool standby = false;                // runs the steps of another server, and follows it when it dies
  std::string resume;                  // go on from the journal of inputs in this directory; a standby begins there ...
  double until_s = -1;                 // ... from this simulated time on, which needs another `directory`
  std::string play;                    // the inputs are those of this journal, and nobody's hand is heard
  double speed = 1;                    // speed at which the journal is played
  double from_s = 0;                   // simulated time to which it is run before anybody sees it
  std::uint32_t wait_for_viewers = 0;  // the clock starts when so many are there
  bool wait_for_tools = false;         // and when every tool of the scene has sent a sample
  bool wait_for_bodies = false;        // and when every body of the scene has a server
  double fastest_m_per_s = 0;          // limit of instruments instead of that of the scene; 0: that of the scene
  bool play_traces = false;            // instruments follow the scene's own traces, step by step; bridges are not heard
  double stall_at_s = -1;              // for tests: the simulation stops once, at this simulated time ...
  double stall_s = 0;                  // ... for so long
};

// Throws InputError when another server of the session has a body of this one. SIGINT, SIGTERM and
// SIGHUP end the session in order; nothing is lost.
RunResult serve(const Scene& scene, const ServeOptions& options);

}  // namespace sectio
