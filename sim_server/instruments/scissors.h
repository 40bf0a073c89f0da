// The scissors of paper A, 2.3: two blades about a pivot, which cut where their edges cross while they close. Otherwise
// they only push.
//
// Each straight edge passes the pivot at a distance w on the side of the other blade. So the edges cross on the
// bisector, at w / sin(opening / 2) from the pivot: the crossing moves from the pivot to the tips as the blades close.
// Tissue at the crossing is cut from the back of the lower blade up to the place from which the upper one came; a
// volume that lies between the blades, as a vessel, down to the place from which the lower one came.
//
//        upper blade
//    C ----__
//    |        X ---> A    the crossing, which moves along the bisector CA
//      ----~~
//        lower blade  D   D: the back of the lower blade, when closed
#pragma once

#include "sim_server/instruments/instrument.h"

namespace sectio {

InstrumentKind scissors();

InstrumentShape scissors_shape(const ToolGeometry& geometry, const InstrumentState& state);
CutDecision scissors_decide(const Situation& situation);
std::string scissors_flaw(const ToolGeometry& geometry);

}  // namespace sectio
