#include "common/core/arguments.h"

#include <iconv.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <limits>
#include <string_view>

#include "common/core/error.h"
#include "common/core/log.h"
#include "common/core/words.h"

namespace sectio {

namespace {

struct Command {
  CLI::App* app = nullptr;
  std::unique_ptr<Arguments> arguments;
  Arguments::Action action;
};

LogLevel level_of(const std::string& name) {
  return name == "error" ? LogLevel::error : name == "warning" ? LogLevel::warning : LogLevel::info;
}

// Names and paths go into reports and messages, which are UTF-8 that can be printed.
bool can_be_printed(std::string word) {
  if (!is_printable(word)) return false;
  std::string read(4 * word.size() + 4, 0);
  char *in = word.data(), *out = read.data();
  std::size_t in_bytes = word.size(), out_bytes = read.size();
  const iconv_t converter = ::iconv_open("UTF-32", "UTF-8");
  const bool is_whole = ::iconv(converter, &in, &in_bytes, &out, &out_bytes) != static_cast<std::size_t>(-1);
  ::iconv_close(converter);
  return is_whole;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

}  // namespace

struct Arguments::Parser {
  std::unique_ptr<CLI::App> owned;  // the program's parser; commands belong to it
  CLI::App* app = nullptr;
  std::string log_level = "info";
  std::vector<CLI::Option*> required;
  std::vector<Command> commands;

  const Command* named() const {
    const auto found = std::find_if(commands.begin(), commands.end(), [](const Command& c) { return c.app->parsed(); });
    return found == commands.end() ? nullptr : &*found;
  }
  std::string nearest_command(const std::string& word) const {
    std::vector<std::string> names;
    for (const Command& command : commands) names.push_back(command.app->get_name());
    return nearest_word(word, names);
  }
  // Among the flags of the command that the line names, or else of the program.
  std::string nearest_flag(const std::string& word) const {
    std::vector<std::string> flags;
    for (const CLI::Option* option : (named() ? named()->app : app)->get_options())
      for (const std::string& name : option->get_lnames()) flags.push_back("--" + name);
    return nearest_word(word.substr(0, word.find('=')), flags);
  }
  // CLI11 would name a missing flag before an unknown one, so it is not told which are required until it prints help.
  void require(bool is) {
    for (CLI::Option* option : required) option->required(is);
    for (const Command& command : commands) command.arguments->parser_->require(is);
  }
  void check_required() const {
    for (const CLI::Option* option : required)
      if (option->count() == 0) throw InputError(option->get_name() + " is required (see --help)");
  }
  // Flags of the program say nothing to a command.
  void check_unused(const Command& command) const {
    for (const CLI::Option* option : app->get_options())
      if (option->count() > 0)
        throw InputError(option->get_name() + ": the command " + command.app->get_name() + " has no use for it");
  }
};

Arguments::Arguments(const std::string& program, const std::string& purpose)
    : Arguments([&] {
        auto parser = std::make_unique<Parser>();
        parser->owned = std::make_unique<CLI::App>(purpose, program);
        parser->owned->set_version_flag("--version", program + " " SECTIO_VERSION);
        parser->app = parser->owned.get();
        return parser;
      }()) {}

Arguments::Arguments(std::unique_ptr<Parser> parser) : parser_(std::move(parser)) {
  choice("--log-level", parser_->log_level, {"info", "warning", "error"}, "least important messages to be written");
}

Arguments::~Arguments() = default;

template <class T>
void Arguments::option(const std::string& flag, T& value, const std::string& meaning, Need need) {
  CLI::Option* option = parser_->app->add_option(flag, value, meaning);
  if (need == Need::required) {
    option->required();
    parser_->required.push_back(option);
  } else {
    option->capture_default_str();
  }
  // Each flag takes one word: `--peer HOST SCENE` is not two peers.
  if constexpr (std::is_same_v<T, std::vector<std::string>>)
    option->expected(1)->allow_extra_args(!flag.starts_with('-'))->take_all();
  // A variable that isn't set is no way to leave the flag out: nothing would be exported.
  if constexpr (std::is_same_v<T, std::string>)
    if (value.empty())
      option->check([](const std::string& text) { return text.empty() ? "expected a word, got an empty one" : ""; });
  if constexpr (std::is_same_v<T, double>) {
    option->check([](const std::string& text) {
      double number = 0;
      return CLI::detail::lexical_cast(text, number) && std::isfinite(number) ? ""
                                                                              : "expected a finite number, got " + text;
    });
  }
  // The conversion behind it wraps what is too large and takes 010 for 8: it gets what has been read here.
  if constexpr (std::is_integral_v<T>) {
    const auto read = [](std::string& text) {
      T number = 0;
      const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
      if (error != std::errc() || rest != text.data() + text.size())
        return "expected a whole number from " + std::to_string(std::numeric_limits<T>::min()) + " to " +
               std::to_string(std::numeric_limits<T>::max()) + ", got " + text;
      text = std::to_string(number);
      return std::string();
    };
    option->transform(CLI::Validator(read, ""));
  }
}

template void Arguments::option(const std::string&, std::string&, const std::string&, Need);
template void Arguments::option(const std::string&, double&, const std::string&, Need);
template void Arguments::option(const std::string&, int&, const std::string&, Need);
template void Arguments::option(const std::string&, std::uint32_t&, const std::string&, Need);
template void Arguments::option(const std::string&, std::uint64_t&, const std::string&, Need);
template void Arguments::option(const std::string&, std::vector<std::string>&, const std::string&, Need);

void Arguments::choice(const std::string& flag, std::string& value, const std::vector<std::string>& allowed,
                       const std::string& meaning) {
  parser_->app->add_option(flag, value, meaning)->capture_default_str()->check(CLI::IsMember(allowed));
}

void Arguments::toggle(const std::string& flag, bool& value, const std::string& meaning) {
  parser_->app->add_flag(flag, value, meaning);
}

void Arguments::command(const std::string& name, const std::string& purpose,
                        const std::function<Action(Arguments&)>& declare) {
  auto parser = std::make_unique<Parser>();
  parser->app = parser_->app->add_subcommand(name, purpose);
  Command command{parser->app, std::unique_ptr<Arguments>(new Arguments(std::move(parser))), {}};
  command.action = declare(*command.arguments);
  parser_->commands.push_back(std::move(command));
}

bool Arguments::parse(int argc, const char* const* argv) {
  for (int n = 1; n < argc; ++n) {
    if (can_be_printed(argv[n])) continue;
    const bool has_flag = n > 1 && std::string_view(argv[n - 1]).starts_with("--");
    throw InputError((has_flag ? argv[n - 1] : "argument " + std::to_string(n)) +
                     std::string(": expected text that can be printed, in UTF-8"));
  }
  try {
    parser_->require(false);
    parser_->app->parse(argc, argv);
  } catch (const CLI::ExtrasError&) {
    const std::vector<std::string> unknown = parser_->app->remaining(true);
    const bool is_command = !parser_->commands.empty() && !parser_->named() && !unknown.front().starts_with('-');
    if (std::error_code none; is_command && std::filesystem::exists(unknown.front(), none))
      throw InputError("not expected: " + unknown.front() + ", a file without its flag (see --help)");
    const std::string meant =
        is_command ? parser_->nearest_command(unknown.front()) : parser_->nearest_flag(unknown.front());
    throw InputError((is_command ? "unknown command: " + unknown.front() : "not expected: " + joined(unknown)) +
                     (meant.empty() ? " (see --help)" : "; did you mean " + meant + "?"));
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) throw InputError(std::string(error.what()) + " (see --help)");
    parser_->require(true);
    parser_->app->exit(error);
    return false;
  }
  const Command* const command = parser_->named();
  if (command) parser_->check_unused(*command);
  const Parser& used = command ? *command->arguments->parser_ : *parser_;
  used.check_required();
  set_log_level(level_of(used.log_level));
  return true;
}

int Arguments::run(int argc, const char* const* argv, const Action& without_command) {
  if (!parse(argc, argv)) return 0;
  const Command* const command = parser_->named();
  return command ? command->action() : without_command();
}

int run_program(const std::string& program, const std::function<int()>& body) {
  set_log_program(program);
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    const int exit_code = body();
    if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return exit_code;
    log_error(std::string("standard output: can't be written: ") + std::strerror(errno));
    return exit_code == 0 ? 1 : exit_code;
  } catch (const InputError& error) {
    log_error(error.what());
    return kExitBadInput;
  } catch (const std::exception& error) {
    log_error(error.what());
    return 1;
  }
}

}  // namespace sectio
