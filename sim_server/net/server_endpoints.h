// The readers and writers of a server.
#pragma once

#include "common/dds/endpoints.h"
#include "common/messages/contact.h"
#include "common/messages/inputs.h"
#include "common/messages/session.h"
#include "common/messages/state.h"
#include "common/messages/tool.h"
#include "common/messages/topology.h"

namespace sectio {

using ServerEndpoints =
    Endpoints<Reads<ToolPacket, SessionOrder,            // Intake
                    KeyframeRequest, LinkReport,         // Publisher
                    SceneInfo, StateHeader, SessionEnd,  // OtherServers
                    StepRequest, StepInputs,             // InputFeed, Follower
                    ServerStatus>,                       // Follower
              Writes<SceneInfo, DeltaMessage, KeyframeChunk, StateHeader, StatePiece, ScalarPiece, ContactMessage,
                     SessionEvent, ServerStatus, SessionEnd, StepInputs, StepRequest>>;

// Programs that read topology are viewers.
inline const auto& writer_to_viewers(const ServerEndpoints& endpoints) {
  return endpoints.writer<DeltaMessage>();
}

}  // namespace sectio
