// A record that is read from any moment on.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim_server/net/played_world.h"

namespace sectio {

class PlayedRecord {
 public:
  // Reads the record once for its times; a damaged one is read as far as it is whole, with a warning. Throws InputError
  // "PATH: why" when it shows nothing.
  explicit PlayedRecord(const std::string& path);

  double end_s() const { return end_s_; }
  // Goes to the world at this simulated time, from the keyframes before it; the first that can be shown if none of that
  // time can.
  void seek(double sim_time_s);
  // Takes all messages up to this simulated time. False at the end.
  bool advance(double sim_time_s);
  double time_s() const { return time_s_; }  // the world's
  PlayedWorld& world() { return world_; }
  bool is_damaged() const { return is_damaged_; }

 private:
  struct Place {
    double sim_time_s;
    std::uint64_t at;
  };
  void begin_at(const Place& place);
  void take_next();

  std::string path_;
  McapReader reader_;
  std::vector<Place> places_;  // at which scenes stand, the first of them at the beginning
  std::optional<McapReader::Message> next_;
  PlayedWorld world_;
  double end_s_ = 0, time_s_ = 0;
  bool is_damaged_ = false;
};

}  // namespace sectio
