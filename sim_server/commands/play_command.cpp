#include "common/core/error.h"
#include "common/dds/network_arguments.h"
#include "sim_server/commands/commands.h"
#include "sim_server/commands/recorded_scene.h"
#include "sim_server/net/play_record.h"

namespace sectio {

Arguments::Action play_command(Arguments& arguments) {
  const auto options = std::make_shared<ServeOptions>();
  options->network.session.clear();
  options->endless = true;
  arguments.option("INPUTS", options->play,
                   "an earlier session: a --record of its server or of a viewer, or the directory of its --export",
                   Need::required);
  arguments.option("--speed", options->speed, "1: as fast as it was; inputs slower when the simulation can't");
  arguments.option("--from-s", options->from_s, "simulated time at which it is shown");
  arguments.option("--wait-for-viewers", options->wait_for_viewers, "the clock starts when so many are there");
  add_network_arguments(arguments, options->network, "name of the session; empty: the one of that time");
  return [options] {
    if (!(options->speed >= 0.01 && options->speed <= 1000))
      throw InputError("--speed: expected 0.01 to 1000, got " + std::to_string(options->speed));
    if (!(options->from_s >= 0)) throw InputError("--from-s: expected >= 0, got " + std::to_string(options->from_s));
    options->play = journal_at(options->play);
    if (is_mcap(options->play)) return play_record(*options);
    Scene scene = recorded_scene(options->play);
    if (!options->network.session.empty()) scene.session = options->network.session;
    options->network.session = scene.session;
    const RunResult result = serve(scene, *options);
    return result.exit_code();
  };
}

}  // namespace sectio
