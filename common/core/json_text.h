// Values as JSON, for scripts of the page.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

namespace sectio {

class JsonText {
 public:
  JsonText& open(char bracket) { return raw(std::string(1, bracket)); }
  JsonText& close(char bracket) {
    text_ += bracket;
    comma_ = true;
    return *this;
  }
  JsonText& key(std::string_view name) {
    value(name);
    text_ += ':';
    comma_ = false;
    return *this;
  }
  JsonText& value(std::string_view text) {
    separate();
    text_ += '"';
    for (const char c : text) {
      if (c == '"' || c == '\\') text_ += '\\';
      text_ += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
    text_ += '"';
    return *this;
  }
  JsonText& value(const char* text) { return value(std::string_view(text)); }
  JsonText& value(double number) {
    separate();
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", std::isfinite(number) ? number : 0.0);
    text_ += text;
    return *this;
  }
  JsonText& value(bool yes) { return separate().append(yes ? "true" : "false"); }
  JsonText& value(std::uint64_t number) { return separate().append(std::to_string(number)); }
  JsonText& value(std::uint32_t number) { return value(std::uint64_t{number}); }
  JsonText& null() { return separate().append("null"); }

  const std::string& text() const { return text_; }

 private:
  JsonText& raw(const std::string& bracket) {
    separate();
    text_ += bracket;
    comma_ = false;
    return *this;
  }
  JsonText& separate() {
    if (comma_) text_ += ',';
    comma_ = true;
    return *this;
  }
  JsonText& append(const std::string& text) {
    text_ += text;
    return *this;
  }

  std::string text_;
  bool comma_ = false;
};

}  // namespace sectio
