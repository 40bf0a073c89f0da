// A session of the real programs on hosts of their own: a server, a hand that follows the scene's trace, and viewers,
// each behind the links that it is given; and what came of it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/virtual_network.h"

namespace sectio::test {

struct LinkedSession {
  std::string scene = "liver_incision";  // from deploy/scenes; its trace has the same name
  std::string bin = {};                  // the directory of the programs; empty: those of this build
  int finer = 0;                         // each triangle is divided into four so often,
  double duration_s = 0;                 // and the scene lasts so long
  bool secured = false;                  // with keys
  HostLinks server = {}, hand = {};
  std::vector<HostLinks> viewers = {};
  double late_s = 0;  // the last viewer joins so long after the session has begun
};

struct ViewerFigures {
  int states = 0;
  double states_per_s = 0;
  double max_gap_s = 0;       // between two pictures
  double first_state_s = 0;   // after the viewer's start
  std::string equals_server;  // yes, no or unknown
};

struct SessionFigures {
  std::vector<ViewerFigures> viewers;
  double model_age_median_s = 0, model_age_p99_s = 0, model_age_max_s = 0;  // at the hand, once it has one
  LinkTraffic offered;                                                      // by the server
  std::uint64_t dropped = 0;                                                // on all links, because of full queues
  std::string trouble;  // the output of a program that ended with an error
};

// Needs `directory` for files. Throws as VirtualNetwork does.
SessionFigures run(const LinkedSession& session, const std::filesystem::path& directory);

}  // namespace sectio::test
