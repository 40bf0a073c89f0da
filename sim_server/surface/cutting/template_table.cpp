#include "sim_server/surface/cutting/template_table.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/core/error.h"

namespace sectio {
namespace {

using enum AngleClass;
using Sub = Subdivision;
using Under = Substructure;

// Skin as seen from above (A, B, C: the face; e, f: active edges; = : the incision; P, T: ends of the path),
// substructure from the side (lower case: bottoms).
constexpr std::array kTemplates{
    // slit, 1 -> 7: both ends in the face, one pair m- m+ between them
    //
    //            A                  through: no vertex inside, the walls end on the other side
    //          / | \                one inside:  P--m--T    two inside:  P--m--T
    //        /   m+  \                            \ | /                  | / \ |
    //      /  P =  = T \                            g                    g-----g
    //    / /     m-    \ \      each wall 2 triangles, 4 in all      each wall 3, 6 in all
    //   B-----------------C
    CutTemplate{normal, 0, 0, 0, "14", Sub::slit, Under::none, 7, 4, 0, 0},
    CutTemplate{normal, 0, 1, 1, "14 left", Sub::slit, Under::cone, 7, 4, 4, 0},
    CutTemplate{normal, 0, 2, 2, "14 right", Sub::slit, Under::cone, 7, 4, 6, 0},

    // end, 1 -> 4: the pair e- e+ on the active edge B C, the tip T in the face; e- e+ T is the incision
    //
    //            A              tip not inside:  e---T     tip inside:  e-----T
    //          / | \                             |  /                   |   / |
    //        /   T   \                           | /                    | /   |
    //      / /  / \  \ \                         b                      b-----g
    //     B----e-  e+----C      walls 1 + 1, bottom 1              walls 2 + 2, bottom 1
    CutTemplate{normal, 1, 0, 0, "10 left", Sub::end, Under::taper, 4, 3, 3, 1},
    CutTemplate{normal, 1, 1, 2, "10 left", Sub::end, Under::wedge, 4, 3, 5, 1},

    // midway, 1 -> 3: in over A B, out over A C; A above and the rest below are not connected any more
    //
    //            A                      e-----f
    //          /   \                    |   / |
    //        e+-----f+                  | /   |
    //       e-======f-                  b-----b
    //      /     _ / \          walls 2 + 2, bottom 2: the U
    //     B-----------C
    CutTemplate{normal, 2, 0, 2, "10 right", Sub::midway, Under::u_shape, 3, 4, 6, 2},

    // 90 degrees. A slit has no neighbour that could be adjusted, so it has its own substructure, as above.
    CutTemplate{right_angle, 0, 0, 0, "14", Sub::slit, Under::none, 7, 4, 0, 0},
    CutTemplate{right_angle, 0, 1, 1, "14 left", Sub::slit, Under::cone, 7, 4, 4, 0},
    CutTemplate{right_angle, 0, 2, 2, "14 right", Sub::slit, Under::cone, 7, 4, 6, 0},
    // Front face below, its neighbour's U above and behind it: the U ends on the incision instead of on bottoms.
    //
    //     ----e-  e+----        wall of the neighbour:   f-----e   f, b: its other end
    //         \  /                                       |   / |
    //          T                                         b --- T
    CutTemplate{right_angle, 1, 0, 2, "11 left", Sub::end, Under::none, 4, 3, 0, 0},
    //     ----e-  e+----                                 f-----e
    //         |    |                                     | \ / |
    //         d-  d+                                     | / \ d
    //          \  /                                      b --- T
    CutTemplate{right_angle, 2, 0, 2, "11 right", Sub::midway, Under::none, 3, 4, 0, 0},

    // Beyond 90 degrees: the underside u; the walls that come down from the upper side t end on its vertices, none of
    // them above or below it.
    //
    //     t-----t-----T
    //     | \   |   / |
    //     |   \ | /   |
    //     u-----u-----U
    CutTemplate{beyond, 0, 0, 2, "13", Sub::slit, Under::none, 7, 4, 0, 0},
    CutTemplate{beyond, 1, 0, 2, "13", Sub::end, Under::none, 4, 3, 0, 0},
    CutTemplate{beyond, 2, 0, 2, "13", Sub::midway, Under::none, 3, 4, 0, 0},
};

}  // namespace

AngleClass angle_class(const Vec3& up_body, const Vec3& face_normal_body, double tolerance_rad) {
  const double cosine = up_body.stableNormalized().dot(face_normal_body.stableNormalized());
  const double least = std::sin(tolerance_rad);
  return cosine > least ? normal : cosine < -least ? beyond : right_angle;
}

std::span<const CutTemplate> cut_templates() {
  return kTemplates;
}

const CutTemplate& template_for(AngleClass angle, int active_edges, int vertices_inside) {
  const auto it = std::find_if(kTemplates.begin(), kTemplates.end(), [&](const CutTemplate& t) {
    return t.angle == angle && t.active_edges == active_edges && t.least_inside <= vertices_inside &&
           vertices_inside <= t.most_inside;
  });
  SECTIO_ASSERT(it != kTemplates.end(), "a template for every active face");
  return *it;
}

}  // namespace sectio
