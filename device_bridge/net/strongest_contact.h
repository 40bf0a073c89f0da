// Several servers of a session may answer one hand: each hears the instrument, and sends the contact that it has with
// its own bodies. The hand feels the contact in which the instrument is deepest in touch, and of equals the one with
// the larger force.
#pragma once

#include <cstdint>
#include <map>

#include "common/messages/contact.h"

namespace sectio {

class StrongestContact {
 public:
  static constexpr double kSilence_s =
      0.5;  // a server that is silent for longer has gone; models come every millisecond

  // Takes over a model unless it is older than the last one of its server. True when the hand feels something new.
  bool feel(double now_s, const ContactMessage& contact);
  const ContactModel& model() const { return model_; }

  void end(std::uint64_t epoch) { servers_[epoch].ended = true; }
  // A server has ended its session, and no other server speaks any more.
  bool all_ended(double now_s) const;

 private:
  struct Server {
    ContactModel model;
    double heard_s = -1e300;
    bool ended = false;
  };
  std::map<std::uint64_t, Server> servers_;  // by epoch
  ContactModel model_;
};

}  // namespace sectio
