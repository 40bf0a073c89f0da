// The commands of sim_server, a file each. Every function adds the flags of its command and returns what it does.
#pragma once

#include "common/core/arguments.h"

namespace sectio {

Arguments::Action run_command(Arguments& arguments);  // without a name: a session, or a run without network
Arguments::Action replay_command(Arguments& arguments);
Arguments::Action play_command(Arguments& arguments);
Arguments::Action mesh_command(Arguments& arguments);
Arguments::Action organ_command(Arguments& arguments);
Arguments::Action plan_command(Arguments& arguments);
Arguments::Action gap_command(Arguments& arguments);
Arguments::Action schema_command(Arguments& arguments);
Arguments::Action try_command(Arguments& arguments);
Arguments::Action traces_command(Arguments& arguments);
Arguments::Action unfinished_command(Arguments& arguments);
Arguments::Action servers_command(Arguments& arguments);
Arguments::Action status_command(Arguments& arguments);
Arguments::Action tilt_command(Arguments& arguments);
Arguments::Action pause_command(Arguments& arguments);
Arguments::Action go_on_command(Arguments& arguments);
Arguments::Action freeze_command(Arguments& arguments);
Arguments::Action thaw_command(Arguments& arguments);
Arguments::Action speed_command(Arguments& arguments);
Arguments::Action anew_command(Arguments& arguments);
Arguments::Action score_command(Arguments& arguments);
Arguments::Action seek_command(Arguments& arguments);

}  // namespace sectio
