#include "device_bridge/servo/record_writer.h"

#include <array>
#include <charconv>

#include "common/core/formatted.h"
#include "common/core/log.h"
#include "common/math/trace.h"

namespace sectio {
namespace {

constexpr const char* kLogColumns =
    ",force_x_world_n,force_y_world_n,force_z_world_n,model_age_s,state,server_silent,overruns,woke_after_s\n";

const char* to_string(ContactState state) {
  switch (state) {
    case ContactState::contact:
      return "contact";
    case ContactState::penetration:
      return "penetration";
    case ContactState::held:
      return "held";
    default:
      return "free";
  }
}

// The shortest text that reads back as the same number.
template <class Number>
void append(std::string& line, Number value) {
  std::array<char, 32> text;
  line.append(text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr);
}

void append(std::string& line, const Vec3& v) {
  for (int axis = 0; axis < 3; ++axis) {
    append(line, v[axis]);
    line += ',';
  }
}

}  // namespace

RecordWriter::RecordWriter(const std::string& log_path, const std::string& trace_path)
    : log_("--log", log_path, trace_columns() + kLogColumns), trace_("--record", trace_path, trace_columns() + '\n') {}

void RecordWriter::drain(Ring<ServoRecord>& records) {
  for (ServoRecord record; records.pop(record);) {
    write(record);
    was_answered_ |= record.model_age_s >= 0;
    const bool is_too_old = record.too_old_s > 0;
    if (is_too_old && !is_too_old_)
      log_warning(formatted("the server's answers are %.2g s old: too old to be felt", record.too_old_s));
    is_too_old_ = is_too_old;
    if (record.server_silent == server_silent_) continue;
    server_silent_ = record.server_silent;
    if (server_silent_) {
      log_warning("the server is silent: the force fades to zero");
    } else {
      log_info("the server is back");
    }
  }
  log_.flush();
  trace_.flush();
}

void RecordWriter::write(const ServoRecord& record) {
  ++written_;
  line_.clear();
  append_trace_point(line_, {record.sample.tool_time_s, record.sample.pose_world, record.sample.opening_rad});
  const std::size_t point = line_.size();
  line_ += '\n';
  trace_.append(line_);
  line_.resize(point);
  line_ += ',';
  append(line_, record.force_world_n);
  append(line_, record.model_age_s);
  line_ += ',';
  line_ += to_string(record.state);
  line_ += record.server_silent ? ",1," : ",0,";
  append(line_, record.overruns);
  line_ += ',';
  append(line_, record.woke_after_s);
  line_ += '\n';
  log_.append(line_);
}

void RecordWriter::finish() {
  log_.finish();
  trace_.finish();
}

}  // namespace sectio
