// The servers of a session, each with a share of its bodies: what one knows of the others.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/dds/endpoint.h"
#include "common/messages/session.h"
#include "idl/session.h"
#include "idl/state.h"

namespace sectio {

class OtherServers {
 public:
  static constexpr double kSilence_s = 1;  // after which a server is taken for dead

  // `own`: what this one announces.
  OtherServers(Participant& participant, const SceneInfo& own);

  // Takes what has arrived. One thread; the rest is for any.
  void listen();

  // Bodies of the scene that no server has announced yet.
  std::vector<std::string> missing_bodies() const;
  // The first body of ours that an older server has, too: then this one has to go.
  std::optional<std::string> claimed_body() const;
  // The simulated time of the slowest one; nothing when none speaks.
  std::optional<double> slowest_s() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Other {
    double sim_time_s = 0;
    Clock::time_point heard{};
    bool ended = false;
  };

  SceneInfo own_;
  Reader<wire::SceneInfo> scene_reader_;
  Reader<wire::StateHeader> header_reader_;
  Reader<wire::SessionEnd> end_reader_;

  mutable std::mutex mutex_;
  std::vector<std::string> missing_;
  std::optional<std::string> claimed_;
  std::map<std::uint64_t, Other> others_;  // by epoch
};

}  // namespace sectio
