// The parts of a Participant, only for the sources of common/dds: this header costs seconds of compile time.
#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>

#include <map>
#include <optional>
#include <string>

#include "common/dds/keys.h"
#include "common/dds/participant.h"
#include "common/dds/peers.h"
#include "common/dds/program_number.h"

namespace sectio {

struct Participant::Parts {
  Parts(const Announcement& own, std::optional<Keys> own_keys)
      : keys(std::move(own_keys)), peers(own, keys ? keys->authority() : "") {}

  // The place at which the endpoints of a channel of a topic meet. The name is empty for a topic that has no channels.
  std::string partition_of(const std::string& channel) const {
    return channel.empty() ? partition : partition + "/" + channel;
  }

  std::optional<Keys> keys;
  Peers peers;
  eprosima::fastdds::dds::DomainParticipant* participant = nullptr;
  std::string partition;
  std::map<std::string, eprosima::fastdds::dds::Publisher*> publishers;  // by channel
  eprosima::fastdds::dds::Subscriber* subscriber = nullptr;
  bool off_host = false;
  std::optional<ProgramNumber> number;
};

inline eprosima::fastrtps::Duration_t duration(double seconds) {
  return eprosima::fastrtps::Duration_t(static_cast<long double>(seconds));
}

}  // namespace sectio
