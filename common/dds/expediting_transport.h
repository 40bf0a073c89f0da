// UDP whose packets are marked for expedited forwarding (RFC 3246, DSCP 46) when a writer says so, so that a hand
// doesn't wait in the queue of a link behind pictures, where the network heeds marks. Fast DDS 2.9 marks no packets by
// itself.
// Only for the sources of common/dds.
#pragma once

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include <memory>

namespace sectio {

std::shared_ptr<eprosima::fastdds::rtps::TransportDescriptorInterface> expediting(
    std::shared_ptr<eprosima::fastdds::rtps::UDPv4TransportDescriptor> udp);

// While it lives, the packets are marked that this thread sends.
class Expedite {
 public:
  explicit Expedite(bool expedite);
  ~Expedite();
  Expedite(const Expedite&) = delete;
  Expedite& operator=(const Expedite&) = delete;
};

}  // namespace sectio
