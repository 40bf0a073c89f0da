// Takes a volume's temporary front back in a draft, in which a plan is made then.
//
// The rollback remembers the motion of the tissue with the front, so that tissue that stays where it is keeps its
// state, whatever elements it is in afterwards. Displacement and velocity are linear in each piece of a tetrahedron
// that the front has divided.
#pragma once

#include <utility>
#include <vector>

#include "common/core/number_table.h"
#include "sim_server/volume/tets/tet_topology.h"

namespace sectio {

class FrontRollback {
 public:
  // `front` leads to the draft as it is; nullptr: there is no front. Both outlive this.
  FrontRollback(TetTopology& draft, const TetDelta* front);
  FrontRollback(const FrontRollback&) = delete;
  FrontRollback& operator=(const FrontRollback&) = delete;

  // There was no front: the operations since are all that changes.
  bool empty() const { return before_.tetrahedra.empty(); }
  // Gives vertices the state that the tissue had there with the front, now that other operations are done. Returns the
  // vertices whose state is not that of the body any more. O(front + operations).
  std::vector<VertexId> give_states();
  // The change from the volume with the front to the volume as it is now. Origins are tetrahedra without the front,
  // until find_origins() makes them those with it. O(front + operations).
  TetChange change() const { return between(before_, draft_.change()); }
  void find_origins(TetChange& change) const;

 private:
  struct Piece {
    std::uint32_t id = kNone;
    std::array<const TetVertexState*, 4> corner{};
  };
  Vec3 middle(std::uint32_t t) const;
  static std::array<double, 4> weights(const Piece& piece, const Vec3& rest_body_m);
  std::vector<Piece> pieces_of(std::uint32_t origin) const;
  TetVertexState state_at(const std::vector<Piece>& pieces, const Vec3& rest_body_m, const Vec3& within_body_m) const;

  TetTopology& draft_;
  const TetDelta* front_;
  TetChange before_;                                               // change by the front
  NumberTable<TetVertexState> corner_;                             // by vertex
  std::vector<std::pair<std::uint32_t, std::uint32_t>> piece_of_;  // tetrahedron without the front, place; ascending
};

}  // namespace sectio
