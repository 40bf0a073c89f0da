// How each topic travels: the one place for quality of service. Names no type of Fast DDS; endpoint.cpp obeys.
//
// Every reliable writer is transient local: a volatile one that keeps the last samples can get stuck for good in
// write() while readers come and go (Fast DDS 2.9). No topic is keyed: each is one ordered stream. Reliable writers
// keep the last N samples and overwrite the oldest, so that a slow or stopped reader never holds a writer up. Such a
// reader notices by revision what it has missed, and asks for a keyframe.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace sectio {

// How lost samples of a reliable topic are repeated. The writer says in each heartbeat what it has sent; a reader
// answers with what it lacks. A reader that answers at once asks again for samples that are still under way in the
// queue of a thin link, and the repeats fill the link: so both sides wait a little, and no heartbeat rides on samples.
struct Repair {
  double heartbeat_s;         // from one heartbeat to the next while a reader lacks something
  double response_s;          // a reader answers a heartbeat after this time
  double nack_response_s;     // the writer answers such a response after this time
  double nack_suppression_s;  // for so long after a sample was sent, its loss isn't believed
};
constexpr Repair kStream{0.02, 0.003, 0.005, 0};  // few samples at a time, each needed soon
constexpr Repair kBurst{0.05, 0.005, 0.01, 0.1};  // many at once, which fill a queue by themselves

// A topic may go out in channels, each a partition of its own ("theatre/4/20hz"): a reader hears those that its program
// has asked for (Participant::hear), and the writer knows who hears which.
inline constexpr std::array kStateChannels{"60hz", "20hz", "6hz", "2hz"};
inline constexpr std::array kKeyframeChannels{"keyframes"};
inline constexpr std::array kDeltaChannels{"deltas"};

struct TopicQos {
  const char* name;
  const char* type;  // the name that DDS knows: the struct of idl/
  bool reliable;
  bool late_joiners;                           // a reader gets the samples that were kept from before it came
  std::int32_t depth;                          // samples that a writer keeps
  std::uint32_t max_bytes;                     // an encoded message; larger ones are neither sent nor read
  Repair repair = kStream;                     // reliable topics only
  std::span<const char* const> channels = {};  // none: every reader hears all
  std::int32_t reader_depth =
      16;                  // a reader keeps these, if more than writers do: the newest of each of several servers
  bool expedited = false;  // its packets are marked, so that they leave first where a queue heeds marks
};

// A program that is silent for the duration of its lease is dropped. Announcements go to each port of each peer that a
// program may have: on a thin link they count.
struct Lease {
  double announcement_s;
  double duration_s;
};
constexpr Lease kLeaseOnHost{0.3, 2};
constexpr Lease kLeaseOffHost{1, 5};
constexpr std::uint32_t kSocketBufferBytes = 1u << 22;
constexpr std::uint32_t kMaxDatagramOffHostBytes = 1400;  // a fragmented datagram dies with any of its fragments
// The messages by which programs with keys get to know each other are never cut: certificate and permissions.
constexpr std::uint32_t kMaxDatagramWithKeysBytes = 16000;

// Defined for the messages of common/messages and for no other type.
template <class Message>
const TopicQos& qos_of();

// The topics of all messages.
std::span<const TopicQos> topics();

}  // namespace sectio
