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

  // `own`: what this participant announces. A program of its session that speaks another version gets a line in the
  // log.
  explicit Peers(const Announcement& own) : own_(own) {}

  // Programs of this project that read from the writer until they were dropped, and that don't read again, also not as
  // a new participant of the same name.
  std::uint32_t lost_readers(const DataWriter* writer) const;

  bool is_there(const ProgramId& program) const;

  // Programs of this project that are there now.
  std::vector<Peer> known() const;

  void on_publication_matched(DataWriter* writer,
                              const eprosima::fastdds::dds::PublicationMatchedStatus& status) override;
  void on_participant_discovery(eprosima::fastdds::dds::DomainParticipant*,
                                eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& info) override;

 private:
  using Prefix = eprosima::fastrtps::rtps::GuidPrefix_t;
  struct Readers {
    std::set<Prefix> there;
    std::set<std::string> gone;  // by name
  };

  void enter(const Prefix& prefix, Peer peer);
  void warn_of_another_protocol(const Peer& peer) const;

  const Announcement own_;
  mutable std::mutex mutex_;
  std::map<Prefix, Peer> peers_;
  std::map<const DataWriter*, Readers> readers_;
};

}  // namespace sectio
