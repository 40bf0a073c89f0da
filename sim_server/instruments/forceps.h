// Forceps, with which paper A, 2.3, removes what a complete cut has separated: two blunt jaws about a pivot. When they
// close beyond an angle, they hold the loose piece or the tissue between their tips, up to a largest force, until they
// open. They press tissue and never cut.
//
//    B ---- C ----__  upper jaw
//                   > A     the tips, closed
//             ----~~  lower jaw, D its back
#pragma once

#include "sim_server/instruments/instrument.h"

namespace sectio {

InstrumentKind forceps();

}  // namespace sectio
