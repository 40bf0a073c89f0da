// A table in a file: CSV with a header.
#pragma once

#include <string>
#include <vector>

namespace sectio {

// The columns with the names given, in that order; each has a number for every line. Throws InputError with the line of
// what can't be read.
std::vector<std::vector<double>> read_columns(const std::string& path, const std::vector<std::string>& names);

// A column as text; what a line doesn't have is empty.
std::vector<std::string> read_text_column(const std::string& path, const std::string& name);

}  // namespace sectio
