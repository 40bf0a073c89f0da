// Friction between two bodies that deform, which each move in a step of their own, remembers how far the two points of
// a contact have slid on each other since they stuck: a spring of this length holds them. Without a memory each would
// be stopped against where the other one went last; nothing would slow both down together, and they would never rest.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "common/math/types.h"
#include "common/mesh/triangle_mesh.h"

namespace sectio {

class StuckPoints {
 public:
  // Two bodies, the side of its vertex (0, 1), and the vertex. On the other side it lies on a triangle.
  using Contact = std::array<std::uint32_t, 4>;
  struct OnTriangle {
    std::array<VertexId, 3> v;
    Vec3 weights;

    template <class A>
    void archive(A& a) {
      a(v, weights);
    }
  };
  // The way from a place on the triangles of the other side to the vertex, now.
  using Way = std::function<Vec3(const OnTriangle& from)>;

  // The vertex is above `on`, and friction bears `most_m` along the surface between two points that stick. Returns how
  // far the vertex lies from where it stuck to the other side. Call in ascending order of contacts.
  Vec3 slide(const Contact& contact, const OnTriangle& on, const Way& way_world_m, const Vec3& normal_world,
             double most_m);
  // Contacts that no slide() has named since the last call are over.
  void end_step();

  template <class A>
  void archive(A& a) {
    a(stuck_);
  }

 private:
  struct Stuck {
    Contact contact;
    OnTriangle on;
    Vec3 way_world_m, apart_world_m;

    template <class A>
    void archive(A& a) {
      a(contact, on, way_world_m, apart_world_m);
    }
  };

  std::vector<Stuck> stuck_, next_;  // ascending
};

}  // namespace sectio
