// Fields of a message that depend on each other.
#include <algorithm>
#include <cmath>

#include "common/messages/inputs_fields.h"
#include "common/messages/session_fields.h"
#include "common/messages/state_fields.h"
#include "common/messages/tool_fields.h"
#include "common/messages/topology_fields.h"

namespace sectio {
namespace {

constexpr std::uint64_t kMaxMergedRevisions = 1u << 16;  // revisions that one delta may span

template <class Edit>
bool is_ascending(const std::vector<Edit>& edits) {
  return std::adjacent_find(edits.begin(), edits.end(), [](const Edit& a, const Edit& b) { return a.id >= b.id; }) ==
         edits.end();
}

}  // namespace

bool is_consistent(const ToolPacket& packet) {
  const auto not_ascending = [](const ToolSample& a, const ToolSample& b) { return a.sequence >= b.sequence; };
  return std::adjacent_find(packet.samples.begin(), packet.samples.end(), not_ascending) == packet.samples.end();
}

bool is_consistent(const StepInputs& inputs) {
  const auto hole = [](const StepRecord& a, const StepRecord& b) { return b.step != a.step + 1; };
  return std::adjacent_find(inputs.steps.begin(), inputs.steps.end(), hole) == inputs.steps.end();
}

bool is_consistent(const ContactModel& model) {
  return std::abs(model.normal_world.norm() - 1) < kUnitTolerance;
}

bool is_consistent(const Triangle& triangle) {
  return !triangle.alive() ||
         std::all_of(triangle.v.begin(), triangle.v.end(), [](VertexId v) { return v < kMaxVertexSlots; });
}

bool is_consistent(const TopologyDelta& delta) {
  return delta.revision > delta.base_revision && delta.revision - delta.base_revision <= kMaxMergedRevisions &&
         is_ascending(delta.vertices) && is_ascending(delta.triangles);
}

bool is_consistent(const KeyframeChunk& chunk) {
  const std::uint64_t size = chunk.bytes.size();
  if (chunk.chunk >= chunk.chunks || chunk.total_bytes < chunk.chunks) return false;
  const bool last = chunk.chunk + 1 == chunk.chunks;
  return last || (chunk.total_bytes + size - 1) / size == chunk.chunks;
}

bool is_consistent(const BodyInfo& body) {
  return flaw_of(body.regions).empty();
}

bool is_consistent(const BodyState& body) {
  const std::uint32_t pieces = piece_count(body.vertex_slots);
  if (body.pieces_sent.size() != (pieces + 7) / 8) return false;
  return pieces % 8 == 0 || body.pieces_sent.back() >> (pieces % 8) == 0;
}

bool is_consistent(const StatePiece& piece) {
  int exponent = 0;
  const double mantissa = std::frexp(piece.quantum_m / kQuantum_m, &exponent);
  return piece.offsets_quanta.size() % 3 == 0 && mantissa == 0.5 && exponent >= 1 && exponent <= 16;
}

bool is_consistent(const ScalarField& field) {
  return field.least < field.most;
}

bool is_consistent(const ScalarPiece& piece) {
  return piece.least < piece.most;
}

}  // namespace sectio
