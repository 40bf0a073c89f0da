// The tries of an exercise as the gateway hears them: the score, and what each instrument did. A try that is scored
// is a file, so that later ones can be compared with it, also in later sessions. One thread.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/messages/contact.h"
#include "common/messages/session.h"
#include "common/messages/state.h"

namespace sectio {

class TryBook {
 public:
  static constexpr double kEvery_s = 0.1;             // simulated time between places of an instrument, at first
  static constexpr std::size_t kMostPlaces = 1200;    // when there are more, every second one goes
  static constexpr std::size_t kMostLines = 64;       // lines of a score
  static constexpr std::size_t kMostTriesShown = 40;  // the newest

  // Empty: nothing is kept. Throws InputError when there can be no such directory.
  void keep_in(const std::string& directory);

  // A task that is told begins a try. A session that goes back in time, or that another server takes over, has a new
  // epoch, and goes on with its try; one that begins anew says so by an event.
  void feed(const SceneInfo& message);
  void feed(const StateHeader& message);
  void feed(const ContactMessage& message);
  void feed(const SessionEvent& message);
  // People who hold instruments; writes what is new.
  void tick(const std::vector<std::string>& hands);

  // A list of the tries of this exercise, oldest first.
  std::string json() const;

 private:
  struct Place {
    Vec3 at_m = Vec3::Zero();
    double force_n = 0;
    bool present = false;
  };
  struct Moment {
    std::uint64_t epoch = 0;
    double time_s = 0;          // simulated
    std::vector<Place> places;  // one a tool
  };

  static bool presses(const Moment& moment);
  void begin();
  void forget_what_comes_later();
  void keep() const;
  std::string try_as_json() const;
  std::string task_as_json() const;

  std::string directory_;
  std::vector<std::string> tools_;
  std::uint64_t epoch_ = 0;
  std::uint64_t begun_us_ = 0;  // since 1970
  double every_s_ = kEvery_s, next_s_ = 0;
  std::vector<std::string> task_, score_;
  std::pair<std::uint64_t, std::uint64_t> scored_at_{0, 0};  // epoch and step
  bool begins_anew_ = false;                                 // a server has said so
  bool has_touched_ = false;                                 // an instrument, a body
  std::vector<Moment> moments_;
  std::map<std::uint32_t, double> forces_n_;  // by tool: the most since the last moment
  std::set<std::string> hands_;               // all who have held an instrument
  bool has_news_ = false;
};

}  // namespace sectio
