// How each topic travels: the one place for quality of service. Names no type of Fast DDS; endpoint.cpp obeys.
//
// Every reliable writer is transient local: a volatile one that keeps the last samples can get stuck for good in
// write() while readers come and go (Fast DDS 2.9). No topic is keyed: each is one ordered stream. Reliable writers
// keep the last N samples and overwrite the oldest, so that a slow or stopped reader never holds a writer up. Such a
// reader notices by revision what it has missed, and asks for a keyframe.
#pragma once

#include <cstdint>
#include <span>

namespace sectio {

struct TopicQos {
  const char* name;
  const char* type;  // as DDS knows it: the struct of idl/
  bool reliable;
  bool late_joiners;        // a reader gets the samples that were kept from before it came
  std::int32_t depth;       // samples that a writer keeps, and a reader (of few: one for each of several writers)
  std::uint32_t max_bytes;  // of an encoded message; larger ones are neither sent nor read
};

constexpr double kHeartbeat_s = 0.02;
constexpr double kHeartbeatResponse_s = 0.001;
constexpr double kAnnouncement_s = 0.3;
constexpr double kParticipantLease_s = 2;
constexpr std::uint32_t kSocketBufferBytes = 1u << 22;
constexpr std::uint32_t kMaxDatagramOffHostBytes = 1400;  // a fragmented datagram dies with any of its fragments

// Defined for the messages of common/messages and for no other type.
template <class Message>
const TopicQos& qos_of();

// All of them.
std::span<const TopicQos> topics();

}  // namespace sectio
