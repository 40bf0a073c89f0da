#include "sim_server/volume/tets/sheet_shape.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/error.h"

namespace sectio {
namespace {

constexpr double kFar_m2 = 1;  // within_m2() of a side that a piece doesn't have
constexpr double kLeastSide_m = 1e-6;
constexpr double kAsNear = 1 + 1e-9;  // two pieces, of the squared distance: their common side is what is near

}  // namespace

SheetShape::SheetShape(const CutSheet& sheet) {
  const std::vector<Vec3>& outline = sheet.outline_rest_m;
  SECTIO_ASSERT(outline.size() >= 3, "a sheet has three corners");
  SECTIO_ASSERT(outline.size() == 4 || sheet.bends_rest_m.empty(), "a sheet with four corners may be bent");
  is_bent_ = !sheet.bends_rest_m.empty();
  std::vector<Vec3> piece = outline;
  for (const auto& [tip_m, heel_m] : sheet.bends_rest_m) {
    piece[2] = heel_m, piece[3] = tip_m;
    add(piece);
    piece[0] = tip_m, piece[1] = heel_m, piece[2] = outline[2], piece[3] = outline[3];
  }
  add(std::move(piece));
}

void SheetShape::add(std::vector<Vec3> outline) {
  Piece piece;
  for (std::size_t i = 2; i < outline.size(); ++i)
    piece.normal += (outline[i - 1] - outline[0]).cross(outline[i] - outline[0]);
  // A blade that turns about its tip, or its heel, sweeps a fan, whose corners say less than its middle.
  const auto middle = [&](std::size_t i, std::size_t j) { return Vec3(0.5 * (outline[i] + outline[j])); };
  if (is_bent_) piece.normal = (middle(1, 2) - middle(0, 3)).cross(middle(2, 3) - middle(0, 1));
  const double area = piece.normal.norm();
  has_area_ &= area > 0;
  if (area > 0) piece.normal /= area;
  for (const Vec3& p : outline) piece.centre += p / static_cast<double>(outline.size());
  if (outline.size() == 4 && area > 0) piece.twist_m = piece.normal.dot(outline[0] - piece.centre);
  piece.outline = std::move(outline);
  pieces_.push_back(std::move(piece));
}

// A point on the sheet counts as above it (simulation of simplicity).
double SheetShape::height_m(const Vec3& p) const {
  const double h = pieces_[nearest_piece(p)].height_m(p);
  return h == 0 ? 1e-300 : h;
}

double SheetShape::Piece::height_m(const Vec3& p) const {
  return normal.dot(p - centre) - (twist_m == 0 ? 0 : twist_m * twist_at(p));
}

// Four corners that aren't in one plane span a ruled surface, which is as high over the mean plane at two opposite
// corners as it is below it at the others. From -1 to 1; beyond the outline as at its sides.
double SheetShape::Piece::twist_at(const Vec3& p) const {
  const Vec3 begin = 0.5 * (outline[0] + outline[3]), along = 0.5 * (outline[1] + outline[2]) - begin;
  const double v = std::clamp(along.dot(p - begin) / along.squaredNorm(), 0.0, 1.0);
  const Vec3 from = outline[0] + v * (outline[1] - outline[0]);
  const Vec3 across = outline[3] + v * (outline[2] - outline[3]) - from;
  const double across_m2 = across.squaredNorm();
  const double u = across_m2 > 0 ? std::clamp(across.dot(p - from) / across_m2, 0.0, 1.0) : 0.5;
  return (1 - 2 * u) * (1 - 2 * v);
}

double SheetShape::Piece::between_m(std::size_t side, const Vec3& p) const {
  const Vec3 tip = outline[3] - outline[0], heel = outline[2] - outline[1], begin = 0.5 * (outline[0] + outline[1]);
  const Vec3 along = 0.5 * (tip + heel);
  const double u = std::clamp(along.dot(p - begin) / along.squaredNorm(), 0.0, 1.0);
  const Vec3 from = outline[0] + u * tip, to = outline[1] + u * heel, up = (to - from).stableNormalized();
  return side == 3 ? up.dot(p - from) : up.dot(to - p);
}

double SheetShape::Piece::after_m(const Vec3& p) const {
  return (outline[3] - outline[2]).cross(normal).stableNormalized().dot(p - outline[2]);
}
double SheetShape::Piece::before_m(const Vec3& p) const {
  return (outline[1] - outline[0]).cross(normal).stableNormalized().dot(p - outline[0]);
}

// Beside a bend the closest place of two pieces may be their common side; the one whose plane is further away says on
// which side of the sheet a point is.
std::size_t SheetShape::nearest_piece(const Vec3& p) const {
  if (pieces_.size() == 1) return 0;
  std::size_t nearest = 0;
  double least_m2 = 0, its_height_m = 0;
  for (std::size_t k = 0; k < pieces_.size(); ++k) {
    const double height_m = std::abs(pieces_[k].height_m(p));
    const double beyond_m = this->beyond_m(k, p);
    const double m2 = height_m * height_m + beyond_m * beyond_m;
    if (k > 0 && m2 * kAsNear > least_m2 && !(m2 < least_m2 * kAsNear && height_m > its_height_m)) continue;
    nearest = k, least_m2 = m2, its_height_m = height_m;
  }
  return nearest;
}

double SheetShape::beyond_m(std::size_t piece, const Vec3& p) const {
  const double before_m = piece > 0 ? pieces_[piece].before_m(p) : 0;
  const double after_m = piece + 1 < pieces_.size() ? pieces_[piece].after_m(p) : 0;
  return std::max({0.0, before_m, after_m});
}

bool SheetShape::is_beyond_all(const Vec3& p) const {
  const std::size_t k = nearest_piece(p);
  const std::vector<Vec3>& outline = pieces_[k].outline;
  return beyond_m(k, p) > 0.5 * (outline[2] + outline[3] - outline[0] - outline[1]).norm();
}

double SheetShape::within_m2(std::size_t side, const Vec3& p) const {
  const std::size_t k = nearest_piece(p);
  if (is_bend(k, side)) return kFar_m2;
  const Piece& piece = pieces_[k];
  if (is_bent_ && side % 2 == 1) return piece.between_m(side, p) * side_m(side, p);
  const Vec3& a = piece.outline[side];
  return (piece.outline[(side + 1) % piece.outline.size()] - a).cross(p - a).dot(piece.normal);
}

double SheetShape::side_m(std::size_t side, const Vec3& p) const {
  const std::vector<Vec3>& outline = pieces_[nearest_piece(p)].outline;
  const double m = (outline[(side + 1) % outline.size()] - outline[side]).norm();
  return is_bent_ ? std::max(m, kLeastSide_m) : m;
}

}  // namespace sectio
