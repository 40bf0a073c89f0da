// The replica of one body: its topology, and where its vertices are. See replica.h for the rules.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/delta/keyframe.h"
#include "common/messages/state.h"
#include "render_client/replica/frame.h"

namespace sectio {

struct ReplicaCounts {
  std::uint64_t deltas_applied = 0;
  std::uint64_t deltas_dropped = 0;  // malformed, of another history, or no room to keep them
  std::uint64_t hash_mismatches = 0;
  std::uint64_t resyncs = 0;  // keyframes that replaced a mesh; the first one of a body is none
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

  // True when the mesh is at that revision, or deltas and keyframe at hand lead to it.
  bool can_reach(std::uint64_t revision) const;
  // Goes there, or as far as it can; true when it arrived. Never goes beyond.
  bool advance(std::uint64_t revision, ReplicaCounts& counts);
  // As far as deltas and keyframe at hand lead.
  void catch_up(ReplicaCounts& counts);
  // Nothing at hand leads on from the mesh, though there is more: a delta is missing.
  bool stuck() const;

  // A state names its pieces: they are expected from then on.
  void expect(const BodyState& state, std::uint64_t step);
  // Every piece that was expected up to this step is at hand.
  bool complete(std::uint64_t step) const;
  // Takes over the positions of the pieces up to this step.
  void settle(std::uint64_t step);
  // Every live vertex has a position that was sent at the revision of its slot's last change or later.
  bool placed() const { return waiting_ == 0; }

  // Copies topology only where frame.revision differs.
  void fill(BodyFrame& frame) const;

  // Of topology and state, without what waits.
  std::size_t bytes() const;

  std::size_t queued_deltas() const { return deltas_.size(); }
  std::size_t queued_pieces() const { return pieces_.size(); }

 private:
  enum class Slot : std::uint8_t { dead, waiting, placed };

  bool linked(std::uint64_t from, std::uint64_t to) const;
  void adopt_keyframe(ReplicaCounts& counts);
  void apply_next(ReplicaCounts& counts);
  void follow(const TopologyDelta& delta);
  void forget_old();
  void drop_superseded();
  void place(const StatePiece& piece);

  bool known_ = false;
  TriangleMesh mesh_;
  std::optional<TriangleMesh> keyframe_;           // newer than the mesh
  std::map<std::uint64_t, TopologyDelta> deltas_;  // by revision
  std::size_t queued_edits_ = 0;

  // One entry a vertex slot.
  std::vector<Vec3f> positions_world_m_;
  std::vector<std::uint64_t> changed_at_;  // revision of the slot's last change
  std::vector<Slot> slots_;
  std::uint32_t waiting_ = 0;

  std::map<std::pair<std::uint32_t, std::uint64_t>, StatePiece> pieces_;  // by piece and step; not settled yet
  std::size_t pieces_until_cleaning_ = kMaxPieces;
  std::map<std::uint32_t, std::uint64_t> settled_;  // newest step of a piece
  // By piece: steps whose state named it, ascending; those before the last settled one are reduced to the newest.
  std::map<std::uint32_t, std::vector<std::uint64_t>> expected_;
};

}  // namespace sectio
