// The shape of a sheet along which a volume is cut: heights over it, and its sides.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/mesh/tet_mesh.h"

namespace sectio {

// A convex piece of the surface swept by a blade, at rest: its corners in cyclic order, three or more. Four need not be
// in one plane: the sheet is ruled from the side between the first two to the opposite one.
//
//      1 ------ heel ------ . ------- 2       A blade that has turned has swept several such pieces. Each begins with
//      |        .           .         |       the side with which the one before ends; the sheet has the outline of
//    begin    bend        bend       end      all of them.
//      |        .           .         |
//      0 ------ tip ------- . ------- 3
struct CutSheet {
  std::vector<Vec3> outline_rest_m;
  // Vertices of the cut that this sheet continues; they count as on the sheet, wherever they are.
  std::vector<VertexId> joined = {};
  // Bit i stands for the side of the outline from corner i to the next. `exact`: at these sides the cut ends exactly,
  // inside elements; at the others it ends with the last edges that the sheet crosses. `lasting`: of the exact sides,
  // those whose elements will remain; there the cut ends within a quarter of an edge, for the quality of the elements.
  // `goes_on`: of the others, those beyond which another sheet may go on.
  std::uint32_t exact = 0, lasting = 0, goes_on = 0;
  // Tip and heel where a sheet with four corners is bent, from its first side to the opposite one.
  std::vector<std::array<Vec3, 2>> bends_rest_m = {};
};

class SheetShape {
 public:
  explicit SheetShape(const CutSheet& sheet);

  bool has_area() const { return has_area_; }
  std::size_t side_count() const { return pieces_.front().outline.size(); }
  // Signed distance, positive where the corners are seen counterclockwise; never 0.
  double height_m(const Vec3& p) const;
  // Distance inside a side of the outline, times the side's length: m2.
  double within_m2(std::size_t side, const Vec3& p) const;
  double side_m(std::size_t side, const Vec3& p) const;  // the length of that side near a point
  template <class Counts>
  bool inside(const Vec3& p, const Counts& counts) const {
    if (is_bent_ && is_beyond_all(p)) return false;
    for (std::size_t side = 0; side < side_count(); ++side)
      if (counts(side) && within_m2(side, p) < 0) return false;
    return true;
  }
  std::size_t nearest_piece(const Vec3& p) const;

 private:
  struct Piece {
    std::vector<Vec3> outline;
    Vec3 normal = Vec3::Zero(), centre = Vec3::Zero();
    double twist_m = 0;  // how far the corners are from the mean plane

    double height_m(const Vec3& p) const;
    double twist_at(const Vec3& p) const;
    // How far a point is inside the paths of tip or heel.
    double between_m(std::size_t side, const Vec3& p) const;
    // How far a point is beyond the piece's end, or before its beginning.
    double after_m(const Vec3& p) const;
    double before_m(const Vec3& p) const;
  };
  void add(std::vector<Vec3> outline);
  // How far a point is beyond the ends of a piece that are bends.
  double beyond_m(std::size_t piece, const Vec3& p) const;
  // Far from the nearest piece, in its plane: where a blade has turned sharply, planes of pieces meet elsewhere, too.
  bool is_beyond_all(const Vec3& p) const;
  // Another piece begins or ends with this side of a piece.
  bool is_bend(std::size_t piece, std::size_t side) const {
    return (side == 0 && piece > 0) || (side == 2 && piece + 1 < pieces_.size());
  }

  std::vector<Piece> pieces_;
  bool is_bent_ = false, has_area_ = true;
};

}  // namespace sectio
