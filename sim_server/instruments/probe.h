// A rod with a round end: it presses and is felt, and never cuts.
#pragma once

#include "sim_server/instruments/instrument.h"

namespace sectio {

InstrumentKind probe();

// Felt where its shaft crosses; no way of moving it cuts.
Leaf probe_decide(const Situation& situation);

}  // namespace sectio
