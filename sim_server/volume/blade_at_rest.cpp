#include "sim_server/volume/blade_at_rest.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/math/intersect.h"
#include "sim_server/deformation/shape_matching.h"

namespace sectio {
namespace {

constexpr double kSmooth = 0.05;  // weight of no gradient: where the tissue says little, its displacement is constant

// From a vertex to the one that is closest to the blade, from neighbour to neighbour.
VertexId closest_to(const Tissue& tissue, const Blade& blade, VertexId from) {
  const TetTopology& topology = tissue.volume.topology;
  const auto distance_m = [&](VertexId v) {
    return distance_to_segment(tissue.state_of(v).position_world_m, blade.tip_world_m, heel_world_m(blade));
  };
  double least_m = distance_m(from);
  for (VertexId before = kNone; before != from;) {
    before = from;
    for (const std::uint32_t t : topology.star(before))
      for (const VertexId v : topology.tetrahedra()[t])
        if (const double m = distance_m(v); m < least_m) {
          least_m = m;
          from = v;
        }
  }
  return from;
}

}  // namespace

TissueAround::TissueAround(const Tissue& tissue, const Blade& blade, const Pose& otherwise_world,
                           std::vector<VertexId> begin)
    : topology_(tissue.volume.topology), reach_m_(tissue.volume.mean_edge_m), frame_world_(otherwise_world) {
  const double around_m = tissue.metres(tissue.settings.around_edges);
  const Vec3 heel_m = heel_world_m(blade);
  tissue.volume.visited.begin(topology_.vertex_count());
  std::vector<MatchedPoint> around;
  const auto visit = [&](VertexId v) {
    if (!tissue.volume.visited.insert(v)) return;
    const TetVertexState state = tissue.state_of(v);
    if (distance_to_segment(state.position_world_m, blade.tip_world_m, heel_m) > around_m) return;
    around.push_back({state.rest_body_m, state.position_world_m, 1});
    vertices_.push_back(v);
  };
  for (const VertexId v : begin) visit(v);
  if (vertices_.empty() && !begin.empty()) visit(closest_to(tissue, blade, begin.front()));
  for (std::size_t k = 0; k < vertices_.size(); ++k)
    for (const std::uint32_t t : topology_.star(vertices_[k]))
      for (const VertexId v : topology_.tetrahedra()[t]) visit(v);
  if (vertices_.empty()) vertices_ = std::move(begin);
  if (around.size() < tissue.settings.fewest_vertices_around) return;
  frame_world_ = match_shape(around, otherwise_world);
  for (const MatchedPoint& p : around) {
    const Vec3 at = frame_world_.to_local(p.at_world_m);
    moved_.push_back({at, p.rest_body_m - at});
  }
}

// Moving least squares of an affine field, with Gaussian weights.
template <class Counts>
TissueAround::Displacement TissueAround::displacement(const Vec3& at_m, const Counts& counts) const {
  double least_m2 = HUGE_VAL;
  for (std::size_t i = 0; i < moved_.size(); ++i)
    if (counts(i)) least_m2 = std::min(least_m2, (moved_[i].at_m - at_m).squaredNorm());
  if (least_m2 == HUGE_VAL) return {};
  const double twice_m2 = 2 * reach_m_ * reach_m_;
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Matrix<double, 4, 3> right = Eigen::Matrix<double, 4, 3>::Zero();
  double sum = 0;
  for (std::size_t i = 0; i < moved_.size(); ++i) {
    if (!counts(i)) continue;
    const Moved& p = moved_[i];
    const Vec3 offset = (p.at_m - at_m) / reach_m_;
    const double weight = std::exp((least_m2 - (p.at_m - at_m).squaredNorm()) / twice_m2);
    const Eigen::Vector4d row(1, offset.x(), offset.y(), offset.z());
    normal += weight * row * row.transpose();
    right += weight * row * p.home_m.transpose();
    sum += weight;
  }
  normal.diagonal().tail<3>().array() += kSmooth * sum;
  return {normal.ldlt().solve(right).row(0).transpose(), std::exp(-least_m2 / twice_m2)};
}

bool TissueAround::has_tissue(const Vec3& rest_m) const {
  const auto x = [&](VertexId v) -> const Vec3& { return topology_.vertex(v).rest_body_m; };
  for (const VertexId v : vertices_) {
    if ((x(v) - rest_m).squaredNorm() > 4 * reach_m_ * reach_m_) continue;
    for (const std::uint32_t t : topology_.star(v)) {
      const auto& [a, b, c, d] = topology_.tetrahedra()[t];
      if (tet_volume_m3(rest_m, x(b), x(c), x(d)) >= 0 && tet_volume_m3(x(a), rest_m, x(c), x(d)) >= 0 &&
          tet_volume_m3(x(a), x(b), rest_m, x(d)) >= 0 && tet_volume_m3(x(a), x(b), x(c), rest_m) >= 0)
        return true;
    }
  }
  return false;
}

void TissueAround::find_sides(const SlitPlane& plane) const {
  if (sides_of_ == plane) return;
  sides_of_ = plane;
  above_.clear();
  for (const VertexId v : vertices_) {
    double sum_m = 0;
    for (const std::uint32_t t : topology_.star(v))
      for (const VertexId u : topology_.tetrahedra()[t]) sum_m += plane.height_m(topology_.vertex(u).rest_body_m);
    above_.push_back(sum_m > 0);
  }
}

// Each half of the tissue says where the place would be in it; between the lips, neither half has it.
double TissueAround::height_m(const Vec3& at_m, const Vec3& rest_m, const SlitPlane& plane) const {
  find_sides(plane);
  const Displacement above = displacement(at_m, [&](std::size_t i) { return above_[i]; });
  const Displacement below = displacement(at_m, [&](std::size_t i) { return !above_[i]; });
  if (above.weight == 0 || below.weight == 0) return plane.height_m(rest_m);
  const double a_m = plane.height_m(at_m + above.home_m), b_m = plane.height_m(at_m + below.home_m);
  return std::clamp(0.0, std::min(a_m, b_m), std::max(a_m, b_m));
}

BladePlaces TissueAround::places_at_rest(const Blade& blade, const SlitAt& slit_at) const {
  BladePlaces places;
  places.rigid = {frame_world_.to_local(blade.tip_world_m), frame_world_.to_local(heel_world_m(blade))};
  for (std::size_t k = 0; k < BladePlaces::kCount; ++k) {
    const Vec3 at_m = places.rigid.at(BladePlaces::share(k));
    const Displacement d = displacement(at_m, [](std::size_t) { return true; });
    places.home_m[k] = d.home_m;
    places.weight[k] = d.weight;
    if (d.weight == 0) continue;
    const Vec3 rest_m = at_m + d.home_m;
    if (const std::optional<SlitPlane> slit = slit_at(rest_m))
      places.home_m[k] += (height_m(at_m, rest_m, *slit) - slit->height_m(rest_m)) * slit->normal;
  }
  return places;
}

Vec3 BladePlaces::rest_at(double share) const {
  const double place = share * (kCount - 1);
  const auto k = std::min(static_cast<std::size_t>(place), kCount - 2);
  const double beyond = place - static_cast<double>(k);
  return rigid.at(share) + (1 - beyond) * home_m[k] + beyond * home_m[k + 1];
}

BladeEdge BladePlaces::straight() const {
  const auto from_middle = [](std::size_t k) { return 2 * share(k) - 1; };  // from -1 at the tip to 1 at the heel
  double sum = 1e-9, along = 0;
  for (std::size_t k = 0; k < kCount; ++k) {
    sum += weight[k];
    along += weight[k] * from_middle(k);
  }
  const double middle = along / sum;
  Vec3 mean = Vec3::Zero(), slope = Vec3::Zero();
  double spread = 0;
  for (std::size_t k = 0; k < kCount; ++k) {
    const double beside = from_middle(k) - middle;
    mean += weight[k] / sum * home_m[k];
    slope += weight[k] * beside * home_m[k];
    spread += weight[k] * beside * beside;
  }
  slope /= spread + kSmooth * sum;
  return {rigid.tip_m + mean + (-1 - middle) * slope, rigid.heel_m + mean + (1 - middle) * slope};
}

}  // namespace sectio
