#include "common/dds/participant.h"

#include <arpa/inet.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>
#include <ifaddrs.h>
#include <netdb.h>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>

#include <algorithm>
#include <cctype>
#include <mutex>
#include <regex>

#include "common/core/error.h"
#include "common/core/joined.h"
#include "common/core/log.h"
#include "common/dds/expediting_transport.h"
#include "common/dds/parts.h"
#include "common/dds/program_number.h"
#include "common/dds/qos.h"

namespace sectio {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

namespace {

constexpr std::size_t kMaxSessionBytes = 64;

// The IPv4 address of a host that is given by its address or its name.
std::string address_of_host(const std::string& host) {
  in_addr parsed{};
  if (inet_pton(AF_INET, host.c_str(), &parsed) == 1) return host;
  addrinfo hints{}, *found = nullptr;
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  const bool is_name = host.find_first_not_of("0123456789.") != std::string::npos;
  if (!is_name || getaddrinfo(host.c_str(), nullptr, &hints, &found) != 0 || found == nullptr)
    throw InputError("--peer: expected an IPv4 address, or the name of a host that has one, got " + host);
  char text[INET_ADDRSTRLEN] = {};
  inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(found->ai_addr)->sin_addr, text, sizeof text);
  freeaddrinfo(found);
  return text;
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
  in_addr parsed{};
  if (inet_pton(AF_INET, address.c_str(), &parsed) != 1)
    throw InputError("--interface: expected an IPv4 address, got " + address);
  const std::vector<std::string> addresses = own_addresses();
  if (addresses.empty() || std::ranges::find(addresses, address) != addresses.end()) return;
  throw InputError("--interface: no interface of this machine has the address " + address + "; there are " +
                   joined(addresses));
}

// Otherwise samples between participants of one process bypass the network, which is what tests are about.
void prepare_process() {
  static std::once_flag once;
  std::call_once(once, [] {
    eprosima::fastrtps::LibrarySettingsAttributes settings;
    settings.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
    eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);
    dds::Log::SetVerbosity(dds::Log::Kind::Error);
    // Keys, Peers and SampleWriter say in one line what Fast DDS says in several.
    dds::Log::SetCategoryFilter(std::regex("^(?!SECURITY|DATA_WRITER|DATA_READER).*"));
  });
}

void say_that_it_is_open(const NetworkOptions& options) {
  const std::string where = joined(options.interfaces);
  log_limited(LogLevel::warning, "open",
              "OPEN SESSION (--insecure): whoever reaches " + (where.empty() ? "this machine" : where) + " on domain " +
                  std::to_string(options.domain) + " sees all of it, moves instruments and gives orders");
}

dds::DomainParticipantQos participant_qos(const NetworkOptions& options, const std::string& name,
                                          const ProgramNumber& number, const std::optional<Keys>& keys) {
  dds::DomainParticipantQos qos;
  qos.name(name.c_str());
  if (keys)
    for (const auto& [property, value] : keys->properties())
      qos.properties().properties().emplace_back(property, value);
  const std::string announcement = to_user_data({options.protocol, options.session});
  qos.user_data().data_vec({announcement.begin(), announcement.end()});
  const std::uint32_t tried = options.off_host() ? kProgramsTriedOffHost : kProgramsOnHost;
  qos.wire_protocol().participant_id = number.value();

  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->receiveBufferSize = kSocketBufferBytes;
  udp->sendBufferSize = kSocketBufferBytes;
  udp->maxInitialPeersRange = tried;
  udp->interfaceWhiteList = options.interfaces;
  if (!options.off_host()) udp->interfaceWhiteList = {"127.0.0.1"};
  if (options.off_host()) udp->maxMessageSize = keys ? kMaxDatagramWithKeysBytes : kMaxDatagramOffHostBytes;
  qos.transport().use_builtin_transports = false;
  if (options.off_host())
    qos.transport().user_transports.push_back(expediting(udp));
  else
    qos.transport().user_transports.push_back(udp);
  qos.transport().listen_socket_buffer_size = kSocketBufferBytes;
  qos.transport().send_socket_buffer_size = kSocketBufferBytes;

  auto& builtin = qos.wire_protocol().builtin;
  const Lease& lease = options.off_host() ? kLeaseOffHost : kLeaseOnHost;
  builtin.discovery_config.leaseDuration = duration(lease.duration_s);
  builtin.discovery_config.leaseDuration_announcementperiod = duration(lease.announcement_s);
  // Off host they count on a thin link.
  builtin.discovery_config.initial_announcements.count = options.off_host() ? 4 : 10;
  builtin.discovery_config.initial_announcements.period = duration(options.off_host() ? 0.2 : 0.05);
  std::vector<std::string> peers = options.peers;
  if (peers.empty() && !options.off_host()) peers = {"127.0.0.1"};
  for (const std::string& address : peers) {
    rtps::Locator_t locator;
    rtps::IPLocator::setIPv4(locator, address_of_host(address));
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
  for (const std::string& peer : options.peers) address_of_host(peer);
  for (const std::string& interface : options.interfaces) check_interface(interface);
  if (!Keys::of(options) && options.off_host() && !options.insecure)
    throw InputError(
        std::string(options.interfaces.empty() ? "--peer" : "--interface") +
        ": what leaves this machine needs keys: --keys DIR (deploy/keys, or sectio_keys, makes them), or --insecure");
}

std::string partition_of(const NetworkOptions& options) {
  return options.session + "/" + std::to_string(options.protocol);
}

Participant::Participant(const NetworkOptions& options, const std::string& name)
    : parts_(std::make_unique<Parts>(Announcement{options.protocol, options.session}, Keys::of(options))),
      sleep_watch_((options.off_host() ? kLeaseOffHost : kLeaseOnHost).duration_s -
                   2 * (options.off_host() ? kLeaseOffHost : kLeaseOnHost).announcement_s) {
  check_network_options(options);
  prepare_process();
  auto* factory = dds::DomainParticipantFactory::get_instance();
  parts_->off_host = options.off_host();
  if (options.off_host() && !parts_->keys) say_that_it_is_open(options);
  parts_->number.emplace(options);
  parts_->participant =
      factory->create_participant(options.domain, participant_qos(options, name, *parts_->number, parts_->keys),
                                  &parts_->peers, dds::StatusMask::publication_matched());
  if (parts_->participant == nullptr && parts_->keys)
    throw InputError("--keys " + parts_->keys->directory() +
                     ": DDS refuses them: their permissions are expired, damaged" + " or signed by somebody else");
  if (parts_->participant == nullptr)
    throw InputError("--domain " + std::to_string(options.domain) + ": no DDS participant can be opened on it");
  parts_->partition = partition_of(options);
  dds::SubscriberQos qos;
  qos.partition().push_back(parts_->partition.c_str());
  for (const char* channel : {kStateChannels.front(), kKeyframeChannels.front(), kDeltaChannels.front()})
    qos.partition().push_back(parts_->partition_of(channel).c_str());
  parts_->subscriber = parts_->participant->create_subscriber(qos);
  if (parts_->subscriber == nullptr) throw InputError("--session " + options.session + ": DDS refuses it");
}

Participant::~Participant() {
  parts_->participant->set_listener(nullptr);
  if (const std::vector<std::string> deaf = parts_->peers.deaf_to_our_keys(); !deaf.empty())
    log_warning(deaf.front() + " never accepted the keys of " + parts_->keys->identity() +
                ": it may know that they were revoked");
  parts_->participant->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(parts_->participant);
}

bool Participant::off_host() const {
  return parts_->off_host;
}

bool Participant::secured() const {
  return parts_->keys.has_value();
}

ProgramId Participant::id() const {
  ProgramId id;
  std::ranges::copy(parts_->participant->guid().guidPrefix.value, id.begin());
  return id;
}

bool Participant::is_there(const ProgramId& program) const {
  return parts_->peers.is_there(program);
}

std::vector<Peer> Participant::peers() const {
  return parts_->peers.known();
}

void Participant::hear(const std::vector<std::string>& channels) {
  dds::SubscriberQos qos;
  parts_->subscriber->get_qos(qos);
  qos.partition().clear();
  qos.partition().push_back(parts_->partition.c_str());
  for (const std::string& channel : channels) qos.partition().push_back(parts_->partition_of(channel).c_str());
  parts_->subscriber->set_qos(qos);
}

}  // namespace sectio
