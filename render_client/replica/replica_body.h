// The replica of one body: its topology and the positions of its vertices. replica.h has the rules.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/delta/delta_queue.h"
#include "common/delta/keyframe.h"
#include "common/messages/state.h"
#include "render_client/replica/frame.h"
#include "render_client/replica/replica_scalars.h"

namespace sectio {

struct ReplicaCounts {
  std::uint64_t deltas_applied = 0;
  std::uint64_t deltas_dropped = 0;  // malformed, of another history, or beyond the room to keep them
  std::uint64_t hash_mismatches = 0;
  std::uint64_t resyncs = 0;  // keyframes that replaced a mesh; a body's first keyframe doesn't count
  std::uint64_t requests = 0;
  std::uint64_t frames = 0;
  std::uint64_t patched_frames = 0;  // drawn with older positions where pieces were lost
};

class ReplicaBody {
 public:
  static constexpr std::size_t kMaxQueuedDeltas = 4096;
  static constexpr std::size_t kMaxQueuedEdits = 1u << 20;
  static constexpr std::size_t kMaxPieces = 1u << 14;  // 19 MB

  bool known() const { return known_; }
  const TriangleMesh& mesh() const { return mesh_; }

  void feed(TopologyDelta delta, ReplicaCounts& counts);
  void feed(TriangleMesh keyframe, ReplicaCounts& counts);
  void feed(StatePiece piece);
  void feed(ScalarPiece piece);

  // True when the mesh is at that revision, or deltas and keyframe at hand lead to it.
  bool can_reach(std::uint64_t revision) const;
  // Goes to that revision, or towards it as far as it can; true when it arrived. It never goes beyond.
  bool advance(std::uint64_t revision, ReplicaCounts& counts);
  // Goes as far as deltas and keyframe at hand lead.
  void catch_up(ReplicaCounts& counts);
  // Later deltas are at hand, but none that leads on from the mesh: a delta is missing.
  bool stuck() const;

  // Takes note of the pieces that the state names.
  void expect(const BodyState& state, std::uint64_t step);
  // Every piece that was expected up to this step is at hand.
  bool complete(std::uint64_t step) const;
  // Takes over the positions of the pieces up to this step, and the scalar fields that the state of this step names.
  void accept_pieces(std::uint64_t step, std::span<const std::string> scalars);
  // Every live vertex has a position that was sent at the revision of its slot's last change or later.
  bool placed() const { return waiting_ == 0; }

  // Copies topology only where frame.revision differs.
  void fill(BodyFrame& frame) const;

  // The memory of topology and positions, without the messages that wait.
  std::size_t bytes() const;

  // The memory of the messages that wait, to within a small factor.
  std::size_t waiting_bytes() const;

  std::size_t queued_deltas() const { return deltas_.size(); }
  std::size_t queued_pieces() const { return pieces_.size(); }

 private:
  enum class Slot : std::uint8_t { dead, waiting, placed };

  void adopt_keyframe(ReplicaCounts& counts);
  void apply_next(std::uint64_t most, ReplicaCounts& counts);
  void follow(const TopologyDelta& delta);
  void forget_old();
  void drop_superseded();
  void place(const StatePiece& piece);

  bool known_ = false;
  TriangleMesh mesh_;
  std::optional<TriangleMesh> keyframe_;  // newer than the mesh
  DeltaQueue deltas_;

  // One entry a vertex slot.
  std::vector<Vec3f> positions_world_m_;
  std::vector<std::uint64_t> changed_at_;  // revision of the slot's last change
  std::vector<Slot> slots_;
  std::uint32_t waiting_ = 0;

  ReplicaScalars scalars_;
  std::map<std::pair<std::uint32_t, std::uint64_t>, StatePiece> pieces_;  // not accepted yet, by piece and step
  std::size_t pieces_until_cleaning_ = kMaxPieces;
  std::map<std::uint32_t, std::uint64_t> accepted_;  // by piece: the newest step
  // By piece: the steps whose state named it, ascending; of those that have been accepted, the newest one.
  std::map<std::uint32_t, std::vector<std::uint64_t>> expected_;
};

}  // namespace sectio
