// A cautery hook. The probe AC deforms; the virtual tip CD beyond it cuts in any direction where it is in the tissue.
#pragma once

#include "sim_server/instruments/instrument.h"

namespace sectio {

InstrumentKind cautery_hook();

}  // namespace sectio
