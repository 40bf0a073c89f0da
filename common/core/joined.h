// A list for a person: "liver, kidney".
#pragma once

#include <ranges>
#include <string>

namespace sectio {

template <std::ranges::input_range Words>
std::string joined(Words&& words) {
  std::string text;
  for (const auto& word : words) {
    if (!text.empty()) text += ", ";
    text += word;
  }
  return text;
}

}  // namespace sectio
