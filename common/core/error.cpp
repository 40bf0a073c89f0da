#include "common/core/error.h"

#include <cstdio>
#include <cstdlib>

namespace sectio {

void assertion_failed(const char* condition, const char* text, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: assertion failed: %s (%s)\n", file, line, condition, text);
  std::abort();
}

}  // namespace sectio
