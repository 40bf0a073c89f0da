// Words that a person has written: numbers among them, and how a message quotes them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sectio {

// A finite decimal number and nothing else, in whatever country the machine stands: "-0.25", "+1e-3".
std::optional<double> finite_number(std::string_view text);

// No control characters are in it.
bool is_printable(std::string_view text);

// One line of at most `bytes`, 3 or more; "..." stands for a rest.
std::string shortened(std::string_view text, std::size_t bytes = 40);

// The candidate that differs least from `word` by letters put in, left out or changed, when it is near enough to be
// meant; "" otherwise.
std::string nearest_word(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace sectio
