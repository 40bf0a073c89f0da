// Messages that carry the state of one step to viewers (idl/state.idl): a header, and pieces of about one packet that
// each stand alone. Positions lie on a grid of kQuantum_m that is the same for every piece and every step, so that a
// vertex at rest has the same coordinates in all of them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/math/types.h"
#include "common/mesh/scalar_field.h"

namespace sectio {

constexpr std::uint32_t kVerticesPerPiece = 192;  // 1152 bytes of 16-bit coordinates: a packet of at most 1400 bytes
constexpr std::uint32_t kMaxVertexSlots = 1u << 24;
constexpr double kQuantum_m = 5e-6;  // far below a pixel; 16 bits of it span 0.33 m

// The rates at which states are offered; the slower ones are coarser, too (sim_server/net/publisher.cpp).
inline constexpr std::array kStateRates_hz{60.0, 20.0, 6.0, 2.0};

constexpr std::uint32_t piece_count(std::uint32_t vertex_slots) {
  return (vertex_slots + kVerticesPerPiece - 1) / kVerticesPerPiece;
}

struct ToolState {
  bool present = false;
  JointPose pose_world;
};

struct BodyState {
  std::uint64_t revision = 0;
  std::uint32_t vertex_slots = 0;
  std::vector<std::uint8_t> pieces_sent;  // one bit a piece, lowest first: the pieces that carry this step
  std::vector<std::string> scalars;       // the scalar fields that the body has now

  bool sent(std::uint32_t piece) const { return pieces_sent[piece / 8] >> (piece % 8) & 1; }
  void mark_sent(std::uint32_t piece) {
    pieces_sent[piece / 8] = static_cast<std::uint8_t>(pieces_sent[piece / 8] | 1u << (piece % 8));
  }
};

struct StateHeader {
  std::uint64_t epoch = 0;
  std::uint64_t step = 0;
  double sim_time_s = 0;
  double step_wall_time_s = 0;
  bool in_contact = false;
  std::vector<ToolState> tools;   // one a tool of SceneInfo
  std::vector<BodyState> bodies;  // one a body of SceneInfo
  Vec3 gravity_m_per_s2{0, 0, -9.81};
  double sent_s = 0;  // by a clock of the server that doesn't jump
};

// Positions of the vertex slots from kVerticesPerPiece * piece on. position = quantum_m * (origin_quanta + offset).
struct StatePiece {
  std::uint64_t epoch = 0;
  std::uint64_t step = 0;
  std::uint64_t revision = 0;
  std::uint32_t body_id = 0;
  std::uint32_t piece = 0;
  double quantum_m = kQuantum_m;  // kQuantum_m times a power of two: coarser where a piece spans more than 0.33 m
  std::array<std::int32_t, 3> origin_quanta{};
  std::vector<std::uint16_t> offsets_quanta;  // x, y, z of each vertex

  std::uint32_t vertices() const { return static_cast<std::uint32_t>(offsets_quanta.size() / 3); }
  Vec3f position_m(std::uint32_t i) const;
};

using GridPoint = std::array<std::int32_t, 3>;

// False, and `point` as before, when the position isn't finite or lies more than 5 km from the origin.
[[nodiscard]] bool to_grid(const Vec3f& position_m, GridPoint& point);

// Fills quantum, origin and offsets from at most kVerticesPerPiece points.
void encode_positions(std::span<const GridPoint> points, StatePiece& piece);

constexpr std::uint16_t kMostLevel = 0xffff;

// A value as one of 65536 levels of its range, and back.
std::uint16_t to_level(float value, float least, float most);
float from_level(std::uint16_t level, float least, float most);

// Values of the vertex slots from kVerticesPerPiece * piece on. The newer of two pieces for the same slots holds.
struct ScalarPiece {
  std::uint64_t epoch = 0;
  std::uint64_t step = 0;
  std::uint64_t revision = 0;
  std::uint32_t body_id = 0;
  std::uint32_t piece = 0;
  std::string name;
  float least = 0, most = 1;
  std::vector<std::uint16_t> levels;  // one a vertex
};

}  // namespace sectio
