// Decides which pieces of a state are worth sending: those in which a vertex moved by more than the quantum since it
// was last sent, or whose slots changed, and in turn all the others, so that a lost piece heals within a second. Scalar
// fields go the same way, a piece at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "common/messages/state.h"
#include "common/messages/topology.h"

namespace sectio {

// The state of one step, copied out of the simulation.
struct StateSnapshot {
  struct Body {
    std::uint64_t revision = 0;
    std::vector<Vec3f> positions_world_m;  // one a vertex slot
    std::vector<ScalarField> scalars = {};
  };
  std::uint64_t step = 0;
  double step_wall_time_s = 0;
  bool in_contact = false;
  Vec3 gravity_m_per_s2{0, 0, -9.81};
  std::vector<Body> bodies;
  std::vector<ToolState> tools;
};

class StateEncoder {
 public:
  // How fine a state is sent: a piece goes out when a vertex of it has moved by more than least_motion_quanta, and
  // once in frames_per_refresh whatever has moved. A refresh adds at most so many pieces to a state.
  struct Fineness {
    std::uint32_t frames_per_refresh = 60;
    int least_motion_quanta = 1;
    std::uint32_t most_refreshed = ~0u;
  };
  static constexpr std::uint8_t kRepeats = 3;  // for a piece whose slots changed: its loss would be seen most
  static constexpr int kScalarStep = 128;  // levels by which a scalar must change to be sent: half a step of a colour

  StateEncoder(std::uint64_t epoch, double step_s, std::size_t bodies) : StateEncoder(epoch, step_s, bodies, {}) {}
  StateEncoder(std::uint64_t epoch, double step_s, std::size_t bodies, const Fineness& fineness)
      : epoch_(epoch), step_s_(step_s), fineness_(fineness), bodies_(bodies) {}

  // One more body, whose state begins with the next snapshot.
  void add_body() { bodies_.emplace_back(); }
  // The slots that a delta changed are sent with the first state of its revision or later.
  void changed(std::uint32_t body_id, const TopologyDelta& delta);
  // All pieces with the next states, for a viewer that begins from a keyframe.
  void refresh(std::uint32_t body_id);
  // There are pieces that wait for their turn in a refresh.
  bool is_refreshing() const { return refreshing_ > 0; }

  // The header, and the pieces that it names; `whole`: all of them. Results are valid until the next call.
  void encode(const StateSnapshot& snapshot, bool whole = false);
  const StateHeader& header() const { return header_; }  // without the time at which it is sent
  std::span<const StatePiece> pieces() const { return {pieces_.data(), used_}; }
  std::span<const ScalarPiece> scalar_pieces() const { return scalar_pieces_; }

 private:
  struct SentScalar {
    std::string name;
    float least = 0, most = 0;
    std::vector<std::uint16_t> levels;  // by vertex slot
    std::vector<bool> sent;             // by piece
  };
  struct Body {
    struct Change {
      std::uint64_t revision = 0;
      std::vector<std::uint32_t> pieces;
    };
    std::deque<Change> changes;        // not sent yet, ascending in revision
    std::vector<std::uint8_t> repeat;  // by piece: how often still to be sent whatever moved
    std::vector<GridPoint> sent;       // by vertex slot
    std::vector<SentScalar> scalars;
  };

  void encode_body(std::uint32_t body_id, const StateSnapshot& snapshot, bool whole);
  void encode_scalars(std::uint32_t body_id, const StateSnapshot& snapshot, std::span<const std::uint8_t> in_turn);
  void encode_scalar(const ScalarField& field, SentScalar& sent, ScalarPiece head,
                     std::span<const std::uint8_t> in_turn);
  bool moved(const Body& body, std::uint32_t first) const;
  StatePiece& next_piece();

  std::uint64_t epoch_;
  double step_s_;
  Fineness fineness_;
  std::vector<Body> bodies_;
  std::uint32_t frame_ = 0;
  std::uint32_t refreshed_ = 0, refreshing_ = 0;  // pieces in the state at hand; that wait
  StateHeader header_;
  std::vector<StatePiece> pieces_;  // the first used_ of them; the rest keep their memory
  std::size_t used_ = 0;
  std::vector<ScalarPiece> scalar_pieces_;
  std::vector<GridPoint> now_;         // the piece at hand
  std::vector<std::uint8_t> in_turn_;  // by piece of the body at hand: it is sent whatever has changed
};

}  // namespace sectio
