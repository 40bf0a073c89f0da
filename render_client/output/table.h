// A table in a file: CSV with a header.
#pragma once

#include <string>
#include <vector>

namespace sectio {

// The columns of these names, in this order; each has a number for every line. Throws InputError that names the line
// when a number can't be read.
std::vector<std::vector<double>> read_columns(const std::string& path, const std::vector<std::string>& names);

// A column as text; a cell that a line doesn't have is empty.
std::vector<std::string> read_text_column(const std::string& path, const std::string& name);

}  // namespace sectio
