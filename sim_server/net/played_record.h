// A record that is read from any moment on.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim_server/net/played_world.h"

namespace sectio {

class PlayedRecord {
 public:
  // Reads the heads of the chunks for their times. Damage is passed over with a warning, up to the next moment at which
  // all bodies are told. Throws InputError "PATH: why" when it shows nothing.
  explicit PlayedRecord(const std::string& path);

  double end_s() const { return end_s_; }
  // Goes to the world at this simulated time, from the keyframes before it; the first that can be shown if none of that
  // time can.
  void seek(double sim_time_s);
  // Takes all messages up to this simulated time. False at the end.
  bool advance(double sim_time_s);
  double time_s() const { return time_s_; }  // time of the world
  PlayedWorld& world() { return world_; }
  bool is_damaged() const { return is_damaged_; }  // true: there was damage in the part that has been read

 private:
  struct Place {
    double sim_time_s;
    std::uint64_t at;
  };
  void begin_at(const Place& place);
  void begin(const Place& place);
  bool stands_at_damage() const;
  void take_next();
  void step_on();
  void pass_damage();
  void tell_damage(std::uint64_t at, const std::string& what);

  std::string path_;
  McapReader reader_;
  std::vector<Place> places_;  // at which scenes stand, the first of them at the beginning
  std::optional<McapReader::Message> next_;
  PlayedWorld world_;
  double end_s_ = 0, time_s_ = 0;
  bool is_damaged_ = false;
  std::uint64_t told_at_ = 0;  // the byte of the damage that was told last
};

}  // namespace sectio
