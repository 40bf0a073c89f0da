#include "common/dds/qos.h"

#include <array>

#include "common/messages/contact.h"
#include "common/messages/session.h"
#include "common/messages/state.h"
#include "common/messages/tool.h"
#include "common/messages/topology.h"

namespace sectio {

namespace {

constexpr bool kReliable = true;
constexpr bool kBestEffort = false;
constexpr bool kLateJoiners = true;
constexpr bool kNowOnly = false;
constexpr std::uint32_t kKiB = 1024;
constexpr std::uint32_t kMiB = 1024 * kKiB;

#define SECTIO_TYPE(Message) "sectio::wire::" #Message
// clang-format off
constexpr std::array kTopics{
    // Each packet carries the last few poses: nothing is sent again.
    TopicQos{"tool_packets",      SECTIO_TYPE(ToolPacket),      kBestEffort, kNowOnly,     32,   4 * kKiB},
    TopicQos{"tool_wishes",       SECTIO_TYPE(ToolWish),        kBestEffort, kNowOnly,     8,    kKiB},
    TopicQos{"contact_models",    SECTIO_TYPE(ContactMessage),  kBestEffort, kNowOnly,     1,    kKiB},
    TopicQos{"topology_deltas",   SECTIO_TYPE(DeltaMessage),    kReliable,   kLateJoiners, 1024, 16 * kMiB},
    // On request, so that a joiner isn't given old ones as well. 64 MiB on loopback, 2.4 MiB in packets of 1200 bytes.
    TopicQos{"keyframes",         SECTIO_TYPE(KeyframeChunk),   kReliable,   kNowOnly,     2048, 64 * kKiB},
    TopicQos{"keyframe_requests", SECTIO_TYPE(KeyframeRequest), kReliable,   kLateJoiners, 64,   kKiB},
    TopicQos{"state_headers",     SECTIO_TYPE(StateHeader),     kBestEffort, kNowOnly,     64,   kMiB},
    // A reader that looks ten times a second finds 60 Hz of a body of 100 000 vertices.
    TopicQos{"state_pieces",      SECTIO_TYPE(StatePiece),      kBestEffort, kNowOnly,     4096, 2 * kKiB},
    TopicQos{"scalar_pieces",     SECTIO_TYPE(ScalarPiece),     kBestEffort, kNowOnly,     4096, kKiB},
    TopicQos{"scene",             SECTIO_TYPE(SceneInfo),       kReliable,   kLateJoiners, 1,    2 * kMiB},
    TopicQos{"events",            SECTIO_TYPE(SessionEvent),    kReliable,   kLateJoiners, 256,  4 * kKiB},
    TopicQos{"server_status",     SECTIO_TYPE(ServerStatus),    kBestEffort, kNowOnly,     1,    64 * kKiB},
    TopicQos{"gravity_requests",  SECTIO_TYPE(GravityRequest),  kReliable,   kLateJoiners, 1,    kKiB},
    TopicQos{"session_end",       SECTIO_TYPE(SessionEnd),      kReliable,   kLateJoiners, 1,    64 * kKiB},
};
#undef SECTIO_TYPE

}  // namespace

template <> const TopicQos& qos_of<ToolPacket>() { return kTopics[0]; }
template <> const TopicQos& qos_of<ToolWish>() { return kTopics[1]; }
template <> const TopicQos& qos_of<ContactMessage>() { return kTopics[2]; }
template <> const TopicQos& qos_of<DeltaMessage>() { return kTopics[3]; }
template <> const TopicQos& qos_of<KeyframeChunk>() { return kTopics[4]; }
template <> const TopicQos& qos_of<KeyframeRequest>() { return kTopics[5]; }
template <> const TopicQos& qos_of<StateHeader>() { return kTopics[6]; }
template <> const TopicQos& qos_of<StatePiece>() { return kTopics[7]; }
template <> const TopicQos& qos_of<ScalarPiece>() { return kTopics[8]; }
template <> const TopicQos& qos_of<SceneInfo>() { return kTopics[9]; }
template <> const TopicQos& qos_of<SessionEvent>() { return kTopics[10]; }
template <> const TopicQos& qos_of<ServerStatus>() { return kTopics[11]; }
template <> const TopicQos& qos_of<GravityRequest>() { return kTopics[12]; }
template <> const TopicQos& qos_of<SessionEnd>() { return kTopics[13]; }
// clang-format on

std::span<const TopicQos> topics() {
  return kTopics;
}

}  // namespace sectio
