#include "common/dds/lost_readers.h"

#include <algorithm>

namespace sectio {

using eprosima::fastrtps::rtps::GUID_t;
using eprosima::fastrtps::rtps::ParticipantDiscoveryInfo;

namespace {

constexpr std::size_t kMaxGone = 64;  // whoever plays at falling silent fills no memory

}  // namespace

std::uint32_t LostReaders::of(const DataWriter* writer) const {
  const std::lock_guard lock(mutex_);
  const auto found = readers_.find(writer);
  if (found == readers_.end()) return 0;
  const Readers& readers = found->second;
  const auto is_away = [&](const std::string& name) {
    return std::ranges::none_of(readers.there, [&](const Prefix& reader) {
      const auto known = names_.find(reader);
      return known != names_.end() && known->second == name;
    });
  };
  return static_cast<std::uint32_t>(std::ranges::count_if(readers.gone, is_away));
}

void LostReaders::on_publication_matched(DataWriter* writer,
                                         const eprosima::fastdds::dds::PublicationMatchedStatus& status) {
  const Prefix reader = GUID_t(status.last_subscription_handle).guidPrefix;
  const std::lock_guard lock(mutex_);
  auto& [there, gone] = readers_[writer];
  if (status.current_count_change > 0)
    there.insert(reader);
  else if (there.erase(reader) > 0 && names_.contains(reader) && gone.size() < kMaxGone)
    gone.insert(names_.at(reader));
}

// After what it says has been done to the endpoints.
void LostReaders::on_participant_discovery(eprosima::fastdds::dds::DomainParticipant*,
                                           ParticipantDiscoveryInfo&& peer) {
  const Prefix prefix = peer.info.m_guid.guidPrefix;
  const std::string name = peer.info.m_participantName.c_str();
  const std::lock_guard lock(mutex_);
  switch (peer.status) {
    case ParticipantDiscoveryInfo::REMOVED_PARTICIPANT:
      names_.erase(prefix);
      if (std::ranges::none_of(names_, [&](const auto& other) { return other.second == name; }))
        for (auto& [writer, readers] : readers_) readers.gone.erase(name);
      break;
    case ParticipantDiscoveryInfo::DROPPED_PARTICIPANT:
      names_.erase(prefix);
      break;
    default:
      names_[prefix] = name;
  }
}

}  // namespace sectio
