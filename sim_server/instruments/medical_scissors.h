// Paper A, 2.3: scissors with U-form blades. The section of each blade is a U, whose two edges run side by side,
// gauge_m apart; where the blades cross, both cut, so that a strip is cut out between two parallel cuts.
#pragma once

#include "sim_server/instruments/instrument.h"

namespace sectio {

InstrumentKind medical_scissors();

}  // namespace sectio
