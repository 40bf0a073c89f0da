// How a client of the gateway behaves, and from when on it is a guest no longer. Bounds are far beyond what a page does
// whose person is quick, or whose link is slow. Without clock: time is passed in.
#pragma once

#include <cstddef>

namespace sectio {

class Conduct {
 public:
  static constexpr double kSilence_s = 10;        // a client has said something by then: a page does at once
  static constexpr std::size_t kMaxGarbage = 16;  // messages that are none
  // A page that has lost an instrument moves it until it hears of that.
  static constexpr double kMaxRefused = 200, kForgiven_per_s = 20;
  static constexpr double kWrongToken = 20;        // counts as so many refusals
  static constexpr std::size_t kMaxTooFast = 100;  // wishes in a row; a mouse that jumps makes one

  void message(bool fine) {
    has_spoken_ = true;
    garbage_ += fine ? 0 : 1;
  }
  void refusal(double now_s, double weight = 1);
  void wish(bool too_fast) { too_fast_ = too_fast ? too_fast_ + 1 : 0; }
  // Call again and again.
  void tick(double now_s);
  // This process didn't run: nobody could be heard.
  void slept(double now_s) { came_s_ = now_s; }

  // Why the connection has to end, as a sentence about the client that begins with its verb; null: it hasn't.
  const char* fault() const;

 private:
  bool has_spoken_ = false, is_silent_ = false;
  std::size_t garbage_ = 0, too_fast_ = 0;
  double refused_ = 0, refused_s_ = 0, came_s_ = -1;
};

}  // namespace sectio
