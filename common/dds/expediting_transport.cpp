#include "common/dds/expediting_transport.h"

#include <dirent.h>
#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>
#include <netinet/in.h>
#include <netinet/ip.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <utility>
#include <vector>

namespace sectio {
namespace {

namespace transports = eprosima::fastdds::rtps;
using eprosima::fastrtps::rtps::Locator_t;
using eprosima::fastrtps::rtps::LocatorsIterator;
using eprosima::fastrtps::rtps::octet;
using eprosima::fastrtps::rtps::SenderResource;

constexpr int kUsual = 0;
constexpr int kExpedited = 46 << 2;

thread_local bool expedites = false;

bool is_udp(int fd) {
  int type = 0;
  socklen_t size = sizeof type;
  sockaddr_storage address{};
  socklen_t address_size = sizeof address;
  return getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) == 0 && type == SOCK_DGRAM &&
         getsockname(fd, reinterpret_cast<sockaddr*>(&address), &address_size) == 0 && address.ss_family == AF_INET;
}

// The descriptors of all UDP sockets of the process, ascending.
std::vector<int> udp_sockets() {
  std::vector<int> sockets;
  DIR* directory = opendir("/proc/self/fd");
  if (directory == nullptr) return sockets;
  while (const dirent* entry = readdir(directory))
    if (const int fd = std::atoi(entry->d_name); fd > 0 && is_udp(fd)) sockets.push_back(fd);
  closedir(directory);
  std::sort(sockets.begin(), sockets.end());
  return sockets;
}

// Fast DDS hides its sockets: those that are new after it has opened a channel belong to that channel. A participant
// sends one packet at a time, so that no other packet gets the mark.
class ExpeditingTransport : public transports::ChainingTransport {
 public:
  struct Descriptor : transports::ChainingTransportDescriptor {
    using ChainingTransportDescriptor::ChainingTransportDescriptor;
    transports::TransportInterface* create_transport() const override { return new ExpeditingTransport(*this); }
  };

  explicit ExpeditingTransport(const Descriptor& descriptor) : ChainingTransport(descriptor), descriptor_(descriptor) {}

  transports::TransportDescriptorInterface* get_configuration() override { return &descriptor_; }

  bool OpenOutputChannel(transports::SendResourceList& list, const Locator_t& locator) override {
    const std::vector<int> before = udp_sockets();
    const bool opened = ChainingTransport::OpenOutputChannel(list, locator);
    const std::vector<int> after = udp_sockets();
    std::set_difference(after.begin(), after.end(), before.begin(), before.end(), std::back_inserter(sockets_));
    return opened;
  }

  bool send(SenderResource* low, const octet* data, std::uint32_t size, LocatorsIterator* begin, LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& timeout) override {
    if (expedites) mark(kExpedited);
    const bool sent = low->send(data, size, begin, end, timeout);
    if (expedites) mark(kUsual);
    return sent;
  }

  void receive(transports::TransportReceiverInterface* next, const octet* data, std::uint32_t size,
               const Locator_t& local, const Locator_t& remote) override {
    next->OnDataReceived(data, size, local, remote);
  }

 private:
  void mark(int service) const {
    for (const int socket : sockets_) setsockopt(socket, IPPROTO_IP, IP_TOS, &service, sizeof service);
  }

  Descriptor descriptor_;
  std::vector<int> sockets_;
};

}  // namespace

std::shared_ptr<transports::TransportDescriptorInterface> expediting(
    std::shared_ptr<transports::UDPv4TransportDescriptor> udp) {
  return std::make_shared<ExpeditingTransport::Descriptor>(std::move(udp));
}

Expedite::Expedite(bool expedite) {
  expedites = expedite;
}

Expedite::~Expedite() {
  expedites = false;
}

}  // namespace sectio
