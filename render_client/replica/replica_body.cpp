#include "render_client/replica/replica_body.h"

#include <algorithm>

namespace sectio {

namespace {

std::size_t edits(const TopologyDelta& delta) {
  return delta.vertices.size() + delta.triangles.size();
}

// A state names a piece at most once a step, and a viewer looks several times a second.
constexpr std::size_t kMaxExpectedSteps = 64;

// Pieces for slots beyond those that the mesh has yet.
constexpr std::uint32_t kPiecesAhead = 64;

}  // namespace

void ReplicaBody::feed(TopologyDelta delta, ReplicaCounts& counts) {
  if (known_ && delta.base_revision < mesh_.revision()) return;
  const bool full = deltas_.size() >= kMaxQueuedDeltas || deltas_.edits() + edits(delta) > kMaxQueuedEdits;
  if (full) {  // a keyframe will bring more than these deltas could
    counts.deltas_dropped += deltas_.size() + 1;
    deltas_.clear();
    return;
  }
  deltas_.add(std::move(delta));
}

void ReplicaBody::feed(TriangleMesh keyframe, ReplicaCounts& counts) {
  if (known_ && keyframe.revision() <= mesh_.revision()) return;
  if (keyframe_ && keyframe.revision() <= keyframe_->revision()) return;
  keyframe_ = std::move(keyframe);
  if (!known_) adopt_keyframe(counts);
}

void ReplicaBody::feed(StatePiece piece) {
  const auto accepted = accepted_.find(piece.piece);
  if (accepted != accepted_.end() && piece.step <= accepted->second) return;
  if (pieces_.size() >= pieces_until_cleaning_) drop_superseded();
  if (pieces_.size() >= kMaxPieces) return;
  const std::pair key(piece.piece, piece.step);
  pieces_.emplace(key, std::move(piece));
}

void ReplicaBody::feed(ScalarPiece piece) {
  if (piece.piece < piece_count(mesh_.vertex_slots()) + kPiecesAhead) scalars_.feed(std::move(piece));
}

// Keeps the newest of each piece. Called at most once in kMaxPieces / 4 pieces.
void ReplicaBody::drop_superseded() {
  for (auto it = pieces_.begin(); it != pieces_.end();) {
    const auto next = std::next(it);
    it = next != pieces_.end() && next->first.first == it->first.first ? pieces_.erase(it) : next;
  }
  pieces_until_cleaning_ = std::max(kMaxPieces, pieces_.size() + kMaxPieces / 4);
}

bool ReplicaBody::can_reach(std::uint64_t revision) const {
  if (!known_) return false;
  return deltas_.links(mesh_.revision(), revision) || (keyframe_ && deltas_.links(keyframe_->revision(), revision));
}

bool ReplicaBody::advance(std::uint64_t revision, ReplicaCounts& counts) {
  if (!known_) return false;
  while (mesh_.revision() < revision) {
    const std::uint64_t before = mesh_.revision();
    if (!deltas_.links(before, revision) && keyframe_ && keyframe_->revision() <= revision)
      adopt_keyframe(counts);
    else
      apply_next(revision, counts);
    if (mesh_.revision() == before && !(keyframe_ && keyframe_->revision() <= revision)) return false;
  }
  return mesh_.revision() == revision;
}

void ReplicaBody::catch_up(ReplicaCounts& counts) {
  if (!known_) return;
  for (std::uint64_t before = mesh_.revision();; before = mesh_.revision()) {
    apply_next(~std::uint64_t{0}, counts);
    if (mesh_.revision() == before && keyframe_) adopt_keyframe(counts);
    if (mesh_.revision() == before) return;
  }
}

bool ReplicaBody::stuck() const {
  if (!known_) return true;
  return !deltas_.empty() && !keyframe_ && deltas_.next(mesh_.revision()) == nullptr;
}

void ReplicaBody::apply_next(std::uint64_t most, ReplicaCounts& counts) {
  const TopologyDelta* next = deltas_.next(mesh_.revision(), most);
  if (next == nullptr) return;
  const ApplyStatus status = apply(*next, mesh_);
  if (status == ApplyStatus::applied) {
    ++counts.deltas_applied;
    follow(*next);
    forget_old();
  } else {
    ++(status == ApplyStatus::hash_mismatch ? counts.hash_mismatches : counts.deltas_dropped);
    deltas_.forget(*next);
  }
}

void ReplicaBody::adopt_keyframe(ReplicaCounts& counts) {
  if (known_) ++counts.resyncs;
  known_ = true;
  mesh_ = std::move(*keyframe_);
  keyframe_.reset();
  // The slots that changed on the way here are unknown: all of them wait for positions of this revision.
  const std::uint32_t slots = mesh_.vertex_slots();
  positions_world_m_.resize(slots, Vec3f::Zero());
  changed_at_.assign(slots, mesh_.revision());
  slots_.assign(slots, Slot::dead);
  for (VertexId v = 0; v < slots; ++v)
    if (mesh_.vertex_alive(v)) slots_[v] = Slot::waiting;
  waiting_ = mesh_.vertex_count();
  accepted_.clear();
  forget_old();
}

void ReplicaBody::forget_old() {
  deltas_.forget_before(mesh_.revision());
  if (keyframe_ && keyframe_->revision() <= mesh_.revision()) keyframe_.reset();
}

// The vertices that the delta changed wait for positions of its revision.
void ReplicaBody::follow(const TopologyDelta& delta) {
  for (const VertexEdit& edit : delta.vertices)
    if (edit.id < slots_.size() && slots_[edit.id] == Slot::waiting) --waiting_;
  const std::uint32_t slots = mesh_.vertex_slots();
  positions_world_m_.resize(slots, Vec3f::Zero());
  changed_at_.resize(slots, delta.revision);
  slots_.resize(slots, Slot::dead);
  for (const VertexEdit& edit : delta.vertices) {
    if (edit.id >= slots) continue;
    changed_at_[edit.id] = delta.revision;
    slots_[edit.id] = edit.alive ? Slot::waiting : Slot::dead;
    if (edit.alive) ++waiting_;
  }
}

void ReplicaBody::expect(const BodyState& state, std::uint64_t step) {
  // A body without a topology waits for all of its pieces anyway.
  const std::uint32_t most = known_ ? piece_count(mesh_.vertex_slots()) + kPiecesAhead : 0;
  for (std::uint32_t p = 0; p < std::min(most, piece_count(state.vertex_slots)); ++p) {
    if (!state.sent(p)) continue;
    std::vector<std::uint64_t>& steps = expected_[p];
    const auto at = std::lower_bound(steps.begin(), steps.end(), step);
    if (at == steps.end() || *at != step) steps.insert(at, step);
    if (steps.size() > kMaxExpectedSteps) steps.erase(steps.begin());
  }
}

bool ReplicaBody::complete(std::uint64_t step) const {
  const std::uint32_t pieces = piece_count(mesh_.vertex_slots());
  for (const auto& [piece, steps] : expected_) {
    const auto after = std::upper_bound(steps.begin(), steps.end(), step);
    if (after == steps.begin() || piece >= pieces) continue;
    const std::uint64_t needed = *std::prev(after);
    const auto accepted = accepted_.find(piece);
    if (accepted != accepted_.end() && accepted->second >= needed) continue;
    const auto found = pieces_.lower_bound({piece, needed});
    if (found == pieces_.end() || found->first.first != piece || found->first.second > step) return false;
  }
  return true;
}

void ReplicaBody::accept_pieces(std::uint64_t step, std::span<const std::string> scalars) {
  scalars_.accept_pieces(mesh_.revision(), changed_at_, scalars);
  for (auto it = pieces_.begin(); it != pieces_.end();) {
    if (it->first.second > step) {
      ++it;
      continue;
    }
    const auto next = std::next(it);
    const bool superseded = next != pieces_.end() && next->first.first == it->first.first && next->first.second <= step;
    if (!superseded) {
      place(it->second);
      accepted_[it->first.first] = it->first.second;
    }
    it = pieces_.erase(it);
  }
  // Keeps the steps still to come and the newest one of the past.
  for (auto it = expected_.begin(); it != expected_.end();) {
    std::vector<std::uint64_t>& steps = it->second;
    const auto after = std::upper_bound(steps.begin(), steps.end(), step);
    const auto accepted = accepted_.find(it->first);
    const bool satisfied =
        after != steps.begin() && accepted != accepted_.end() && accepted->second >= *std::prev(after);
    if (after != steps.begin()) steps.erase(steps.begin(), satisfied ? after : std::prev(after));
    it = steps.empty() ? expected_.erase(it) : std::next(it);
  }
}

void ReplicaBody::place(const StatePiece& piece) {
  const std::uint32_t first = piece.piece * kVerticesPerPiece;
  for (std::uint32_t i = 0; i < piece.vertices() && first + i < slots_.size(); ++i) {
    const VertexId v = first + i;
    if (slots_[v] == Slot::dead || piece.revision < changed_at_[v]) continue;
    positions_world_m_[v] = piece.position_m(i);
    if (slots_[v] == Slot::waiting) {
      slots_[v] = Slot::placed;
      --waiting_;
    }
  }
}

void ReplicaBody::fill(BodyFrame& frame) const {
  if (frame.revision != mesh_.revision() || frame.triangles.size() != mesh_.triangle_slots() ||
      frame.rest_body_m.size() != mesh_.vertex_slots()) {
    frame.revision = mesh_.revision();
    frame.triangles.assign(mesh_.triangles().begin(), mesh_.triangles().end());
    frame.rest_body_m.resize(mesh_.vertex_slots());
    for (VertexId v = 0; v < mesh_.vertex_slots(); ++v) frame.rest_body_m[v] = mesh_.rest_body_m(v).cast<float>();
  }
  frame.positions_world_m = positions_world_m_;
  frame.scalars = scalars_.fields();
}

std::size_t ReplicaBody::waiting_bytes() const {
  constexpr std::size_t kDeltaBytes = sizeof(TopologyDelta) + 64;
  constexpr std::size_t kPieceBytes = sizeof(StatePiece) + 3 * 2 * kVerticesPerPiece + 64;
  return deltas_.size() * kDeltaBytes + deltas_.edits() * sizeof(VertexEdit) + pieces_.size() * kPieceBytes;
}

std::size_t ReplicaBody::bytes() const {
  return mesh_.bytes() + positions_world_m_.capacity() * sizeof(Vec3f) +
         changed_at_.capacity() * sizeof(std::uint64_t) + slots_.capacity() * sizeof(Slot);
}

}  // namespace sectio
