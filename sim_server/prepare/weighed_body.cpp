#include "sim_server/prepare/weighed_body.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/core/error.h"
#include "common/material/region_volumes.h"
#include "sim_server/deformation/hexa/hex_solid.h"
#include "sim_server/planning/body_loads.h"
#include "sim_server/prepare/fill_volumes.h"
#include "sim_server/volume/volume_material.h"

namespace sectio {
namespace {

// Cells across the thickness, where that is no more than so many cells in the body. Tetrahedra are as many as a filled
// body has at the most (planning/resolution.h), and more: the border of what is held recedes by about half of one.
constexpr double kAcross = 9, kMostCells = 4000, kTetrahedra = 40000;

// The coarse lattice, for large strains.
constexpr double kCoarseAcross = 3, kMostCoarseCells = 200, kCoarseTetrahedra = 2500;
constexpr double kMoreWeight = 0.1;  // relative
constexpr double kLeastAmplified = 0.3, kMostAmplified = 3;
constexpr double kUnsettled = 3;  // the amplification where no equilibrium is found
// A body that large strains make stiffer moves otherwise than for small ones: an error that these don't show.
constexpr double kOtherwise = 0.02;
constexpr double kResidual = 2e-3;
constexpr double kLongStep_s = 3;  // inertia counts for nothing
constexpr int kMostProductsToSettle = 3000;

std::unique_ptr<HexSolid> solid_of(BodySpec body, double tetrahedra, double cell_m) {
  body.volume = {};
  body.volume.tetrahedra = tetrahedra;
  fill_volume(body, Filling::form);
  VolumeMaterial material = volume_material(body.material);
  if (vary_in_stiffness(body.regions))
    for (const std::uint32_t region : regions_of(body.regions, body.tets))
      material.stiffness_factor.push_back(region == kNoRegion ? 1 : body.regions[region].stiffness_factor);
  VolumeSettings settings;
  for (const Vec3& p : body.tets.vertices_body_m) settings.fixed.push_back(body.fixed->contains(body.pose.to_world(p)));
  return std::make_unique<HexSolid>(body.tets, grid_around(body.tets, cell_m), material, settings);
}

double cell_for(const planning::BodyShape& shape, double across, double most_cells) {
  return std::max(shape.thickness_m / across, std::cbrt(shape.volume_m3 / most_cells));
}

// The places of the nodes in equilibrium; none if it isn't found.
std::vector<Vec3> settled(HexSolid& solid, const Vec3& gravity_m_per_s2, std::vector<Vec3> from_m) {
  std::vector<double> inverse_mass;
  std::vector<Vec3> inertial_m;
  for (std::uint32_t n = 0; n < from_m.size(); ++n) {
    const double kg = solid.node_mass_kg()[n];
    inverse_mass.push_back(kg > 0 && solid.node_inverse_mass_per_kg()[n] > 0 ? 1 / kg : 0);
    inertial_m.push_back(solid.lattice().rest_m(n) + kLongStep_s * kLongStep_s * gravity_m_per_s2);
  }
  const NewtonStep::Problem problem{kLongStep_s, kResidual, solid.node_mass_kg(), inverse_mass, inertial_m, {},
                                    nullptr,     {}};
  NewtonStep newton;
  int products = 0;
  while (products < kMostProductsToSettle) {
    const NewtonOutcome outcome = newton.solve(solid.energy(), problem, from_m);
    if (outcome.met) return from_m;
    if (outcome.iterations == 0) break;
    products += outcome.products;
  }
  return {};
}

// How much an error of stiffness counts in the displacement: by the relative change of the latter when there is a
// little more weight.
double amplification_of(HexSolid& solid, const Vec3& gravity_m_per_s2) {
  std::vector<Vec3> rest_m;
  for (std::uint32_t n = 0; n < solid.node_mass_kg().size(); ++n) rest_m.push_back(solid.lattice().rest_m(n));
  solid.energy().set_homes(Pose{});
  const std::vector<Vec3> now = settled(solid, gravity_m_per_s2, rest_m);
  if (now.empty()) return kUnsettled;
  const std::vector<Vec3> more = settled(solid, (1 + kMoreWeight) * gravity_m_per_s2, now);
  if (more.empty()) return kUnsettled;
  double moved = 0, moved_more = 0;
  for (std::size_t n = 0; n < now.size(); ++n) {
    moved += solid.node_mass_kg()[n] * (now[n] - rest_m[n]).squaredNorm();
    moved_more += solid.node_mass_kg()[n] * (more[n] - now[n]).squaredNorm();
  }
  return moved > 0 ? std::clamp(std::sqrt(moved_more / moved) / kMoreWeight, kLeastAmplified, kMostAmplified) : 1;
}

}  // namespace

// The displacement at any point.
class WeighedBody::Field {
 public:
  Field(std::unique_ptr<HexSolid> solid, const Vec3& gravity_m_per_s2)
      : solid_(std::move(solid)), moved_m_(solid_->sag_of_nodes_m(gravity_m_per_s2)) {
    for (std::uint32_t e = 0; e < lattice().cells.size(); ++e) {
      // The copy of a cell with the most tissue.
      const auto [at, is_new] = cell_at_.try_emplace(lattice().cells[e].place, e);
      if (!is_new && lattice().cells[at->second].fill < lattice().cells[e].fill) at->second = e;
    }
  }
  bool known() const { return !moved_m_.empty(); }

  // The displacement at a point, by the closest cell.
  std::optional<Vec3> at(const Vec3& point_m) const {
    const Vec3 x = lattice().grid.at(point_m);
    std::optional<HexPoint> best;
    double nearest = HUGE_VAL;
    const auto look = [&](const GridPlace& place) {
      const auto cell = cell_at_.find(place);
      if (cell == cell_at_.end()) return;
      const Vec3 local = x - Vec3(place[0], place[1], place[2]);
      const double beyond = (local - local.cwiseMax(0).cwiseMin(1)).squaredNorm();
      if (beyond >= nearest) return;
      nearest = beyond;
      best = HexPoint{cell->second, local};
    };
    const Vec3 lowest = x.array().floor();
    const GridPlace own{static_cast<int>(lowest.x()), static_cast<int>(lowest.y()), static_cast<int>(lowest.z())};
    look(own);
    for (int i = -1; i <= 1 && nearest > 0; ++i)
      for (int j = -1; j <= 1; ++j)
        for (int k = -1; k <= 1; ++k) look({own[0] + i, own[1] + j, own[2] + k});
    if (!best) return std::nullopt;
    Vec3 sum = Vec3::Zero();
    for (std::size_t c = 0; c < 8; ++c) sum += best->weight(c) * moved_m_[lattice().cells[best->cell].nodes[c]];
    return sum;
  }

 private:
  const HexLattice& lattice() const { return solid_->lattice(); }

  std::unique_ptr<HexSolid> solid_;
  std::vector<Vec3> moved_m_;  // by node
  std::map<GridPlace, std::uint32_t> cell_at_;
};

WeighedBody::WeighedBody(const BodySpec& body, const planning::BodyShape& shape, const Vec3& gravity_body_m_per_s2)
    : floor_m_(planning::kSagThatMatters * shape.thickness_m) {
  try {
    reference_ = std::make_unique<Field>(solid_of(body, kTetrahedra, cell_for(shape, kAcross, kMostCells)),
                                         gravity_body_m_per_s2);
    const auto coarse = solid_of(body, kCoarseTetrahedra, cell_for(shape, kCoarseAcross, kMostCoarseCells));
    amplification_ = amplification_of(*coarse, gravity_body_m_per_s2);
  } catch (const InputError&) {  // tetrahedra that can't follow the surface; a candidate will say so
    reference_.reset();
  }
  if (reference_ && !reference_->known()) reference_.reset();
}

WeighedBody::~WeighedBody() = default;

std::optional<double> WeighedBody::error_of(std::span<const SagPoint> candidate) const {
  double wrong = 0, moved = 0, kg = 0;
  if (!reference_) return std::nullopt;
  for (const SagPoint& p : candidate) {
    const std::optional<Vec3> truth = reference_->at(p.rest_m);
    if (!truth) continue;
    wrong += p.mass_kg * (p.moved_m - *truth).squaredNorm();
    moved += p.mass_kg * truth->squaredNorm();
    kg += p.mass_kg;
  }
  if (!(kg > 0)) return std::nullopt;
  const double error = std::sqrt(wrong / kg) / std::max(std::sqrt(moved / kg), floor_m_);
  return std::hypot(amplification_ * error, kOtherwise * std::max(0.0, 1 - amplification_));
}

}  // namespace sectio
