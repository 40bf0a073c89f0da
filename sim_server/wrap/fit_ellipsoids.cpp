#include "sim_server/wrap/fit_ellipsoids.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/core/error.h"
#include "common/math/intersect.h"
#include "sim_server/wrap/surface_field.h"
#include "sim_server/wrap/wrap.h"

namespace sectio {
namespace {

constexpr double kGoodOverlap = 0.95;
constexpr double kLeastGain = 0.01;       // in overlap, for more ellipsoids
constexpr double kPointsAcross = 40;      // the longest side of the surface's box
constexpr std::size_t kLeastPoints = 24;  // a group that is divided has so many

struct Group {
  std::vector<std::uint32_t> points;
  Ellipsoid ellipsoid;
  double missed = 0;  // points that its ellipsoid leaves out
};

class Fit {
 public:
  explicit Fit(const TriangleSoup& given) {
    const TriangleSoup turned = turned_outward(given);
    for (const Vec3& p : turned.vertices_body_m) box_.extend(p);
    if (turned.triangles.empty()) throw InputError("there is nothing to fit");
    cell_m_ = box_.sizes().maxCoeff() / kPointsAcross;
    const SurfaceField field(turned);
    for (double z = box_.min().z() + 0.5 * cell_m_; z < box_.max().z(); z += cell_m_)
      for (double y = box_.min().y() + 0.5 * cell_m_; y < box_.max().y(); y += cell_m_)
        for (double x = box_.min().x() + 0.5 * cell_m_; x < box_.max().x(); x += cell_m_)
          if (const Vec3 p(x, y, z); field.winding(p) > 0.5) inside_.push_back(p);
    if (inside_.size() < kLeastPoints) throw InputError("it encloses nothing, or next to nothing");
  }

  EllipsoidFit run(std::size_t most) {
    Group all;
    for (std::uint32_t i = 0; i < inside_.size(); ++i) all.points.push_back(i);
    describe(all);
    groups_ = {all};
    EllipsoidFit fit;
    do {  // dividing what is round makes it worse at first
      const double overlap = this->overlap();
      if (overlap < fit.overlap + kLeastGain) continue;
      fit.overlap = overlap;
      fit.ellipsoids.clear();
      for (const Group& group : groups_) fit.ellipsoids.push_back(group.ellipsoid);
    } while (fit.overlap < kGoodOverlap && groups_.size() < most && divide_worst());
    fit.volume_m3 = static_cast<double>(inside_.size()) * std::pow(cell_m_, 3);
    return fit;
  }

 private:
  static bool holds(const Ellipsoid& e, const Vec3& p) {
    return (e.orientation.conjugate() * (p - e.centre_m)).cwiseQuotient(e.radii_m).squaredNorm() <= 1;
  }

  // The second moment of an ellipsoid along an axis is a fifth of the radius squared.
  void describe(Group& group) const {
    const auto count = static_cast<double>(group.points.size());
    Vec3 mean = Vec3::Zero();
    for (const std::uint32_t i : group.points) mean += inside_[i] / count;
    Mat3 moments = Mat3::Identity() * (cell_m_ * cell_m_ / 12);  // a point's own cell
    for (const std::uint32_t i : group.points) {
      const Vec3 d = inside_[i] - mean;
      moments += d * d.transpose() / count;
    }
    const Eigen::SelfAdjointEigenSolver<Mat3> axes(moments);
    Mat3 rotation = axes.eigenvectors();
    if (rotation.determinant() < 0) rotation.col(0) *= -1;
    group.ellipsoid = {mean, (5 * axes.eigenvalues()).cwiseSqrt(), Eigen::Quaterniond(rotation)};
    group.missed = static_cast<double>(
        std::ranges::count_if(group.points, [&](std::uint32_t i) { return !holds(group.ellipsoid, inside_[i]); }));
  }

  // The volume of the union is sampled on the same grid, with its margin.
  double overlap() const {
    std::size_t common = 0, in_union = 0;
    const auto in_any = [&](const Vec3& p) {
      return std::ranges::any_of(groups_, [&](const Group& g) { return holds(g.ellipsoid, p); });
    };
    for (const Vec3& p : inside_) common += in_any(p);
    const Vec3 margin = 0.25 * box_.sizes();
    const auto steps = [&](int k) { return static_cast<int>(std::ceil(margin[k] / cell_m_)); };
    const Vec3 low = box_.min() + 0.5 * cell_m_ * Vec3::Ones(), high = box_.max() + margin;
    for (double z = low.z() - steps(2) * cell_m_; z < high.z(); z += cell_m_)
      for (double y = low.y() - steps(1) * cell_m_; y < high.y(); y += cell_m_)
        for (double x = low.x() - steps(0) * cell_m_; x < high.x(); x += cell_m_) in_union += in_any(Vec3(x, y, z));
    return 2.0 * static_cast<double>(common) / static_cast<double>(inside_.size() + in_union);
  }

  // Across its longest axis, through its middle.
  bool divide_worst() {
    const auto worst = std::ranges::max_element(groups_, {}, &Group::missed);
    const Vec3 axis = worst->ellipsoid.orientation * Vec3::UnitZ();  // eigenvalues come in rising order
    Group low, high;
    for (const std::uint32_t i : worst->points)
      ((inside_[i] - worst->ellipsoid.centre_m).dot(axis) < 0 ? low : high).points.push_back(i);
    if (std::min(low.points.size(), high.points.size()) < kLeastPoints) return false;
    describe(low);
    describe(high);
    *worst = std::move(low);
    groups_.push_back(std::move(high));
    return true;
  }

  Box3 box_;
  double cell_m_ = 0;
  std::vector<Vec3> inside_;
  std::vector<Group> groups_;
};

}  // namespace

EllipsoidFit fit_ellipsoids(const TriangleSoup& given, std::size_t most) {
  return Fit(given).run(most);
}

}  // namespace sectio
