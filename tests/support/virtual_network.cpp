#include "tests/support/virtual_network.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <poll.h>
#include <sched.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

namespace sectio::test {

namespace {

constexpr std::size_t kMostFrameBytes = 2048;
constexpr int kDevicePackets = 4096;  // a host may send so many while this process doesn't run

double steady_now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void check(int result, const std::string& what) {
  if (result < 0) throw std::runtime_error(what + ": " + std::strerror(errno));
}

class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  int get() const { return fd_; }

 private:
  int fd_ = -1;
};

std::string address_of(std::size_t host) {
  return "10.77.0." + std::to_string(host + 1);
}

ifreq request(const char* device) {
  ifreq r{};
  std::strncpy(r.ifr_name, device, IFNAMSIZ - 1);
  return r;
}

void set_address(int socket, unsigned long what, const std::string& address) {
  ifreq r = request("eth0");
  auto* in = reinterpret_cast<sockaddr_in*>(&r.ifr_addr);
  in->sin_family = AF_INET;
  inet_pton(AF_INET, address.c_str(), &in->sin_addr);
  check(ioctl(socket, what, &r), "the address of a TAP device");
}

void set_up(int socket, const char* device) {
  ifreq r = request(device);
  r.ifr_flags = IFF_UP | IFF_RUNNING;
  check(ioctl(socket, SIOCSIFFLAGS, &r), std::string("no way to set up ") + device);
}

struct Device {
  Descriptor name_space, tap;
};

// The calling thread moves to a namespace of its own, for ever.
Device make_host(std::size_t host) {
  check(unshare(CLONE_NEWNET), "no network namespace can be made");
  Device device;
  device.name_space = Descriptor(open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC));
  device.tap = Descriptor(open("/dev/net/tun", O_RDWR | O_CLOEXEC | O_NONBLOCK));
  check(device.tap.get(), "/dev/net/tun can't be opened");
  ifreq tap = request("eth0");
  tap.ifr_flags = IFF_TAP | IFF_NO_PI;
  check(ioctl(device.tap.get(), TUNSETIFF, &tap), "no TAP device can be made");

  const Descriptor control(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  ifreq hardware = request("eth0");
  hardware.ifr_hwaddr.sa_family = ARPHRD_ETHER;
  const std::array<unsigned char, 6> mac{2, 0, 0, 0, 0, static_cast<unsigned char>(host + 1)};
  std::copy(mac.begin(), mac.end(), reinterpret_cast<unsigned char*>(hardware.ifr_hwaddr.sa_data));
  check(ioctl(control.get(), SIOCSIFHWADDR, &hardware), "the hardware address of a TAP device");
  set_address(control.get(), SIOCSIFADDR, address_of(host));
  set_address(control.get(), SIOCSIFNETMASK, "255.255.255.0");
  ifreq queue = request("eth0");
  queue.ifr_qlen = kDevicePackets;
  check(ioctl(control.get(), SIOCSIFTXQLEN, &queue), "the queue of a TAP device");
  set_up(control.get(), "lo");
  set_up(control.get(), "eth0");
  return device;
}

}  // namespace

struct VirtualNetwork::Switch {
  struct Port {
    Device device;
    LinkQueue up, down;
    bool hears_multicast = true;
  };

  explicit Switch(const std::vector<HostLinks>& hosts) : wake(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    for (std::size_t i = 0; i < hosts.size(); ++i) ports.push_back(make_port(i, hosts[i]));
    thread = std::thread([this] { run(); });
  }
  ~Switch() {
    stop = true;
    eventfd_write(wake.get(), 1);
    thread.join();
  }

  static Port make_port(std::size_t host, const HostLinks& links) {
    const auto seed = static_cast<std::uint32_t>(2 * host + 1);
    Port port{{}, LinkQueue(links.up, seed), LinkQueue(links.down, seed + 1), links.hears_multicast};
    std::string failure;
    std::thread([&] {
      try {
        port.device = make_host(host);
      } catch (const std::exception& error) {
        failure = error.what();
      }
    }).join();
    if (!failure.empty()) throw std::runtime_error(failure);
    return port;
  }

  void run();
  void read_frames(Port& port);
  void pass_on(Port& from, double now_s);
  double wait_s() const;

  std::vector<Port> ports;
  mutable std::mutex mutex;
  Descriptor wake;
  std::atomic<bool> stop = false;
  std::thread thread;
};

void VirtualNetwork::Switch::read_frames(Port& port) {
  EthernetFrame frame(kMostFrameBytes);
  for (int i = 0; i < kDevicePackets; ++i) {
    const ssize_t size = read(port.device.tap.get(), frame.data(), frame.size());
    if (size <= 0) return;
    port.up.offer({frame.begin(), frame.begin() + size}, steady_now_s());
  }
}

// From the uplink of a host to the downlinks of the hosts that the frame is for, and from each downlink to its host.
void VirtualNetwork::Switch::pass_on(Port& from, double now_s) {
  EthernetFrame frame;
  while (from.up.take(now_s, frame)) {
    const bool to_all = (frame[0] & 1) != 0, is_multicast = to_all && frame[0] != 0xff;
    for (std::size_t i = 0; i < ports.size(); ++i)
      if (&ports[i] != &from && (to_all || frame[5] == i + 1) && (ports[i].hears_multicast || !is_multicast))
        ports[i].down.offer(frame, now_s);
  }
  // A host that takes nothing loses it, as with any network card.
  while (from.down.take(now_s, frame)) (void)!write(from.device.tap.get(), frame.data(), frame.size());
}

double VirtualNetwork::Switch::wait_s() const {
  double next_s = 1e300;
  for (const Port& port : ports)
    for (const LinkQueue* queue : {&port.up, &port.down}) next_s = std::min(next_s, queue->next_s().value_or(1e300));
  return std::clamp(next_s - steady_now_s(), 0.0, 1.0);
}

void VirtualNetwork::Switch::run() {
  std::vector<pollfd> ready;
  for (const Port& port : ports) ready.push_back({port.device.tap.get(), POLLIN, 0});
  ready.push_back({wake.get(), POLLIN, 0});
  while (!stop) {
    double patience_s = 0;
    {
      const std::lock_guard lock(mutex);
      patience_s = wait_s();
    }
    const timespec patience{static_cast<time_t>(patience_s),
                            static_cast<long>(1e9 * (patience_s - std::floor(patience_s)))};
    ppoll(ready.data(), ready.size(), &patience, nullptr);
    const std::lock_guard lock(mutex);
    for (std::size_t i = 0; i < ports.size(); ++i)
      if ((ready[i].revents & POLLIN) != 0) read_frames(ports[i]);
    const double now_s = steady_now_s();
    for (Port& port : ports) pass_on(port, now_s);
  }
}

VirtualNetwork::VirtualNetwork(const std::vector<HostLinks>& hosts) : switch_(std::make_unique<Switch>(hosts)) {}

VirtualNetwork::~VirtualNetwork() = default;

int VirtualNetwork::host(std::size_t index) const {
  return switch_->ports.at(index).device.name_space.get();
}

std::string VirtualNetwork::address(std::size_t index) const {
  return address_of(index);
}

std::vector<std::string> VirtualNetwork::network_flags(std::size_t index, const std::string& keys) const {
  std::vector<std::string> flags{"--interface", address_of(index)};
  if (keys.empty())
    flags.push_back("--insecure");
  else
    flags.insert(flags.end(), {"--keys", keys});
  for (std::size_t i = 0; i < switch_->ports.size(); ++i) flags.insert(flags.end(), {"--peer", address_of(i)});
  return flags;
}

LinkTraffic VirtualNetwork::up(std::size_t index) const {
  const std::lock_guard lock(switch_->mutex);
  return switch_->ports.at(index).up.traffic();
}

LinkTraffic VirtualNetwork::down(std::size_t index) const {
  const std::lock_guard lock(switch_->mutex);
  return switch_->ports.at(index).down.traffic();
}

}  // namespace sectio::test
