// The scalpel of paper B, figures 3 and 4: the edge AC cuts in one direction; the shaft and the front only deform.
#pragma once

#include "sim_server/instruments/instrument.h"

namespace sectio {

InstrumentKind scalpel();

// Shared with other instruments that have a blade.
InstrumentShape scalpel_shape(const ToolGeometry& geometry, const InstrumentState& state);
std::string blade_flaw(const ToolGeometry& geometry);
// Checks that the corners of an instrument with a shaft are apart.
std::string corners_flaw(const ToolGeometry& geometry);

}  // namespace sectio
