// Paper A, 2.3: one blade with a sharp and a blunt part. AC is sharp from the tip for sharp_length_m and blunt from
// there on: where the surface meets the blunt part the tissue is held and pushed, not cut.
#pragma once

#include "sim_server/instruments/instrument.h"

namespace sectio {

InstrumentKind knife();

}  // namespace sectio
