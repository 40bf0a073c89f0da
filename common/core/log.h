// One plain line a message, "program: warning: text", to standard error: standard output is for results alone.
// Safe from any thread; takes a lock and does I/O, so never from a real-time loop.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace sectio {

enum class LogLevel : std::uint8_t { info, warning, error };

// Sets the name at the beginning of every line. Call once, before any other thread logs.
void set_log_program(std::string_view program);

// Messages below this level are not written. Call once, before any other thread logs.
void set_log_level(LogLevel least);

// Control characters in the text (a peer may have sent them) are written as spaces.
void log(LogLevel level, std::string_view text);
inline void log_info(std::string_view text) {
  log(LogLevel::info, text);
}
inline void log_warning(std::string_view text) {
  log(LogLevel::warning, text);
}
inline void log_error(std::string_view text) {
  log(LogLevel::error, text);
}

// At most one line a second for each key; the next line says how many were left out. No key comes from a peer.
void log_limited(LogLevel level, std::string_view key, std::string_view text);

// The arithmetic behind log_limited, without clock or lock.
class RateLimit {
 public:
  explicit RateLimit(double interval_s) : interval_s_(interval_s) {}

  // The number of calls held back since the last one that passed, or nothing when this one is held back too.
  std::optional<std::uint64_t> pass(std::string_view key, double now_s);

 private:
  struct Entry {
    double passed_s = 0;
    std::uint64_t held_back = 0;
  };
  double interval_s_;
  std::map<std::string, Entry, std::less<>> entries_;
};

}  // namespace sectio
