// Plain values to wire messages and back. What comes in is validated here, once: sizes, indices, finite numbers,
// enumerators, revisions. What from_wire() returns can be used without another look; nothing means: drop and count.
#pragma once

#include <optional>

#include "common/math/contact_model.h"
#include "common/messages/session.h"
#include "common/messages/state.h"
#include "common/messages/tool.h"
#include "common/messages/topology.h"
#include "idl/session.h"
#include "idl/state.h"
#include "idl/tool.h"
#include "idl/topology.h"

namespace sectio {

constexpr double kMaxCoordinate_m = 1e4;
constexpr std::uint32_t kMaxTriangleSlots = 2 * kMaxVertexSlots;
constexpr std::uint32_t kMaxChunks = 1u << 18;

wire::ToolPacket to_wire(const ToolPacket& packet);
wire::ContactModel to_wire(const ContactModel& model, std::uint64_t epoch);
wire::TopologyDelta to_wire(const DeltaMessage& message);
wire::KeyframeChunk to_wire(const KeyframeChunk& chunk);
wire::KeyframeRequest to_wire(const KeyframeRequest& request);
wire::StateHeader to_wire(const StateHeader& header);
wire::StatePiece to_wire(const StatePiece& piece);
wire::SceneInfo to_wire(const SceneInfo& scene);
wire::Event to_wire(const SessionEvent& event);
wire::ServerStatus to_wire(const ServerStatus& status);
wire::GravityRequest to_wire(const GravityRequest& request);
wire::SessionEnd to_wire(const SessionEnd& end);

struct ContactMessage {
  std::uint64_t epoch = 0;
  ContactModel model;
};

std::optional<ToolPacket> from_wire(const wire::ToolPacket& m);
std::optional<ContactMessage> from_wire(const wire::ContactModel& m);
std::optional<DeltaMessage> from_wire(const wire::TopologyDelta& m);
std::optional<KeyframeChunk> from_wire(const wire::KeyframeChunk& m);
std::optional<KeyframeRequest> from_wire(const wire::KeyframeRequest& m);
std::optional<StateHeader> from_wire(const wire::StateHeader& m);
std::optional<StatePiece> from_wire(const wire::StatePiece& m);
std::optional<SceneInfo> from_wire(const wire::SceneInfo& m);
std::optional<SessionEvent> from_wire(const wire::Event& m);
std::optional<ServerStatus> from_wire(const wire::ServerStatus& m);
std::optional<GravityRequest> from_wire(const wire::GravityRequest& m);
std::optional<SessionEnd> from_wire(const wire::SessionEnd& m);

}  // namespace sectio
