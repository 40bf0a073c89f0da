// A rod with a round end, which presses and never cuts.
#pragma once

#include "sim_server/instruments/instrument.h"

namespace sectio {

InstrumentKind probe();

// Deforms the tissue where the shaft crosses the surface; no motion cuts.
CutDecision probe_decide(const Situation& situation);

}  // namespace sectio
