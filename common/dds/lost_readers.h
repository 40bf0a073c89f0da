// Who fell silent without a word: a program that leaves is removed from the session, one whose lease has run out is
// dropped.
#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <map>
#include <mutex>
#include <set>
#include <string>

namespace sectio {

// Listens to a participant. Called by threads of Fast DDS.
class LostReaders : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  using DataWriter = eprosima::fastdds::dds::DataWriter;

  // Programs that read from the writer until they were dropped and don't again, also not as a new participant of their
  // name.
  std::uint32_t of(const DataWriter* writer) const;

  void on_publication_matched(DataWriter* writer,
                              const eprosima::fastdds::dds::PublicationMatchedStatus& status) override;
  void on_participant_discovery(eprosima::fastdds::dds::DomainParticipant*,
                                eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& peer) override;

 private:
  using Prefix = eprosima::fastrtps::rtps::GuidPrefix_t;
  struct Readers {
    std::set<Prefix> there;
    std::set<std::string> gone;  // by name
  };

  mutable std::mutex mutex_;
  std::map<Prefix, std::string> names_;
  std::map<const DataWriter*, Readers> readers_;
};

}  // namespace sectio
