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

struct Lines {
  explicit Lines(const std::string& file) : path(file) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) cells.push_back(cells_of(line));
    if (cells.empty()) throw InputError(path + ": can't be read, or is empty");
  }
  std::size_t column(const std::string& name) const {
    const auto found = std::find(cells[0].begin(), cells[0].end(), name);
    if (found == cells[0].end()) throw InputError(std::string(path).append(":1: no column ").append(name));
    return static_cast<std::size_t>(found - cells[0].begin());
  }
  std::string path;
  std::vector<std::vector<std::string>> cells;  // cells of the header, then of every line
};

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
  const Lines lines(path);
  std::vector<std::vector<double>> columns(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::size_t at = lines.column(names[i]);
    for (std::size_t n = 1; n < lines.cells.size(); ++n) columns[i].push_back(number(path, n + 1, lines.cells[n], at));
  }
  return columns;
}

std::vector<std::string> read_text_column(const std::string& path, const std::string& name) {
  const Lines lines(path);
  const std::size_t at = lines.column(name);
  std::vector<std::string> column;
  for (std::size_t n = 1; n < lines.cells.size(); ++n)
    column.push_back(at < lines.cells[n].size() ? lines.cells[n][at] : "");
  return column;
}

}  // namespace sectio
