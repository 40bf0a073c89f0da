#include "common/core/arguments.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include "common/core/error.h"
#include "common/core/log.h"

namespace sectio {

struct Arguments::Parser {
  Parser(const std::string& program, const std::string& purpose) : app(purpose, program) {}
  CLI::App app;
};

Arguments::Arguments(const std::string& program, const std::string& purpose)
    : parser_(std::make_unique<Parser>(program, purpose)) {
  parser_->app.set_version_flag("--version", program + " " SECTIO_VERSION);
}

Arguments::~Arguments() = default;

template <class T>
void Arguments::option(const std::string& flag, T& value, const std::string& what, Need need) {
  CLI::Option* option = parser_->app.add_option(flag, value, what);
  if (need == Need::required) {
    option->required();
  } else {
    option->capture_default_str();
  }
  if constexpr (std::is_same_v<T, std::vector<std::string>>) option->expected(1)->take_all();
  if constexpr (std::is_same_v<T, double>) {
    option->check([](const std::string& text) {
      double number = 0;
      return CLI::detail::lexical_cast(text, number) && std::isfinite(number) ? ""
                                                                              : "expected a finite number, got " + text;
    });
  }
  if constexpr (std::is_unsigned_v<T>) {  // strtoull, which is behind it, turns -1 into the greatest number of all
    option->check([](const std::string& text) {
      return text.find('-') == std::string::npos ? "" : "expected >= 0, got " + text;
    });
  }
}

template void Arguments::option(const std::string&, std::string&, const std::string&, Need);
template void Arguments::option(const std::string&, double&, const std::string&, Need);
template void Arguments::option(const std::string&, int&, const std::string&, Need);
template void Arguments::option(const std::string&, std::uint32_t&, const std::string&, Need);
template void Arguments::option(const std::string&, std::uint64_t&, const std::string&, Need);
template void Arguments::option(const std::string&, std::vector<std::string>&, const std::string&, Need);

void Arguments::choice(const std::string& flag, std::string& value, const std::vector<std::string>& allowed,
                       const std::string& what) {
  parser_->app.add_option(flag, value, what)->capture_default_str()->check(CLI::IsMember(allowed));
}

void Arguments::toggle(const std::string& flag, bool& value, const std::string& what) {
  parser_->app.add_flag(flag, value, what);
}

bool Arguments::parse(int argc, const char* const* argv) {
  try {
    parser_->app.parse(argc, argv);
    return true;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) throw InputError(std::string(error.what()) + " (see --help)");
    parser_->app.exit(error);
    return false;
  }
}

int run_program(const std::string& program, const std::function<int()>& body) {
  set_log_program(program);
  try {
    return body();
  } catch (const InputError& error) {
    log_error(error.what());
    return kExitBadInput;
  } catch (const std::exception& error) {
    log_error(error.what());
    return 1;
  }
}

}  // namespace sectio
