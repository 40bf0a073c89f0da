#include "sim_server/mesh_reader/plain_obj.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "common/core/words.h"

namespace sectio {
namespace {

// Digits before the point that assimp takes for a number of 64 bits, and bytes of a number before its exponent: behind
// the point it reads 15 digits.
constexpr std::size_t kMostDigits = 18, kMostMantissa = 16;

bool is_plain(std::string_view number) {
  if (number.starts_with('-') || number.starts_with('+')) number.remove_prefix(1);
  const std::size_t digits = std::min(number.find_first_not_of("0123456789"), number.size());
  const std::size_t exponent = number.find_first_of("eE");
  return digits > 0 && digits <= kMostDigits && (exponent == std::string_view::npos || exponent <= kMostMantissa);
}

class PlainObj {
 public:
  explicit PlainObj(std::string text) : text_(std::move(text)) {}

  std::string written() {
    constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
    if (text_.starts_with(kByteOrderMark)) leave_out(kByteOrderMark.size());
    while (at_ < text_.size()) read_line();
    if (vertices_ == 0) throw std::runtime_error("no vertex in the file");
    if (highest_ > vertices_) fail(line_of_highest_, no_vertex(std::to_string(highest_)));
    return copied_ == 0 ? std::string() : written_.append(text_, copied_);
  }

 private:
  [[noreturn]] static void fail(std::size_t line, const std::string& flaw) {
    throw std::runtime_error("line " + std::to_string(line) + ": " + flaw);
  }
  std::string no_vertex(const std::string& number) const {
    return "there is no vertex " + number + " among " + std::to_string(vertices_);
  }

  // The words up to the end of a line or to a comment, also on lines that a backslash adds.
  void read_line() {
    const std::size_t line = line_;
    words_.clear();
    const std::size_t blanks = std::min(text_.find_first_not_of(" \t", at_), text_.size()) - at_;
    if (blanks > 0) leave_out(blanks);
    for (bool comment = false; at_ < text_.size();) {
      const std::size_t end = std::min(text_.find_first_of(" \t\r\n", at_), text_.size());
      const std::string_view word = std::string_view(text_).substr(at_, end - at_);
      const bool ends_line = end == text_.size() || text_[end] == '\r' || text_[end] == '\n';
      const bool goes_on = ends_line && word.ends_with('\\');
      comment = comment || word.starts_with('#');
      if (const std::string_view said = word.substr(0, word.size() - goes_on); !said.empty() && !comment)
        words_.push_back(said);
      at_ = std::min(end + 1, text_.size());
      if (!ends_line) continue;
      if (end + 1 < text_.size() && text_[end] == '\r' && text_[end + 1] == '\n') ++at_;
      ++line_;
      if (!goes_on) break;
    }
    if (words_.empty()) return;
    if (words_[0] == "v") read_vertex(line);
    if (words_[0] == "f") read_face(line);
  }

  // Behind x, y and z may stand a weight, or a colour.
  void read_vertex(std::size_t line) {
    ++vertices_;
    if (words_.size() < 4) fail(line, "expected three numbers behind v");
    for (std::size_t i = 1; i < words_.size(); ++i) {
      const std::optional<double> number = finite_number(words_[i]);
      if (!number) fail(line, "expected a finite number, got \"" + shortened(words_[i]) + "\"");
      if (!is_plain(words_[i])) write_number(words_[i], *number);
    }
  }

  void read_face(std::size_t line) {
    if (words_.size() < 4) fail(line, "a face needs three vertices");
    for (std::size_t i = 1; i < words_.size(); ++i) {
      const std::string_view word = words_[i].substr(0, words_[i].find('/'));
      std::int64_t number = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
      if (error != std::errc() || end != word.data() + word.size())
        fail(line, "expected the number of a vertex, got \"" + shortened(words_[i]) + "\"");
      if (number == 0) fail(line, "vertices are counted from 1, got 0");
      if (number < -vertices_) fail(line, no_vertex(std::string(word)));
      if (number <= highest_) continue;
      highest_ = number;
      line_of_highest_ = line;
    }
  }

  void write_number(std::string_view word, double number) {
    std::array<char, 32> text;
    const auto end = std::to_chars(text.data(), text.data() + text.size(), number, std::chars_format::scientific).ptr;
    replace(word, {text.data(), end});
  }

  void leave_out(std::size_t bytes) {
    replace(std::string_view(text_).substr(at_, bytes), "");
    at_ += bytes;
  }

  void replace(std::string_view part, std::string_view by) {
    const auto from = static_cast<std::size_t>(part.data() - text_.data());
    written_.append(text_, copied_, from - copied_).append(by);
    copied_ = from + part.size();
  }

  std::string text_, written_;
  std::size_t at_ = 0, copied_ = 0, line_ = 1, line_of_highest_ = 0;
  std::int64_t vertices_ = 0, highest_ = 0;
  std::vector<std::string_view> words_;
};

}  // namespace

std::string plain_obj(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return PlainObj({std::istreambuf_iterator<char>(file), {}}).written();
}

}  // namespace sectio
