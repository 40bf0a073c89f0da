// A text with numbers, by the formats of printf: formatted("%.3g N in %.2f s", force_n, time_s).
#pragma once

#include <string>

namespace sectio {

[[gnu::format(printf, 1, 2)]] std::string formatted(const char* format, ...);

}  // namespace sectio
