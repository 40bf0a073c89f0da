#include "common/dds/participant.h"

#include <arpa/inet.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>
#include <ifaddrs.h>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <mutex>

#include "common/core/error.h"
#include "common/dds/parts.h"
#include "common/dds/qos.h"

namespace sectio {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

namespace {

constexpr std::size_t kMaxSessionBytes = 64;
// The programs of a host whose discovery ports are tried: on this host, and on each peer. Two programs meet when one of
// them finds the other, and each try is a packet on the link.
constexpr std::uint32_t kProgramsOnHost = 64;
constexpr std::uint32_t kProgramsTriedOffHost = 16;

void check_address(const std::string& flag, const std::string& address) {
  in_addr parsed{};
  if (inet_pton(AF_INET, address.c_str(), &parsed) != 1)
    throw InputError(flag + ": expected an IPv4 address, got " + address);
}

// The IPv4 addresses of this machine's interfaces.
std::vector<std::string> own_addresses() {
  std::vector<std::string> addresses;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return addresses;
  for (const ifaddrs* each = list; each != nullptr; each = each->ifa_next) {
    if (each->ifa_addr == nullptr || each->ifa_addr->sa_family != AF_INET) continue;
    char text[INET_ADDRSTRLEN] = {};
    inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(each->ifa_addr)->sin_addr, text, sizeof text);
    addresses.emplace_back(text);
  }
  freeifaddrs(list);
  return addresses;
}

void check_interface(const std::string& address) {
  check_address("--interface", address);
  const std::vector<std::string> addresses = own_addresses();
  if (addresses.empty() || std::ranges::find(addresses, address) != addresses.end()) return;
  std::string list;
  for (const std::string& each : addresses) list += (list.empty() ? "" : ", ") + each;
  throw InputError("--interface: no interface of this machine has the address " + address + "; there are " + list);
}

// Otherwise samples between participants of one process bypass the network, which is what tests are about.
void prepare_process() {
  static std::once_flag once;
  std::call_once(once, [] {
    eprosima::fastrtps::LibrarySettingsAttributes settings;
    settings.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
    eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);
    dds::Log::SetVerbosity(dds::Log::Kind::Error);
  });
}

// Fast DDS counts the participants of a process up and derives the discovery port from the count, which would leave the
// range that peers try once a process (a test) has made many.
std::int32_t next_participant_id(std::uint32_t range) {
  static std::atomic<std::uint32_t> count{0};
  return static_cast<std::int32_t>(count++ % range);
}

dds::DomainParticipantQos participant_qos(const NetworkOptions& options, const std::string& name) {
  dds::DomainParticipantQos qos;
  qos.name(name.c_str());
  const std::string announcement = to_user_data({options.protocol, options.session});
  qos.user_data().data_vec({announcement.begin(), announcement.end()});
  const std::uint32_t tried = options.off_host() ? kProgramsTriedOffHost : kProgramsOnHost;
  qos.wire_protocol().participant_id = next_participant_id(tried);

  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->receiveBufferSize = kSocketBufferBytes;
  udp->sendBufferSize = kSocketBufferBytes;
  udp->maxInitialPeersRange = tried;
  udp->interfaceWhiteList = options.interfaces;
  if (!options.off_host()) udp->interfaceWhiteList = {"127.0.0.1"};
  if (options.off_host()) udp->maxMessageSize = kMaxDatagramOffHostBytes;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  qos.transport().listen_socket_buffer_size = kSocketBufferBytes;
  qos.transport().send_socket_buffer_size = kSocketBufferBytes;

  auto& builtin = qos.wire_protocol().builtin;
  const Lease& lease = options.off_host() ? kLeaseOffHost : kLeaseOnHost;
  builtin.discovery_config.leaseDuration = duration(lease.duration_s);
  builtin.discovery_config.leaseDuration_announcementperiod = duration(lease.announcement_s);
  builtin.discovery_config.initial_announcements.count = 10;
  builtin.discovery_config.initial_announcements.period = duration(0.05);
  std::vector<std::string> peers = options.peers;
  if (peers.empty() && !options.off_host()) peers = {"127.0.0.1"};
  for (const std::string& address : peers) {
    rtps::Locator_t locator;
    rtps::IPLocator::setIPv4(locator, address);
    builtin.initialPeersList.push_back(locator);
  }
  // An empty unicast locator in the list: listen on the well-known ports, but join no multicast group.
  if (!peers.empty()) builtin.metatrafficUnicastLocatorList.push_back(rtps::Locator_t());
  return qos;
}

}  // namespace

void check_network_options(const NetworkOptions& options) {
  if (options.domain > kMaxDomain)
    throw InputError("--domain: expected 0 to " + std::to_string(kMaxDomain) + ", got " +
                     std::to_string(options.domain));
  // A partition with * ? [ or / would match other sessions.
  const bool plain = std::ranges::all_of(
      options.session, [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.'; });
  if (options.session.size() > kMaxSessionBytes || !plain)
    throw InputError("--session: expected 1 to 64 letters, digits, - _ or ., got '" + options.session + "'");
  for (const std::string& peer : options.peers) check_address("--peer", peer);
  for (const std::string& interface : options.interfaces) check_interface(interface);
}

std::string partition_of(const NetworkOptions& options) {
  return options.session + "/" + std::to_string(options.protocol);
}

Participant::Participant(const NetworkOptions& options, const std::string& name)
    : parts_(std::make_unique<Parts>(Announcement{options.protocol, options.session})),
      sleep_watch_((options.off_host() ? kLeaseOffHost : kLeaseOnHost).duration_s -
                   2 * (options.off_host() ? kLeaseOffHost : kLeaseOnHost).announcement_s) {
  check_network_options(options);
  prepare_process();
  auto* factory = dds::DomainParticipantFactory::get_instance();
  parts_->off_host = options.off_host();
  parts_->participant = factory->create_participant(options.domain, participant_qos(options, name), &parts_->peers,
                                                    dds::StatusMask::publication_matched());
  if (parts_->participant == nullptr)
    throw InputError("--domain " + std::to_string(options.domain) + ": no DDS participant can be opened on it");
  parts_->partition = partition_of(options);
  dds::SubscriberQos qos;
  qos.partition().push_back(parts_->partition.c_str());
  for (const char* channel : {kStateChannels.front(), kKeyframeChannels.front(), kDeltaChannels.front()})
    qos.partition().push_back((parts_->partition + "/" + channel).c_str());
  parts_->subscriber = parts_->participant->create_subscriber(qos);
  if (parts_->subscriber == nullptr) throw InputError("--session " + options.session + ": DDS refuses it");
}

Participant::~Participant() {
  parts_->participant->set_listener(nullptr);
  parts_->participant->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(parts_->participant);
}

bool Participant::off_host() const {
  return parts_->off_host;
}

bool Participant::is_there(const ProgramId& program) const {
  return parts_->peers.is_there(program);
}

std::vector<Peer> Participant::peers() const {
  return parts_->peers.known();
}

}  // namespace sectio
