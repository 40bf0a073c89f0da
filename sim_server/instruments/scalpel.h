// Paper B, figures 3 and 4: the edge AC cuts, in one direction; the shaft and the front only deform.
#pragma once

#include "sim_server/instruments/instrument.h"

namespace sectio {

InstrumentKind scalpel();

// Parts that other instruments with a blade have in common with it.
InstrumentShape scalpel_shape(const ToolGeometry& geometry, const InstrumentState& state);
std::string blade_flaw(const ToolGeometry& geometry);
// Corners of any instrument with a shaft must be apart.
std::string corners_flaw(const ToolGeometry& geometry);

}  // namespace sectio
