// Paper A, 2.3, takes out what a complete cut has parted: two blunt jaws about a pivot. Closed further than an angle
// they hold a loose piece, or the tissue, that is between their tips, with a force that is capped; they let go when
// they open. They press tissue and never cut.
//
//    B ---- C ----__  upper jaw
//                   > A     the tips, closed
//             ----~~  lower jaw, D its back
#pragma once

#include "sim_server/instruments/instrument.h"

namespace sectio {

InstrumentKind forceps();

}  // namespace sectio
