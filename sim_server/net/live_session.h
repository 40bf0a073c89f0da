// A session that a server takes part in: what it needs whether it leads or stands by.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "common/core/stop_signal.h"
#include "common/record/session_record.h"
#include "sim_server/net/pace.h"
#include "sim_server/net/serve.h"
#include "sim_server/net/standing_orders.h"
#include "sim_server/net/world_view.h"
#include "sim_server/session/played_inputs.h"
#include "sim_server/session/progress.h"
#include "sim_server/session/session_run.h"

namespace sectio {

constexpr const char* kStays = "it stays where it is: ";  // a session that can't go where it is told to

struct LiveSession {
  // Both arguments outlive it; the scene is a prepared one. A session that goes on has been run again, one that is
  // played has come to where it is to be seen from.
  LiveSession(const Scene& the_scene, const ServeOptions& the_options);

  bool has_more_steps() const { return (!steps || run->steps() < *steps) && !stop_was_requested(); }
  double time_s() const { return static_cast<double>(run->steps()) * scene.step_s; }
  // The reason to refuse an order; empty: there is none yet.
  std::string why_not(const SessionOrder& order) const;
  // Keeps what an order sets, of gravity, of pace and of frozen tools.
  std::optional<Pace::News> take(const SessionOrder& order);
  // Takes over the orders that hold in a session elsewhere, in which tools that thawed have done so.
  void adopt(const StandingOrders& orders);
  // The bodies as they are, for a server that leads from now on in the term after `epoch`.
  Succession succession(std::uint64_t epoch);

  std::optional<Pace::News> hold_off(const SessionOrder& order);

  struct Try {
    int attempt = 1;  // number of the try
    std::unique_ptr<SessionRun> run;
    std::optional<PlayedInputs> past;
  };
  // A try that goes on from this simulated time of this one, or of what is played. The session stays as it is
  // meanwhile, and where this throws; then no directory is left behind.
  Try another_try(double from_s) const;
  // The try so far keeps its files; the next one gets a directory within theirs. Returns the former run: the network
  // reads its journal until it is told of the next one.
  std::unique_ptr<SessionRun> begin(Try next);

  const Scene& scene;
  const ServeOptions& options;
  int attempt;
  std::shared_ptr<DirectoryLock> first_lock;  // the first directory has those of all other tries in it
  std::optional<std::uint64_t> steps;         // nothing: without end
  std::optional<std::uint64_t> last_epoch;    // a session that goes on has one
  std::unique_ptr<SessionRun> run;
  std::optional<PlayedInputs> past;  // the journal that is played
  std::string record_file;           // empty: none
  std::unique_ptr<SessionRecord> record;
  std::unique_ptr<ServerNet> net;
  StepInput input;                 // input of the next step
  std::set<std::uint32_t> silent;  // tools that fell silent while standing by or paused
  // Tools whose hands are elsewhere, since they thawed, or the session paused or went somewhere: before the next step
  // they leave what they are in, and come into the scene anew.
  std::set<std::uint32_t> displaced;
  Progress progress;
  Pace pace;
};

}  // namespace sectio
