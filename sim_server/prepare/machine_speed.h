// What the models cost on this machine.
#pragma once

#include <optional>
#include <string>

#include "sim_server/planning/plan.h"

namespace sectio {

// Steps small blocks of every model, in a fraction of a second: the processor's time, the least of several tries.
planning::Calibration measure_calibration();

// From the user's cache ($XDG_CACHE_HOME, else ~/.cache, /sectio/calibration.txt) when it was measured on a processor
// of this name; else, or when asked for, measured and put there. A file that can't be read is said in one line of the
// log and measured anew; a cache that can't be written is no error.
planning::Calibration calibration_of_this_machine(bool anew = false);

// The file's text; nothing when it is damaged or of another processor.
std::string to_text(const planning::Calibration& calibration, const std::string& processor);
std::optional<planning::Calibration> calibration_from(const std::string& text, const std::string& processor);

}  // namespace sectio
