// The fields of the messages of topology.h, in the order of the wire (fields.h).
#pragma once

#include "common/messages/fields.h"
#include "common/messages/session_fields.h"
#include "common/messages/state.h"
#include "common/messages/topology.h"

namespace sectio {

constexpr std::uint32_t kMaxTriangleSlots = 2 * kMaxVertexSlots;

template <class Visitor, FieldsOf<VertexEdit> M>
void fields(Visitor& visit, M& message) {
  auto& [id, alive, rest_body_m] = message;
  visit("slot", id, below(kMaxVertexSlots));
  visit("alive", alive);
  visit("rest_body_m", rest_body_m, kPosition_m);
}

template <class Visitor, FieldsOf<Triangle> M>
void fields(Visitor& visit, M& message) {
  auto& [v, surface] = message;
  visit("corners", v);
  visit("surface", surface, at_most(static_cast<double>(Surface::wall)));
}

bool is_consistent(const Triangle& triangle);  // corners in range, unless it is dead

template <class Visitor, FieldsOf<TriangleEdit> M>
void fields(Visitor& visit, M& message) {
  auto& [id, triangle] = message;
  visit("slot", id, below(kMaxTriangleSlots));
  visit("triangle", triangle);
}

template <class Visitor, FieldsOf<TopologyDelta> M>
void fields(Visitor& visit, M& message) {
  auto& [base_revision, revision, hash_after, vertex_slots_after, triangle_slots_after, temporary, vertices,
         triangles] = message;
  visit("base_revision", base_revision);
  visit("revision", revision);
  visit("hash_after", hash_after);
  visit("vertex_slots_after", vertex_slots_after, at_most(kMaxVertexSlots));
  visit("triangle_slots_after", triangle_slots_after, at_most(kMaxTriangleSlots));
  visit("temporary", temporary);
  visit("vertices", vertices, at_most(kMaxVertexSlots));
  visit("triangles", triangles, at_most(kMaxTriangleSlots));
}

bool is_consistent(const TopologyDelta& delta);  // revisions and slots ascend

template <class Visitor, FieldsOf<DeltaMessage> M>
void fields(Visitor& visit, M& message) {
  auto& [epoch, body_id, delta] = message;
  visit("epoch", epoch);
  visit("body_id", body_id, below(kMaxBodies));
  visit("delta", delta);
}

template <class Visitor, FieldsOf<KeyframeChunk> M>
void fields(Visitor& visit, M& message) {
  auto& [epoch, body_id, revision, total_bytes, chunk, chunks, bytes] = message;
  visit("epoch", epoch);
  visit("body_id", body_id, below(kMaxBodies));
  visit("revision", revision);
  visit("total_bytes", total_bytes, at_most(kMaxKeyframeBytes));
  visit("chunk", chunk, below(kMaxChunks));
  visit("chunks", chunks, from_to(1, kMaxChunks));
  visit("bytes", bytes, from_to(1, kChunkBytes));
}

bool is_consistent(const KeyframeChunk& chunk);  // all chunks but the last are of one size

template <class Visitor, FieldsOf<KeyframeRequest> M>
void fields(Visitor& visit, M& message) {
  auto& [epoch, body_id, known_revision, client, revision, first_chunk, chunks] = message;
  visit("epoch", epoch);
  visit("body_id", body_id, below(kMaxBodies));
  visit("known_revision", known_revision);
  visit("client", client);
  visit("revision", revision);
  visit("first_chunk", first_chunk, below(kMaxChunks));
  visit("chunks", chunks, from_to(1, kMostWindow));
}

}  // namespace sectio
