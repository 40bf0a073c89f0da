// The place of a blade in a volume's shape at rest: a blade that goes through moving tissue cuts the same material,
// however that stretches, sags or springs.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "sim_server/surface/cutting/blade_place.h"
#include "sim_server/volume/front_settings.h"
#include "sim_server/volume/volume.h"

namespace sectio {

// The sharp edge of a blade, in the shape at rest.
struct BladeEdge {
  Vec3 tip_m = Vec3::Zero(), heel_m = Vec3::Zero();

  bool operator==(const BladeEdge&) const = default;
  Vec3 at(double share) const { return (1 - share) * tip_m + share * heel_m; }  // 0 at the tip, 1 at the heel
  BladeEdge up_to(double share) const { return {tip_m, at(share)}; }
  BladeEdge moved(const Vec3& by_m) const { return {tip_m + by_m, heel_m + by_m}; }
  Vec3 up() const { return (heel_m - tip_m).normalized(); }

  template <class A>
  void archive(A& a) {
    a(tip_m, heel_m);
  }
};

// The vector from the middle of an edge to that of another.
inline Vec3 forward_m(const BladeEdge& from, const BladeEdge& to) {
  return 0.5 * (to.tip_m + to.heel_m - from.tip_m - from.heel_m);
}

// A part of a slit, at rest.
struct SlitPlane {
  Vec3 on_m = Vec3::Zero(), normal = Vec3::UnitZ();

  double height_m(const Vec3& at_m) const { return normal.dot(at_m - on_m); }
  bool operator==(const SlitPlane&) const = default;
};
using SlitAt = std::function<std::optional<SlitPlane>(const Vec3& at_m)>;

// A volume in one step, and how blades cut it.
struct Tissue {
  const Volume& volume;
  const SharedBody& body;
  const FrontSettings& settings;

  double metres(double edges) const { return edges * volume.mean_edge_m; }
  TetVertexState state_of(VertexId v) const { return volume.state_of(body, v); }
};

inline Vec3 heel_world_m(const Blade& blade) {
  return blade.tip_world_m + blade.length_m * blade.up_world;
}

// Places along a blade, evenly from its tip to its heel. Their rest positions need not be collinear.
struct BladePlaces {
  static constexpr std::size_t kCount = 9;
  BladeEdge rigid;  // the tissue has moved, and kept its shape
  std::array<Vec3, kCount> home_m;
  std::array<double, kCount> weight;  // how much tissue is there; 0: none

  static double share(std::size_t k) { return static_cast<double>(k) / (kCount - 1); }  // 0 at the tip, 1 at the heel
  Vec3 rest_m(std::size_t k) const { return rigid.at(share(k)) + home_m[k]; }
  Vec3 rest_at(double share) const;
  // The closest straight edge.
  BladeEdge straight() const;
};

// The tissue around a blade: its vertices, and how they have moved.
class TissueAround {
 public:
  // `begin`: vertices near the blade, from which the search goes on; `otherwise_world`: the frame where there are too
  // few.
  TissueAround(const Tissue& tissue, const Blade& blade, const Pose& otherwise_world, std::vector<VertexId> begin);

  const std::vector<VertexId>& vertices() const { return vertices_; }  // `begin` when none is near
  const Pose& frame_world() const { return frame_world_; }             // mean frame of the rest shape
  // Each place along the edge is carried to rest by a smooth field of the displacement of the tissue there. A place
  // between the lips of a slit is in the slit, however far they gape and whichever of them is closer.
  // `slit_at`: the plane of a slit near a place at rest, if there is one.
  BladePlaces places_at_rest(const Blade& blade, const SlitAt& slit_at) const;
  // The straight edge closest to these places.
  BladeEdge at_rest(const Blade& blade) const {
    return places_at_rest(blade, [](const Vec3&) { return std::nullopt; }).straight();
  }
  // Is there tissue at this place at rest? Asked of the tetrahedra around the blade.
  bool has_tissue(const Vec3& rest_m) const;

 private:
  struct Moved {
    Vec3 at_m, home_m;  // in the frame: now, and from there to rest
  };
  struct Displacement {
    Vec3 home_m = Vec3::Zero();
    double weight = 0;  // weight of the tissue there
  };
  template <class Counts>
  Displacement displacement(const Vec3& at_m, const Counts& counts) const;
  // How far a place is from the plane of a slit: 0 between its lips, which may both be far from it.
  double height_m(const Vec3& at_m, const Vec3& rest_m, const SlitPlane& plane) const;
  void find_sides(const SlitPlane& plane) const;

  const TetTopology& topology_;
  double reach_m_;
  std::vector<VertexId> vertices_;
  std::vector<Moved> moved_;
  Pose frame_world_;
  mutable std::optional<SlitPlane> sides_of_;  // cache: which side of this plane the vertices' tetrahedra are on
  mutable std::vector<bool> above_;
};

}  // namespace sectio
