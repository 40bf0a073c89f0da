#include "common/dds/qos.h"

#include <array>

#include "common/messages/contact.h"
#include "common/messages/inputs.h"
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
constexpr bool kExpedites = true;
constexpr std::uint32_t kKiB = 1024;
constexpr std::uint32_t kMiB = 1024 * kKiB;
constexpr std::int32_t kManyPieces = 4096;  // a reader that looks ten times a second finds 60 Hz of 100 000 vertices
constexpr std::int32_t kManyRequests =
    1024;  // a program that asks in bursts crowds out nobody else before they are read

#define SECTIO_TYPE(Message) "sectio::wire::" #Message
// clang-format off
constexpr std::array kTopics{
    // Each packet carries the last few poses: nothing is sent again.
    TopicQos{"tool_packets",      SECTIO_TYPE(ToolPacket),      kBestEffort, kNowOnly,     32,   4 * kKiB, kStream, {}, 16, kExpedites},
    TopicQos{"tool_wishes",       SECTIO_TYPE(ToolWish),        kBestEffort, kNowOnly,     8,    kKiB,     kStream, {}, 16, kExpedites},
    TopicQos{"contact_models",    SECTIO_TYPE(ContactMessage),  kBestEffort, kNowOnly,     1,    kKiB,     kStream, {}, 16, kExpedites},
    TopicQos{"topology_deltas",   SECTIO_TYPE(DeltaMessage),    kReliable,   kNowOnly,     1024, 16 * kMiB, kStream, kDeltaChannels},
    // A joiner asks for a keyframe, and needs no older deltas or chunks.
    TopicQos{"keyframes",         SECTIO_TYPE(KeyframeChunk),   kReliable,   kNowOnly,     1024, 64 * kKiB, kBurst, kKeyframeChannels},
    TopicQos{"keyframe_requests", SECTIO_TYPE(KeyframeRequest), kReliable,   kLateJoiners, 64,   kKiB,     kStream, {}, kManyRequests},
    // Reliable, because a best-effort reader drops what others have overtaken. Writers keep little: old states are not
    // worth repeating.
    TopicQos{"state_headers",     SECTIO_TYPE(StateHeader),     kReliable,   kNowOnly,     8,    kMiB,     kStream, kStateChannels},
    TopicQos{"state_pieces",      SECTIO_TYPE(StatePiece),      kReliable,   kNowOnly,     128,  2 * kKiB, kStream, kStateChannels, kManyPieces},
    TopicQos{"scalar_pieces",     SECTIO_TYPE(ScalarPiece),     kReliable,   kNowOnly,     128,  kKiB,     kStream, kStateChannels, kManyPieces},
    TopicQos{"link_reports",      SECTIO_TYPE(LinkReport),      kBestEffort, kNowOnly,     4,    kKiB,     kStream, {}, kManyRequests},
    TopicQos{"scene",             SECTIO_TYPE(SceneInfo),       kReliable,   kLateJoiners, 1,    2 * kMiB},
    TopicQos{"events",            SECTIO_TYPE(SessionEvent),    kReliable,   kLateJoiners, 256,  4 * kKiB},
    TopicQos{"server_status",     SECTIO_TYPE(ServerStatus),    kBestEffort, kNowOnly,     1,    64 * kKiB},
    // A server that comes later, to go on with a session, has nothing to do with orders to the one before.
    TopicQos{"session_orders",    SECTIO_TYPE(SessionOrder),    kReliable,   kNowOnly,     16,   kKiB,     kStream, {}, kManyRequests},
    TopicQos{"session_end",       SECTIO_TYPE(SessionEnd),      kReliable,   kLateJoiners, 1,    64 * kKiB},
    // For a standby, which asks for what it has missed.
    TopicQos{"step_inputs",       SECTIO_TYPE(StepInputs),      kReliable,   kNowOnly,     4096, kMiB},
    TopicQos{"step_requests",     SECTIO_TYPE(StepRequest),     kBestEffort, kNowOnly,     16,   kKiB,     kStream, {}, kManyRequests},
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
template <> const TopicQos& qos_of<LinkReport>() { return kTopics[9]; }
template <> const TopicQos& qos_of<SceneInfo>() { return kTopics[10]; }
template <> const TopicQos& qos_of<SessionEvent>() { return kTopics[11]; }
template <> const TopicQos& qos_of<ServerStatus>() { return kTopics[12]; }
template <> const TopicQos& qos_of<SessionOrder>() { return kTopics[13]; }
template <> const TopicQos& qos_of<SessionEnd>() { return kTopics[14]; }
template <> const TopicQos& qos_of<StepInputs>() { return kTopics[15]; }
template <> const TopicQos& qos_of<StepRequest>() { return kTopics[16]; }
// clang-format on

std::span<const TopicQos> topics() {
  return kTopics;
}

}  // namespace sectio
