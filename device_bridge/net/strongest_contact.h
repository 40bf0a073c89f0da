// Several servers of a session may answer one hand: each hears the instrument, and sends the contact that it has with
// its own bodies. The hand feels the contact in which the instrument is deepest in touch, and of equals the one with
// the larger force.
#pragma once

#include <cstdint>
#include <map>

#include "common/messages/contact.h"
#include "common/messages/session.h"

namespace sectio {

class StrongestContact {
 public:
  // A server that is silent for longer has gone: models come fifty times a second, or more often.
  static constexpr double kSilence_s = 0.5;

  // Takes over a model unless it is older than the last one of its server, or of a server whose session another one has
  // taken over (common/messages/epoch.h). True when the hand feels something new.
  bool feel(double now_s, const ContactMessage& contact);
  const ContactModel& model() const { return model_; }

  // The bodies of a server. Another server that claims one of them isn't felt while this one speaks.
  void announce(const SceneInfo& scene);

  void end(double now_s, std::uint64_t epoch);
  // True when a server has ended its session, and no other server speaks any more.
  bool all_ended(double now_s) const;

 private:
  struct Server {
    ContactModel model;
    double heard_s = -1e300;
    bool ended = false;
  };
  bool is_rival(double now_s, std::uint64_t epoch) const;
  bool is_ghost(std::uint64_t epoch) const;
  void bury_before(std::uint64_t epoch);

  std::map<std::uint64_t, Server> servers_;    // by epoch
  std::map<std::uint64_t, SceneInfo> scenes_;  // by epoch
  ContactModel model_;
};

}  // namespace sectio
