#include "common/core/log.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <mutex>

#include "common/core/wall_time.h"

namespace sectio {
namespace {

struct Logger {
  std::string program = "sectio";
  LogLevel least = LogLevel::info;
  spdlog::logger err{"err", std::make_shared<spdlog::sinks::stderr_sink_mt>()};
  std::mutex limit_mutex;
  RateLimit limit{1.0};

  Logger() { err.set_pattern("%v"); }
};

Logger& logger() {
  static Logger instance;
  return instance;
}

}  // namespace

void set_log_program(std::string_view program) {
  logger().program = program;
}

void set_log_level(LogLevel least) {
  logger().least = least;
}

void log(LogLevel level, std::string_view text) {
  Logger& to = logger();
  if (level < to.least) return;
  std::string line = to.program;
  line += level == LogLevel::info ? ": " : level == LogLevel::warning ? ": warning: " : ": error: ";
  line += text;
  for (char& c : line) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  }
  to.err.info(spdlog::string_view_t(line));
}

void log_limited(LogLevel level, std::string_view key, std::string_view text) {
  std::optional<std::uint64_t> held_back;
  {
    const std::lock_guard lock(logger().limit_mutex);
    held_back = logger().limit.pass(key, steady_now_s());
  }
  if (!held_back) return;
  std::string line(text);
  if (*held_back > 0) line += " (and " + std::to_string(*held_back) + " more like this)";
  log(level, line);
}

std::optional<std::uint64_t> RateLimit::pass(std::string_view key, double now_s) {
  const auto found = entries_.find(key);
  if (found == entries_.end()) {
    entries_.emplace(std::string(key), Entry{now_s, 0});
    return 0;
  }
  Entry& entry = found->second;
  if (now_s - entry.passed_s < interval_s_) {
    ++entry.held_back;
    return std::nullopt;
  }
  const std::uint64_t held_back = entry.held_back;
  entry = {now_s, 0};
  return held_back;
}

}  // namespace sectio
