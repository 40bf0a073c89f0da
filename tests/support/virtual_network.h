// Hosts of their own on one machine: a network namespace each, joined by a switch that runs in this process, on TAP
// devices. Every host has a link to the switch and one from it (link_queue.h).
//
//   VirtualNetwork network({{}, {.down = {.rate_bit_per_s = 5e6}}});
//   Process viewer(program, flags, network.host(1));
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/support/link_queue.h"

namespace sectio::test {

struct HostLinks {
  Link up = {};    // to the switch
  Link down = {};  // from the switch
  bool hears_multicast = true;
};

class VirtualNetwork {
 public:
  // Throws std::runtime_error, which says why, where the machine lets nobody make namespaces and TAP devices.
  explicit VirtualNetwork(const std::vector<HostLinks>& hosts);
  ~VirtualNetwork();
  VirtualNetwork(const VirtualNetwork&) = delete;
  VirtualNetwork& operator=(const VirtualNetwork&) = delete;

  // The descriptor of a host's namespace, for setns(2).
  int host(std::size_t index) const;
  std::string address(std::size_t index) const;  // 10.77.0.1 and up
  // "--interface ADDRESS --peer ADDRESS...": for a program on that host that is to meet those of all hosts; with these
  // keys, or else "--insecure".
  std::vector<std::string> network_flags(std::size_t index, const std::string& keys = "") const;

  LinkTraffic up(std::size_t index) const;
  LinkTraffic down(std::size_t index) const;

 private:
  struct Switch;
  std::unique_ptr<Switch> switch_;
};

}  // namespace sectio::test
