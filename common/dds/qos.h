// How each topic travels: the one place for quality of service. Names no type of Fast DDS; endpoint.cpp obeys.
//
// Every reliable writer is transient local: a volatile one that keeps the last samples can get stuck for good in
// write() while readers come and go (Fast DDS 2.9). No topic is keyed: each is one ordered stream. Reliable writers
// keep the last N samples and overwrite, so a slow or stopped reader never holds one up; what it then misses it finds
// by revision, and asks for a keyframe.
#pragma once

#include <cstdint>

namespace sectio {

struct TopicQos {
  const char* name;
  bool reliable;
  bool late_joiners;        // readers get what was kept of the time before they came
  std::int32_t depth;       // samples that a writer keeps, and a reader (of few: one for each of several writers)
  std::uint32_t max_bytes;  // of a serialised sample; larger ones are neither sent nor read
};

constexpr double kHeartbeat_s = 0.02;
constexpr double kHeartbeatResponse_s = 0.001;
constexpr double kAnnouncement_s = 0.3;
constexpr double kParticipantLease_s = 2;
constexpr std::uint32_t kSocketBufferBytes = 1u << 22;
constexpr std::uint32_t kMaxDatagramOffHostBytes = 1400;  // a fragmented datagram dies with any of its fragments

// Defined for the message types of idl/ and for no other type.
template <class Message>
const TopicQos& qos_of();

}  // namespace sectio
