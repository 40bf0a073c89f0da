#include "common/math/trace.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <string_view>

#include "common/core/error.h"
#include "common/core/joined.h"
#include "common/core/words.h"

namespace sectio {
namespace {

constexpr std::array<std::string_view, 8> kColumns{"time_s", "x_world_m", "y_world_m", "z_world_m",
                                                   "qw",     "qx",        "qy",        "qz"};
constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";  // spreadsheets begin UTF-8 with it
constexpr std::string_view kOpening = "opening_rad";         // optional
constexpr double kUnitTolerance = 1e-3;                      // largest deviation of a quaternion's length from 1
constexpr double kFarthest_m = 1000;                         // a hand is nearer than this to where the world begins
constexpr double kRounding = 1e-12;                          // one that deviates less stays as it is written
constexpr std::size_t kMostOfHeader = 100;                   // bytes of names in a message

struct Place {
  const std::string& file;
  std::size_t line = 0;

  [[noreturn]] void fail(std::string_view column, const std::string& what) const {
    throw InputError(file + ":" + std::to_string(line) + ": " + std::string(column) + ": " + what);
  }
};

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

// R and spreadsheets put names, and some of them all fields, between quotes.
std::string_view unquoted(std::string_view field) {
  field = trimmed(field);
  if (field.size() < 2 || field.front() != '"' || field.back() != '"') return field;
  return trimmed(field.substr(1, field.size() - 2));
}

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> fields;
  for (;;) {
    const auto comma = line.find(',');
    fields.push_back(unquoted(line.substr(0, comma)));
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

// The place of a column; that of none when there is no such column.
std::size_t find_column(const std::vector<std::string_view>& names, std::string_view column, const Place& at) {
  const auto found = std::ranges::find(names, column);
  if (found != names.end() && std::find(found + 1, names.end(), column) != names.end())
    at.fail(column, "column given twice");
  return static_cast<std::size_t>(found - names.begin());
}

std::array<std::size_t, kColumns.size()> find_columns(const std::vector<std::string_view>& names, const Place& at) {
  if (names.size() == 1)
    at.fail("columns", "expected commas between them, and points in numbers, got \"" + shortened(names[0]) + "\"");
  std::array<std::size_t, kColumns.size()> columns{};
  for (std::size_t k = 0; k < kColumns.size(); ++k) {
    columns[k] = find_column(names, kColumns[k], at);
    if (columns[k] == names.size())
      at.fail(kColumns[k], "column missing among " + shortened(joined(names), kMostOfHeader));
  }
  return columns;
}

double number(std::string_view text, std::string_view column, const Place& at) {
  const std::optional<double> value = finite_number(text);
  if (!value) at.fail(column, "expected a finite number, got \"" + shortened(text) + "\"");
  return *value;
}

TracePoint parse_point(const std::array<double, kColumns.size()>& v, const Place& at) {
  TracePoint point;
  point.time_s = v[0];
  for (std::size_t k = 1; k < 4; ++k)
    if (std::abs(v[k]) > kFarthest_m) at.fail(kColumns[k], "expected -1000 to 1000 m, got " + std::to_string(v[k]));
  point.pose_world.position_m = Vec3(v[1], v[2], v[3]);
  const Eigen::Quaterniond q(v[4], v[5], v[6], v[7]);
  if (std::abs(q.norm() - 1) > kUnitTolerance) {
    at.fail("qw", "expected a unit quaternion, got norm " + std::to_string(q.norm()));
  }
  point.pose_world.orientation = std::abs(q.norm() - 1) > kRounding ? q.normalized() : q;
  return point;
}

}  // namespace

std::vector<TracePoint> load_trace(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw InputError(path + ": can't be opened: " + std::strerror(errno));
  std::vector<TracePoint> trace;
  std::array<std::size_t, kColumns.size()> columns{};
  std::size_t width = 0, opening = 0;
  Place at{path};
  for (std::string line; std::getline(in, line);) {
    ++at.line;
    if (at.line == 1 && line.starts_with(kByteOrderMark)) line.erase(0, kByteOrderMark.size());
    const std::string_view text = trimmed(line);
    if (text.empty() || text.front() == '#') continue;
    const auto fields = split(text);
    if (width == 0) {
      columns = find_columns(fields, at);
      width = fields.size();
      opening = find_column(fields, kOpening, at);
      continue;
    }
    if (fields.size() != width) {
      at.fail("row", "expected " + std::to_string(width) + " columns, got " + std::to_string(fields.size()));
    }
    std::array<double, kColumns.size()> values{};
    for (std::size_t k = 0; k < kColumns.size(); ++k) values[k] = number(fields[columns[k]], kColumns[k], at);
    TracePoint point = parse_point(values, at);
    if (opening < width) point.opening_rad = number(fields[opening], kOpening, at);
    if (point.opening_rad < 0 || point.opening_rad > kWidestOpening_rad) at.fail(kOpening, "expected 0 to pi");
    if (!trace.empty() && point.time_s <= trace.back().time_s) at.fail("time_s", "times must ascend");
    trace.push_back(point);
  }
  if (in.bad()) throw InputError(path + ": can't be read: " + std::strerror(errno));
  if (trace.empty()) throw InputError(path + ": no point in this trace");
  return trace;
}

std::string trace_columns() {
  std::string line;
  for (const std::string_view column : kColumns) (line += column) += ',';
  return line += kOpening;
}

void append_trace_point(std::string& line, const TracePoint& point) {
  const Vec3& p = point.pose_world.position_m;
  const Eigen::Quaterniond& q = point.pose_world.orientation;
  for (const double value : {point.time_s, p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(), point.opening_rad}) {
    std::array<char, 32> text;
    line.append(text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr);
    line += ',';
  }
  line.pop_back();
}

TracePoint point_at(std::span<const TracePoint> trace, double time_s) {
  SECTIO_ASSERT(!trace.empty(), "a pose needs at least one point");
  const auto after = std::upper_bound(trace.begin(), trace.end(), time_s,
                                      [](double t, const TracePoint& point) { return t < point.time_s; });
  if (after == trace.begin()) return trace.front();
  if (after == trace.end()) return trace.back();
  const TracePoint& a = *(after - 1);
  const double s = (time_s - a.time_s) / (after->time_s - a.time_s);
  return {time_s, interpolate(a.pose_world, after->pose_world, s),
          a.opening_rad + s * (after->opening_rad - a.opening_rad)};
}

std::vector<TracePoint> moments_of(std::span<const TracePoint> trace, std::size_t count) {
  SECTIO_ASSERT(!trace.empty() && count > 1, "a trace has a beginning and an end");
  const double begin_s = trace.front().time_s, end_s = trace.back().time_s;
  std::vector<TracePoint> moments;
  for (std::size_t i = 0; i < count; ++i)
    moments.push_back(
        point_at(trace, begin_s + (end_s - begin_s) * static_cast<double>(i) / static_cast<double>(count - 1)));
  return moments;
}

Pose pose_at(std::span<const TracePoint> trace, double time_s) {
  return point_at(trace, time_s).pose_world;
}

}  // namespace sectio
