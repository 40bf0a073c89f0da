// The lips of a cut don't pass through each other (paper A, 2.3: concave results).
//
// The two walls of a cut coincided while the tissue was whole. Each vertex of a wall therefore keeps the few triangles
// of the opposite wall that are nearest to it at rest, and the one to which it has slid. After each step of deformation
// only these triangles are asked whether the vertex is behind them.
//
//     skin ____v  |____        v behind T by more than at rest: v and T's corners are pushed apart
//               \ |T           along T's normal, by impulses that keep momentum
//                \|
//
// Cost: O(wall vertices) a step with a small constant. Opposite triangles are searched for by their places at rest, at
// most kSearches a step: first where a cut has changed the walls, then in rounds over all vertices.
#pragma once

#include <array>
#include <deque>
#include <map>
#include <vector>

#include "sim_server/body_contact/body_contact.h"
#include "sim_server/body_contact/walls_at_rest.h"
#include "sim_server/engine/engine.h"

namespace sectio {

class LipFinder {
 public:
  static constexpr int kSearches = 3;

  // Takes the vertices around which the topology has changed.
  void follow(const TriangleMesh& mesh, std::span<const VertexId> changed);
  // Call once a step of step_s, after deformation: appends the contacts of wall vertices with opposite triangles, in
  // which the body has number 0.
  void find(const SharedBody& body, double step_s, std::vector<BodyContact>& contacts);

  template <class A>
  void archive(A& a) {
    a(lips_, walls_, waiting_, next_, seen_, round_);
  }

 private:
  static constexpr std::size_t kOpposite = 6;
  struct Lip {
    std::array<TriangleId, kOpposite> opposite;
    bool waits = false;      // the vertex waits for a search
    std::uint8_t pause = 0;  // steps until it is looked at again: it was far from the other lip

    template <class A>
    void archive(A& a) {
      a(opposite, waits, pause);
    }
  };

  // The nearest opposite triangle, which a vertex is over or under; kNone: none is near.
  struct Opposite {
    TriangleId triangle = kNone;
    Vec3 bary = Vec3::Zero(), away_m = Vec3::Zero(), facing = Vec3::Zero();
  };

  void search(const SharedBody& body);
  void search_opposite(const SharedBody& body, VertexId v, Lip& lip);
  static Opposite nearest_opposite(const SharedBody& body, VertexId v, const Lip& lip);
  static void slide(const SharedBody& body, VertexId v, const Opposite& on, Lip& lip);
  static void find_contact(const SharedBody& body, VertexId v, Lip& lip, double step_s,
                           std::vector<BodyContact>& contacts);

  static constexpr double kAside_m = 0.003;  // sideways distance that lips may have slid

  std::map<VertexId, Lip> lips_;
  WallsAtRest walls_{kAside_m};
  std::deque<VertexId> waiting_;
  VertexId next_ = 0;  // next vertex of the round

  // Scratch.
  std::vector<std::uint32_t> seen_;  // by triangle: the search that saw it last
  std::uint32_t round_ = 0;
};

}  // namespace sectio
