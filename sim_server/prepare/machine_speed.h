// Measures the processor's time that the models take on this machine.
#pragma once

#include <optional>
#include <string>

#include "sim_server/engine/engine_table.h"
#include "sim_server/planning/plan.h"

namespace sectio {

// Steps small blocks of every model, in a fraction of a second: the processor's time, the least of several tries.
planning::Calibration measure_calibration(const EngineTable& engines);

// The speed from the user's cache (sectio/calibration.txt in $XDG_CACHE_HOME, else in ~/.cache) when it was measured on
// a processor of this name, for all these models; otherwise, or with `anew`, measured and put there. A cache that can't
// be read is reported in one line of the log and measured anew; a cache that can't be written is no error.
planning::Calibration calibration_of_this_machine(const EngineTable& engines, bool anew = false);

// The file's text, and its reader: nothing when the text is damaged or belongs to another processor.
std::string to_text(const planning::Calibration& calibration, const std::string& processor);
std::optional<planning::Calibration> calibration_from(const std::string& text, const std::string& processor);

}  // namespace sectio
