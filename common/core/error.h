// Errors, one way for each kind: a bug of ours asserts, bad input throws InputError.
#pragma once

#include <stdexcept>
#include <string>

namespace sectio {

// Bad scene, mesh, trace or flag: one line that names the place ("liver.yaml:14: bodies[0].young_pa: expected > 0").
// Programs print it and exit with kExitBadInput.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

constexpr int kExitBadInput = 2;

[[noreturn]] void assertion_failed(const char* condition, const char* text, const char* file, int line);

}  // namespace sectio

// Enabled in the ci, asan and tsan presets; in release builds the condition is not evaluated.
#if SECTIO_CHECKED
#define SECTIO_ASSERT(condition, text) \
  ((condition) ? static_cast<void>(0) : ::sectio::assertion_failed(#condition, text, __FILE__, __LINE__))
#else
#define SECTIO_ASSERT(condition, text) static_cast<void>(sizeof(!(condition)))
#endif
