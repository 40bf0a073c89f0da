#include "common/dds/peers.h"

#include <algorithm>

#include "common/core/log.h"

namespace sectio {

using eprosima::fastrtps::rtps::DataHolderHelper;
using eprosima::fastrtps::rtps::GUID_t;
using eprosima::fastrtps::rtps::IdentityToken;
using eprosima::fastrtps::rtps::ParticipantAuthenticationInfo;
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
    if (peer.announcement && (!secured_ || authenticated_.contains(prefix))) result.push_back(peer);
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
      forget(prefix);
      if (std::ranges::none_of(peers_, [&](const auto& other) { return other.second.name == name; }))
        for (auto& [writer, readers] : readers_) readers.gone.erase(name);
      break;
    case ParticipantDiscoveryInfo::DROPPED_PARTICIPANT:
      forget(prefix);
      break;
    default:
      enter(prefix, {name, announcement_from(user_data_of(info))});
      if (info.status == ParticipantDiscoveryInfo::DISCOVERED_PARTICIPANT)
        compare_security(prefix, info.info.identity_token_);
  }
}

void Peers::forget(const Prefix& prefix) {
  peers_.erase(prefix);
  claims_.erase(prefix);
  authenticated_.erase(prefix);
  refused_.erase(prefix);
}

void Peers::onParticipantAuthentication(eprosima::fastdds::dds::DomainParticipant*,
                                        ParticipantAuthenticationInfo&& info) {
  const Prefix& prefix = info.guid.guidPrefix;
  const std::lock_guard lock(mutex_);
  if (info.status == ParticipantAuthenticationInfo::AUTHORIZED_PARTICIPANT) {
    authenticated_.insert(prefix);
    return;
  }
  authenticated_.erase(prefix);
  const auto peer = peers_.find(prefix);
  const auto claim = claims_.find(prefix);
  if (peer == peers_.end() || claim == claims_.end() || !refused_.insert(prefix).second) return;
  log_warning("refused: " + peer->second.name + " with the keys of " + claim->second +
              ": they are expired, revoked or not what they claim to be");
}

// A token only claims; it proves nothing.
void Peers::compare_security(const Prefix& prefix, const IdentityToken& token) {
  const bool has_keys = !token.class_id().empty();
  const auto text = [&](const char* property) {
    const std::string* value = DataHolderHelper::find_property_value(token, property);
    return value ? value->substr(value->find("CN=") == std::string::npos ? 0 : value->find("CN=") + 3) : "";
  };
  const Peer& peer = peers_[prefix];
  const bool same_authority = text("dds.ca.sn").starts_with(authority_);
  if (has_keys && same_authority) claims_[prefix] = text("dds.cert.sn");
  if (!concerns_us(peer) || (has_keys == secured_ && same_authority)) return;
  const std::string why = !has_keys            ? " has no keys, this program has"
                          : authority_.empty() ? " has keys, this program none (--keys)"
                                               : " has keys of another authority";
  log_limited(LogLevel::warning, "keys",
              "session '" + peer.announcement->session + "': " + peer.name + why + ": they exchange no messages");
}

std::vector<std::string> Peers::deaf_to_our_keys() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> names;
  if (!secured_ || !authenticated_.empty()) return names;
  for (const auto& [prefix, claim] : claims_)
    if (const auto peer = peers_.find(prefix); peer != peers_.end() && concerns_us(peer->second))
      names.push_back(peer->second.name);
  return names;
}

void Peers::enter(const Prefix& prefix, Peer peer) {
  const auto [place, is_new] = peers_.insert_or_assign(prefix, std::move(peer));
  if (is_new) warn_of_another_protocol(place->second);
}

bool Peers::concerns_us(const Peer& peer) const {
  const bool looks_for_any = own_.session.empty() && peer.name == kServerName;
  return peer.announcement && (peer.announcement->session == own_.session || looks_for_any);
}

void Peers::warn_of_another_protocol(const Peer& peer) const {
  if (!concerns_us(peer) || peer.announcement->protocol == own_.protocol) return;
  log_limited(LogLevel::warning, "protocol",
              "session '" + peer.announcement->session + "': " + peer.name + " speaks protocol " +
                  std::to_string(peer.announcement->protocol) + ", this program " + std::to_string(own_.protocol) +
                  ": they exchange no messages");
}

}  // namespace sectio
