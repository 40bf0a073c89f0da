// Pictures of a session for browsers that can't draw: a thread of its own holds a replica, as a page does, and draws it
// in software when somebody asks. However many ask, one picture is drawn at a time, and all get it.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace sectio {

struct Still {
  std::uint64_t number = 0;  // from 1
  std::string jpeg;
};

// All calls from one thread; none waits for a picture.
class StillMaker {
 public:
  StillMaker(int width_px, int height_px);
  ~StillMaker();

  // A frame of the gateway, as a page gets it; and what such a page answers.
  void feed(std::vector<std::uint8_t> frame);
  bool has_room() const;  // else the newest states are worth waiting for
  std::vector<std::uint8_t> take_outgoing();

  // A picture of what is known now. Returns its number: any still with it, or with a greater one, is no older.
  std::uint64_t ask();
  // The newest; null before the first one.
  std::shared_ptr<const Still> newest() const;

 private:
  void run();

  int width_px_, height_px_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::vector<std::uint8_t>> incoming_;
  std::vector<std::uint8_t> outgoing_;
  std::uint64_t asked_ = 0, begun_ = 0;
  std::shared_ptr<const Still> newest_;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace sectio
