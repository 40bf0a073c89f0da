// The probe AC deforms; CD, the virtual tip beyond it, cuts where it is in the tissue, and in any direction.
#pragma once

#include "sim_server/instruments/instrument.h"

namespace sectio {

InstrumentKind cautery_hook();

}  // namespace sectio
