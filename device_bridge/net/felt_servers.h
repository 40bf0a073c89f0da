// One hand among several servers: each hears the instrument, and answers with the contact that it has with bodies of
// its own. The hand feels the one in which the instrument is deepest in touch, and of equals the one with the larger
// force.
#pragma once

#include <cstdint>
#include <map>

#include "common/dds/convert.h"

namespace sectio {

class FeltServers {
 public:
  static constexpr double kSilence_s = 0.5;  // after this long a server is not there; models come every millisecond

  // Takes over a model unless it is older than the last one of its server. True when what the hand feels is new.
  bool feel(double now_s, const ContactMessage& contact);
  const ContactModel& model() const { return model_; }

  void end(std::uint64_t epoch) { servers_[epoch].ended = true; }
  // One has said so, and no other speaks any more.
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
