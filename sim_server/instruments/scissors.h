// Paper A, 2.3: two blades about a pivot. They cut where their edges cross, while they close; open they only push.
//
// Each straight edge passes the pivot at a distance w on the side of the other blade. So the edges cross on the
// bisector, at w / sin(opening / 2) from the pivot: the crossing runs from the pivot to the tips as the blades close.
// What is there is severed, down to the back of the lower blade, and upwards as far as the upper one came down.
//
//        upper blade
//    C ----__
//    |        X ---> A    the crossing on its way along the bisector CA
//      ----~~
//        lower blade  D   D: its back, when closed
#pragma once

#include "sim_server/instruments/instrument.h"

namespace sectio {

InstrumentKind scissors();

InstrumentShape scissors_shape(const ToolGeometry& geometry, const InstrumentState& state);
Leaf scissors_decide(const Situation& situation);
std::string scissors_flaw(const ToolGeometry& geometry);

}  // namespace sectio
