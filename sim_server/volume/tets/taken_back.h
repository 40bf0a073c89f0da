// A volume as it is before temporary operations are taken back and others take their place: what the motion is in it,
// so that tissue that stays where it is keeps its state, whatever elements it is in. The displacement and velocity of a
// piece are linear; each tetrahedron of the settled volume has its own pieces, those before and those after.
#pragma once

#include <unordered_map>

#include "sim_server/volume/tets/tet_topology.h"

namespace sectio {

class TakenBack {
 public:
  // Takes back all operations. What stays behind is what TetTopology::undo_to() says.
  explicit TakenBack(TetTopology& volume);

  // There were none: operations since are all there are.
  bool empty() const { return steps_.empty(); }
  // The vertices that have their state from what was before, now that other operations are done. O(both).
  std::vector<VertexId> give_states(TetTopology& volume) const;
  // From what was before to now, without origins; and with them, pieces that were there before. O(both).
  TetChange change(const TetTopology& volume) const { return between(before_, volume.change()); }
  void find_origins(const TetTopology& volume, TetChange& change) const;
  // Operations since are taken back, and these are done again.
  void restore(TetTopology& volume) const;

 private:
  struct Piece {
    std::uint32_t id = kNone;
    std::array<const TetVertexState*, 4> corner{};
  };
  static Vec3 middle(const TetTopology& volume, std::uint32_t t);
  static std::array<double, 4> weights(const Piece& piece, const Vec3& rest_body_m);
  std::vector<Piece> pieces_of(std::uint32_t origin) const;
  TetVertexState state_at(const std::vector<Piece>& pieces, const Vec3& rest_body_m, const Vec3& within_body_m) const;

  TetChange before_;
  std::vector<TetStep> steps_;
  std::unordered_map<VertexId, TetVertexState> corner_;                      // asked, never walked
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> pieces_of_;  // by settled tetrahedron; asked
};

}  // namespace sectio
