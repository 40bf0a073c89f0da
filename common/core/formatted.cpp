#include "common/core/formatted.h"

#include <algorithm>
#include <cstdarg>
#include <cstdio>

namespace sectio {

std::string formatted(const char* format, ...) {
  constexpr std::size_t kUsual_bytes = 256;
  std::string text(kUsual_bytes, '\0');
  va_list arguments, again;
  va_start(arguments, format);
  va_copy(again, arguments);
  const auto bytes = static_cast<std::size_t>(std::max(0, std::vsnprintf(text.data(), text.size(), format, arguments)));
  const bool fits = bytes < text.size();
  text.resize(bytes + 1);
  if (!fits) std::vsnprintf(text.data(), text.size(), format, again);
  text.resize(bytes);
  va_end(again);
  va_end(arguments);
  return text;
}

}  // namespace sectio
