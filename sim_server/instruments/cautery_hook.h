// A cautery hook. The virtual tip CD, beyond the probe AC, cuts in any direction where it is in the tissue, and so does
// the probe while there is current. Without it, the probe only deforms.
#pragma once

#include "sim_server/instruments/instrument.h"

namespace sectio {

InstrumentKind cautery_hook();

}  // namespace sectio
