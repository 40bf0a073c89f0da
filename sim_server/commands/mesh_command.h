// `sim_server mesh`: a surface, or tetrahedra from another program, to tetrahedra, cut along planes if asked for, with
// a report on them.
#pragma once

namespace sectio {

// Arguments from "mesh" on. Throws InputError.
int run_mesh_command(int argc, char** argv);

}  // namespace sectio
