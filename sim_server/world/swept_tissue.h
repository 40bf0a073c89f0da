// The tissue that blades have cut in a body, in its shape at rest: what an edge has in front of itself there, and how
// much of what it passes is new. A cut is a way across the edge, straight or curved; it has rows along the edge, and
// each row the spans of the way that are cut. It does not depend on how finely the mesh is divided.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "sim_server/collision/surface_tree.h"

namespace sectio {

// The edge of a blade in the shape at rest, in the body's frame.
struct EdgeAtRest {
  Vec3 tip_m = Vec3::Zero(), heel_m = Vec3::Zero();

  Vec3 along() const { return (heel_m - tip_m).stableNormalized(); }
  Vec3 at(double share) const { return tip_m + share * (heel_m - tip_m); }
  EdgeAtRest moved(const Vec3& by_m) const { return {tip_m + by_m, heel_m + by_m}; }

  template <class A>
  void archive(A& a) {
    a(tip_m, heel_m);
  }
};

class SweptTissue {
 public:
  // The tissue is what the mesh holds at rest, now. Copies the mesh.
  explicit SweptTissue(const TriangleMesh& mesh);

  // The cut that an edge is in, and how far along. It changes as the edge goes on.
  struct Way {
    std::size_t cut = 0;
    double gone_m = 0;

    template <class A>
    void archive(A& a) {
      a(cut, gone_m);
    }
  };
  struct Front {
    double length_m = 0;  // the edge in tissue that has no cut ahead: at the end of a cut, or in uncut tissue
    bool in_tissue = false;
    double middle = 0;  // middle of the part of the edge in tissue, as a share of the edge
  };
  // `ahead`: the direction, unit and across the edge, in which it would cut.
  Front front(const EdgeAtRest& edge, const Vec3& ahead, std::optional<Way>& way);
  // The edge has cut its way from one place to another, which is near. Returns the area that is new.
  double sweep(const EdgeAtRest& from, const EdgeAtRest& to, const Vec3& ahead, std::optional<Way>& way);

  void archive(Archive& a);

 private:
  struct Span {
    double from, to;

    template <class A>
    void archive(A& a) {
      a(from, to);
    }
  };
  struct Cut {
    Vec3 up, first_heading;                      // unit: along the edge, and across it
    double level_m = 0;                          // the height, along `up`, at which the way is told
    std::vector<Vec3> points = {};               // points of the way, at height 0
    std::vector<double> gone_m = {};             // length of the way up to each point
    std::ptrdiff_t first_row = 0;                // number of the first row, counted from height 0
    std::vector<std::vector<Span>> rows = {{}};  // spans ascend and are apart

    std::vector<Span>& row(std::ptrdiff_t number);

    template <class A>
    void archive(A& a) {
      a(up, first_heading, level_m, points, gone_m, first_row, rows);
    }
  };
  struct Place {
    double gone_m = 0, beside_m = 0;
    Vec3 heading = Vec3::UnitX();
  };
  // An edge in a cut. At a height z its place on the way is gone_m + leans (z - level).
  struct Across {
    Place place;
    Vec3 at_m;  // on the way's level, at height 0
    double upright = 1, leans = 0;
  };

  std::vector<Span> inside(const EdgeAtRest& edge) const;  // in shares of the edge
  Across find(const EdgeAtRest& edge, const Vec3& ahead, std::optional<Way>& way);
  Way begin(const EdgeAtRest& edge, const Vec3& ahead, double cut_behind_m);
  static std::optional<Across> across(const Cut& cut, const EdgeAtRest& edge, std::optional<double> near_m);
  static Place place_on(const Cut& cut, const Vec3& at, double from_m, double to_m);
  static Vec3 heading_about(const Cut& cut, double gone_m);
  template <class Visit>
  static void each_row(const Cut& cut, const EdgeAtRest& edge, const std::vector<Span>& inside, const Visit& visit);

  TriangleMesh mesh_;
  std::vector<Vec4f> at_rest_;
  SurfaceTree tree_;
  std::vector<Cut> cuts_;
};

}  // namespace sectio
