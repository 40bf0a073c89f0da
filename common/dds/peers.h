// The other programs that a participant knows of: what they announce, and which of them fell silent without a word. A
// program that leaves is removed from the session; a program whose lease has run out is dropped.
#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "common/dds/participant.h"

namespace sectio {

// Listens to a participant. Called by threads of Fast DDS; the rest is for any thread.
class Peers : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  using DataWriter = eprosima::fastdds::dds::DataWriter;

  // `own`: what this participant announces. Logs a line for each program of its session that speaks another version,
  // and for each whose keys are missing, bad, or not expected because this one has none.
  // `authority`: the authority of this participant's keys; empty: it has no keys.
  Peers(const Announcement& own, const std::string& authority)
      : own_(own), secured_(!authority.empty()), authority_(authority) {}

  // Programs of this project that read from the writer until they were dropped, and that don't read again, also not as
  // a new participant of the same name.
  std::uint32_t lost_readers(const DataWriter* writer) const;

  bool is_there(const ProgramId& program) const;

  // Programs of this project that are there now, and have shown good keys where this one has keys.
  std::vector<Peer> known() const;

  // Programs with keys that concern this one, of which none has accepted its keys.
  std::vector<std::string> deaf_to_our_keys() const;

  void on_publication_matched(DataWriter* writer,
                              const eprosima::fastdds::dds::PublicationMatchedStatus& status) override;
  void on_participant_discovery(eprosima::fastdds::dds::DomainParticipant*,
                                eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& info) override;
  void onParticipantAuthentication(eprosima::fastdds::dds::DomainParticipant*,
                                   eprosima::fastrtps::rtps::ParticipantAuthenticationInfo&& info) override;

 private:
  using Prefix = eprosima::fastrtps::rtps::GuidPrefix_t;
  struct Readers {
    std::set<Prefix> there;
    std::set<std::string> gone;  // by name
  };

  void enter(const Prefix& prefix, Peer peer);
  void forget(const Prefix& prefix);
  void compare_security(const Prefix& prefix, const eprosima::fastrtps::rtps::IdentityToken& token);
  bool concerns_us(const Peer& peer) const;
  void warn_of_another_protocol(const Peer& peer) const;

  const Announcement own_;
  const bool secured_;
  const std::string authority_;
  mutable std::mutex mutex_;
  std::map<Prefix, Peer> peers_;
  // The names that programs with keys claim, the programs whose keys were verified, and those that were refused.
  std::map<Prefix, std::string> claims_;
  std::set<Prefix> authenticated_, refused_;
  std::map<const DataWriter*, Readers> readers_;
};

}  // namespace sectio
