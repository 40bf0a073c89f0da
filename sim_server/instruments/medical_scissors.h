// The medical scissors of paper A, 2.3, with U-shaped blades. The section of each blade is a U, whose two edges run
// side by side, gauge_m apart. Both cut where the blades cross, so that two parallel cuts take out a strip.
#pragma once

#include "sim_server/instruments/instrument.h"

namespace sectio {

InstrumentKind medical_scissors();

}  // namespace sectio
