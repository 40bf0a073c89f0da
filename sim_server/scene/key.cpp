#include "sim_server/scene/key.h"

#include <array>
#include <cmath>
#include <string_view>

#include "common/core/formatted.h"

namespace sectio {
namespace {

std::string short_number(double x) {
  return formatted("%g", x);
}

// The symbol of a word in a key's name; empty: it is no unit.
std::string symbol_of(std::string_view word) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 18> kSymbols{{{"m", "m"},
                                                                                    {"m2", "m²"},
                                                                                    {"m3", "m³"},
                                                                                    {"s", "s"},
                                                                                    {"s2", "s²"},
                                                                                    {"kg", "kg"},
                                                                                    {"n", "N"},
                                                                                    {"pa", "Pa"},
                                                                                    {"j", "J"},
                                                                                    {"w", "W"},
                                                                                    {"k", "K"},
                                                                                    {"deg", "°"},
                                                                                    {"px", "px"},
                                                                                    {"hz", "Hz"},
                                                                                    {"rad", "rad"},
                                                                                    {"mm", "mm"},
                                                                                    {"ml", "ml"},
                                                                                    {"ms", "ms"}}};
  for (const auto& [name, symbol] : kSymbols)
    if (name == word) return std::string(symbol);
  return {};
}

}  // namespace

bool Range::contains(double x) const {
  return (x > low || (low_allowed && x == low)) && (x < high || (high_allowed && x == high));
}

bool Range::is_bounded() const {
  return std::isfinite(low) || std::isfinite(high);
}

std::string Range::text() const {
  if (!std::isfinite(high)) return (low_allowed ? ">= " : "> ") + short_number(low);
  return std::string("in ") + (low_allowed ? "[" : "(") + short_number(low) + ", " + short_number(high) +
         (high_allowed ? "]" : ")");
}

std::string Range::in_words() const {
  if (low == high) return short_number(low);
  if (!std::isfinite(high)) return "at least " + short_number(low);
  if (!std::isfinite(low)) return "at most " + short_number(high);
  return short_number(low) + " to " + short_number(high);
}

Range above(double low) {
  return {low, Range().high, false, false};
}
Range at_least(double low) {
  return {low, Range().high, true, false};
}
Range between(double low, double high) {
  return {low, high, true, true};
}
Range from_to_below(double low, double high) {
  return {low, high, true, false};
}
Range above_to(double low, double high) {
  return {low, high, false, true};
}

std::string unit_of(const std::string& key_name) {
  std::string unit, name = key_name;
  for (std::size_t bar; (bar = name.rfind('_')) != std::string::npos; name.resize(bar)) {
    const std::string word = name.substr(bar + 1);
    if (word == "per") {
      unit = "/" + unit;
      continue;
    }
    const std::string symbol = symbol_of(word);
    if (symbol.empty()) break;
    unit = symbol + (unit.empty() || unit[0] == '/' ? "" : "·") + unit;
  }
  return unit.starts_with('/') ? "1" + unit : unit;
}

}  // namespace sectio
