// The step of a volume from one topology to another, as a value. Applied it gives the volume after it to the bit, the
// order of stars included; its inverse gives the volume before it. See TetTopology::take_back().
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/mesh/tet_mesh.h"

namespace sectio {

struct TetDelta {
  struct Vertex {
    Vec3 rest_body_m = Vec3::Zero();
    // Made from: the ends of the edge that it divides, or the vertex whose twin it is, twice.
    std::array<VertexId, 2> from{kNone, kNone};

    template <class A>
    void archive(A& a) {
      a(rest_body_m, from);
    }
  };
  // A vertex that has a twin after the delta, in the order in which twins join it when the delta is undone. The vertex
  // goes to the centre of mass of both.
  struct Join {
    VertexId v = kNone, twin = kNone;
    double twin_share = 0;  // share of the mass of both

    template <class A>
    void archive(A& a) {
      a(v, twin, twin_share);
    }
  };
  // Lists of tetrahedra, one after the other.
  class Stars {
   public:
    void add(std::span<const std::uint32_t> star) {
      tetrahedra_.insert(tetrahedra_.end(), star.begin(), star.end());
      end_.push_back(static_cast<std::uint32_t>(tetrahedra_.size()));
    }
    std::span<const std::uint32_t> operator[](std::size_t k) const {
      const std::size_t begin = k == 0 ? 0 : end_[k - 1];
      return std::span(tetrahedra_).subspan(begin, end_[k] - begin);
    }

    template <class A>
    void archive(A& a) {
      a(tetrahedra_, end_);
    }

   private:
    std::vector<std::uint32_t> tetrahedra_, end_;
  };

  std::size_t vertices_before = 0;  // without those that are removed: these have the next numbers, as have the added
  std::vector<Vertex> removed, added;
  std::size_t tetrahedra_before = 0, tetrahedra_after = 0;
  std::vector<TetEdit> tetrahedra;  // ascending; as in TetChange, those included of which only a neighbour changes
  std::vector<VertexId> stars_of;   // the corners of these, ascending
  Stars stars_before, stars_after;  // by place in `stars_of`
  std::vector<Join> joins;          // only if the delta adds vertices

  bool empty() const { return tetrahedra.empty(); }

  template <class A>
  void archive(A& a) {
    a(vertices_before, removed, added, tetrahedra_before, tetrahedra_after, tetrahedra, stars_of, stars_before,
      stars_after, joins);
  }
};

TetDelta inverse(TetDelta delta);

// The same change, for data kept beside the volume.
TetChange change_of(const TetDelta& delta);

class TetTopology;
// The volume must be as the delta expects it, without operations that could be undone.
void apply(const TetDelta& delta, TetTopology& volume);

}  // namespace sectio
