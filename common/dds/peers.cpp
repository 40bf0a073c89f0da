#include "common/dds/peers.h"

#include <algorithm>

#include "common/core/log.h"

namespace sectio {

using eprosima::fastrtps::rtps::GUID_t;
using eprosima::fastrtps::rtps::ParticipantDiscoveryInfo;

namespace {

constexpr std::size_t kMaxGone = 64;  // names of silent programs: their number is bounded, whatever joins and leaves

std::string user_data_of(const ParticipantDiscoveryInfo& info) {
  const auto& bytes = info.info.m_userData.data_vec();
  return {bytes.begin(), bytes.end()};
}

}  // namespace

std::uint32_t Peers::lost_readers(const DataWriter* writer) const {
  const std::lock_guard lock(mutex_);
  const auto found = readers_.find(writer);
  if (found == readers_.end()) return 0;
  const Readers& readers = found->second;
  const auto is_away = [&](const std::string& name) {
    return std::ranges::none_of(readers.there, [&](const Prefix& reader) {
      const auto peer = peers_.find(reader);
      return peer != peers_.end() && peer->second.name == name;
    });
  };
  return static_cast<std::uint32_t>(std::ranges::count_if(readers.gone, is_away));
}

bool Peers::is_there(const ProgramId& program) const {
  Prefix prefix;
  std::ranges::copy(program, prefix.value);
  const std::lock_guard lock(mutex_);
  return peers_.contains(prefix);
}

std::vector<Peer> Peers::known() const {
  const std::lock_guard lock(mutex_);
  std::vector<Peer> result;
  for (const auto& [prefix, peer] : peers_)
    if (peer.announcement) result.push_back(peer);
  return result;
}

void Peers::on_publication_matched(DataWriter* writer, const eprosima::fastdds::dds::PublicationMatchedStatus& status) {
  const Prefix reader = GUID_t(status.last_subscription_handle).guidPrefix;
  const std::lock_guard lock(mutex_);
  auto& [there, gone] = readers_[writer];
  if (status.current_count_change > 0) {
    there.insert(reader);
    return;
  }
  const bool was_there = there.erase(reader) > 0;
  const auto peer = peers_.find(reader);
  if (was_there && peer != peers_.end() && peer->second.announcement && gone.size() < kMaxGone)
    gone.insert(peer->second.name);
}

// Fast DDS calls this after it has matched or unmatched the endpoints of the peer.
void Peers::on_participant_discovery(eprosima::fastdds::dds::DomainParticipant*, ParticipantDiscoveryInfo&& info) {
  const Prefix prefix = info.info.m_guid.guidPrefix;
  const std::string name = info.info.m_participantName.c_str();
  const std::lock_guard lock(mutex_);
  switch (info.status) {
    case ParticipantDiscoveryInfo::REMOVED_PARTICIPANT:
      peers_.erase(prefix);
      if (std::ranges::none_of(peers_, [&](const auto& other) { return other.second.name == name; }))
        for (auto& [writer, readers] : readers_) readers.gone.erase(name);
      break;
    case ParticipantDiscoveryInfo::DROPPED_PARTICIPANT:
      peers_.erase(prefix);
      break;
    default:
      enter(prefix, {name, announcement_from(user_data_of(info))});
  }
}

void Peers::enter(const Prefix& prefix, Peer peer) {
  const auto [place, is_new] = peers_.insert_or_assign(prefix, std::move(peer));
  if (is_new) warn_of_another_protocol(place->second);
}

void Peers::warn_of_another_protocol(const Peer& peer) const {
  if (!peer.announcement || peer.announcement->protocol == own_.protocol) return;
  const bool looks_for_any = own_.session.empty() && peer.name == kServerName;
  if (peer.announcement->session != own_.session && !looks_for_any) return;
  log_limited(LogLevel::warning, "protocol",
              "session '" + peer.announcement->session + "': " + peer.name + " speaks protocol " +
                  std::to_string(peer.announcement->protocol) + ", this program " + std::to_string(own_.protocol) +
                  ": they exchange no messages");
}

}  // namespace sectio
