// The knife of paper A, 2.3: one blade, of which AC is sharp for sharp_length_m from the tip on and blunt beyond. The
// blunt part holds and pushes the tissue at the surface without cutting it.
#pragma once

#include "sim_server/instruments/instrument.h"

namespace sectio {

InstrumentKind knife();

}  // namespace sectio
