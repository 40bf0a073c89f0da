#include "device_bridge/servo/record_writer.h"

#include <array>
#include <charconv>
#include <stdexcept>

#include "common/core/error.h"
#include "common/core/log.h"

namespace sectio {
namespace {

constexpr const char* kHeader =
    "time_s,x_world_m,y_world_m,z_world_m,qw,qx,qy,qz,opening_rad,force_x_world_n,force_y_world_n,force_z_world_n,"
    "model_age_s,state,server_silent,overruns\n";

const char* to_string(ContactState state) {
  switch (state) {
    case ContactState::contact:
      return "contact";
    case ContactState::penetration:
      return "penetration";
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

RecordWriter::RecordWriter(const std::string& path) : path_(path) {
  if (path_.empty()) return;
  out_.open(path_);
  if (!out_) throw InputError("--log: " + path_ + ": can't be written");
  out_ << kHeader;
}

void RecordWriter::drain(Ring<ServoRecord>& records) {
  for (ServoRecord record; records.pop(record);) {
    write(record);
    if (record.server_silent == server_silent_) continue;
    server_silent_ = record.server_silent;
    if (server_silent_) {
      log_warning("the server is silent: the force fades to zero");
    } else {
      log_info("the server is back");
    }
  }
}

void RecordWriter::write(const ServoRecord& record) {
  ++written_;
  if (path_.empty()) return;
  line_.clear();
  append(line_, record.sample.tool_time_s);
  line_ += ',';
  append(line_, record.sample.pose_world.position_m);
  const Eigen::Quaterniond& q = record.sample.pose_world.orientation;
  for (const double part : {q.w(), q.x(), q.y(), q.z(), record.sample.opening_rad}) {
    append(line_, part);
    line_ += ',';
  }
  append(line_, record.force_world_n);
  append(line_, record.model_age_s);
  line_ += ',';
  line_ += to_string(record.state);
  line_ += record.server_silent ? ",1," : ",0,";
  append(line_, record.overruns);
  line_ += '\n';
  out_ << line_;
}

void RecordWriter::finish() {
  if (path_.empty()) return;
  out_.flush();
  if (!out_) throw std::runtime_error("--log: " + path_ + ": not all of it could be written");
}

}  // namespace sectio
