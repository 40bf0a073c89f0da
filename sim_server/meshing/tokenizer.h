// Splits a text file into tokens for readers. Every error names the line, and a count in a file is accepted only if the
// file is long enough for it.
#pragma once

#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/error.h"
#include "common/core/words.h"

namespace sectio {

class Tokenizer {
 public:
  explicit Tokenizer(const std::string& path) : path_(path) {
    std::error_code error;
    const auto size = std::filesystem::file_size(path, error);
    if (error) throw InputError(path + ": no such file");
    if (size > kLargestFile) throw InputError(path + ": larger than " + std::to_string(kLargestFile) + " bytes");
    std::ifstream in(path, std::ios::binary);
    text_.assign(std::istreambuf_iterator<char>(in), {});
    if (!in) throw InputError(path + ": can't be read");
  }

  // From now on '#' begins a comment that ends with its line.
  void skip_comments() { comments_ = true; }

  [[noreturn]] void fail(const std::string& why) const {
    throw InputError(path_ + ":" + std::to_string(line_) + ": " + why);
  }

  bool at_end() {
    skip_blanks();
    return at_ == text_.size();
  }
  std::string_view next() {
    if (at_end()) fail("the file ends too early");
    const std::size_t first = at_;
    while (at_ < text_.size() && !is_blank(text_[at_])) ++at_;
    return std::string_view(text_).substr(first, at_ - first);
  }
  // Returns the rest of this line.
  std::string_view rest_of_line() {
    const std::size_t first = at_, end = std::min(text_.find('\n', at_), text_.size());
    at_ = end;
    return std::string_view(text_).substr(first, end - first);
  }
  double real() {
    const std::string_view word = next();
    const std::optional<double> value = finite_number(word);
    if (!value) fail("expected a number, got " + shortened(word));
    return *value;
  }
  std::int64_t integer() {
    const std::string_view word = next();
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size())
      fail("expected a whole number, got " + shortened(word));
    return value;
  }
  // Reads the number of entries that follow, each of at least `tokens` tokens.
  std::size_t count(std::size_t tokens) {
    const std::int64_t n = integer();
    if (n < 0 || static_cast<std::uint64_t>(n) > (text_.size() - at_) / (2 * tokens) + 1)
      fail("the file is too short for " + std::to_string(n) + " entries");
    return static_cast<std::size_t>(n);
  }
  void expect(std::string_view word) {
    if (next() != word) fail("expected " + std::string(word));
  }

 private:
  static constexpr std::uintmax_t kLargestFile = 1'000'000'000;
  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
  void skip_blanks() {
    for (; at_ < text_.size(); ++at_) {
      if (comments_ && text_[at_] == '#') at_ = std::min(text_.find('\n', at_), text_.size() - 1);
      if (!is_blank(text_[at_])) return;
      line_ += text_[at_] == '\n';
    }
  }
  std::string path_;
  std::string text_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
  bool comments_ = false;
};

}  // namespace sectio
