#include "render_client/output/table.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <sstream>

#include "common/core/error.h"

namespace sectio {
namespace {

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream text(line);
  for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
  return cells;
}

double number(const std::string& path, std::size_t line, const std::vector<std::string>& cells, std::size_t at) {
  double value = 0;
  const std::string& text = at < cells.size() ? cells[at] : "";
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size())
    throw InputError(path + ":" + std::to_string(line) + ": expected a number, got '" + text + "'");
  return value;
}

}  // namespace

std::vector<std::vector<double>> read_columns(const std::string& path, const std::vector<std::string>& names) {
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) throw InputError(path + ": can't be read, or is empty");
  const std::vector<std::string> header = cells_of(line);
  std::vector<std::size_t> at;
  for (const std::string& name : names) {
    const auto found = std::find(header.begin(), header.end(), name);
    if (found == header.end()) throw InputError(std::string(path).append(":1: no column ").append(name));
    at.push_back(static_cast<std::size_t>(found - header.begin()));
  }
  std::vector<std::vector<double>> columns(names.size());
  for (std::size_t n = 2; std::getline(file, line); ++n) {
    const std::vector<std::string> cells = cells_of(line);
    for (std::size_t i = 0; i < at.size(); ++i) columns[i].push_back(number(path, n, cells, at[i]));
  }
  return columns;
}

}  // namespace sectio
