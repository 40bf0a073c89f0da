#include "common/dds/qos.h"

#include "idl/session.h"
#include "idl/state.h"
#include "idl/tool.h"
#include "idl/topology.h"

namespace sectio {

namespace {

constexpr bool kReliable = true;
constexpr bool kBestEffort = false;
constexpr bool kLateJoiners = true;
constexpr bool kNowOnly = false;
constexpr std::uint32_t kKiB = 1024;
constexpr std::uint32_t kMiB = 1024 * kKiB;

// Each packet carries the last few poses: nothing is sent again.
constexpr TopicQos kTool{"tool_packets", kBestEffort, kNowOnly, 32, 4 * kKiB};
constexpr TopicQos kContact{"contact_models", kBestEffort, kNowOnly, 1, kKiB};
constexpr TopicQos kDelta{"topology_deltas", kReliable, kLateJoiners, 1024, 16 * kMiB};
// On request, so a joiner isn't given old ones as well. 64 MiB on loopback, 2.4 MiB in packets of 1200 bytes.
constexpr TopicQos kKeyframe{"keyframes", kReliable, kNowOnly, 2048, 64 * kKiB};
constexpr TopicQos kKeyframeRequest{"keyframe_requests", kReliable, kLateJoiners, 64, kKiB};
constexpr TopicQos kStateHeader{"state_headers", kBestEffort, kNowOnly, 64, kMiB};
// A reader that looks ten times a second finds 60 Hz of a body of 100 000 vertices.
constexpr TopicQos kStatePiece{"state_pieces", kBestEffort, kNowOnly, 4096, 2 * kKiB};
constexpr TopicQos kScene{"scene", kReliable, kLateJoiners, 1, 2 * kMiB};
constexpr TopicQos kEvent{"events", kReliable, kLateJoiners, 256, 4 * kKiB};
constexpr TopicQos kStatus{"server_status", kBestEffort, kNowOnly, 1, 64 * kKiB};
constexpr TopicQos kGravity{"gravity_requests", kReliable, kLateJoiners, 1, kKiB};
constexpr TopicQos kEnd{"session_end", kReliable, kLateJoiners, 1, 64 * kKiB};

}  // namespace

// clang-format off
template <> const TopicQos& qos_of<wire::ToolPacket>() { return kTool; }
template <> const TopicQos& qos_of<wire::ContactModel>() { return kContact; }
template <> const TopicQos& qos_of<wire::TopologyDelta>() { return kDelta; }
template <> const TopicQos& qos_of<wire::KeyframeChunk>() { return kKeyframe; }
template <> const TopicQos& qos_of<wire::KeyframeRequest>() { return kKeyframeRequest; }
template <> const TopicQos& qos_of<wire::StateHeader>() { return kStateHeader; }
template <> const TopicQos& qos_of<wire::StatePiece>() { return kStatePiece; }
template <> const TopicQos& qos_of<wire::SceneInfo>() { return kScene; }
template <> const TopicQos& qos_of<wire::Event>() { return kEvent; }
template <> const TopicQos& qos_of<wire::ServerStatus>() { return kStatus; }
template <> const TopicQos& qos_of<wire::GravityRequest>() { return kGravity; }
template <> const TopicQos& qos_of<wire::SessionEnd>() { return kEnd; }
// clang-format on

}  // namespace sectio
