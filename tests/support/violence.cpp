#include "tests/support/violence.h"

#include <algorithm>
#include <cmath>

namespace sectio::test {

std::string name_of(Load load) {
  static const std::string kNames[] = {"compress 70 %", "stretch 100 %", "twist 180 deg", "50 % in 20 ms"};
  return kNames[static_cast<std::size_t>(load)];
}

Violence::Violence(const std::string& model, double poisson, double step_s, int cells) {
  mesh_ = tet_box(2 * cells, cells, cells, Vec3(0.1, 0.05, 0.05));
  VolumeMaterial material;
  material.poisson = poisson;
  VolumeSettings settings;
  settings.step_s = step_s;
  step_s_ = step_s;
  settings.gravity_m_per_s2.setZero();
  const VolumeIntegrator driver = model == "implicit" ? VolumeIntegrator::implicit_only : VolumeIntegrator::automatic;
  if (model == "tetra_springs")
    model_ = springs_ = std::make_shared<TetSprings>(mesh_, material, settings);
  else if (model == "neo_hookean_lattice")
    model_ = lattice_ = std::make_shared<HexSolid>(mesh_, grid_around(mesh_, 0.05 / cells), material, settings);
  else
    model_ = solid_ = std::make_shared<TetSolid>(mesh_, material, settings, driver);
  x_ = test::at_rest(mesh_);
  v_ = still(x_);
  for (VertexId i = 0; i < x_.size(); ++i)
    if (end_of(i) != 0) ends_.push_back(i);
}

void Violence::load(Load load, double share) {
  const int ramp = static_cast<int>(std::lround((load == Load::slam ? 0.02 : 0.1) / step_s_)),
            all = ramp + static_cast<int>(std::lround(0.05 / step_s_));
  std::vector<PointConstraint> grips;
  std::vector<Reaction> reactions(ends_.size());
  for (int n = 1; n <= all; ++n) {
    grips.clear();
    for (const VertexId i : ends_) grips.push_back(hold(i, place_m(i, load, share * std::min(1.0, double(n) / ramp))));
    step(grips, reactions);
  }
}

void Violence::let_go(int steps) {
  for (int n = 0; n < steps; ++n) step({}, {});
}

void Violence::put(const std::function<Vec3(VertexId, const Vec3&)>& place_m) {
  for (VertexId i = 0; i < x_.size(); ++i) x_[i].head<3>() = place_m(i, mesh_.vertices_body_m[i]).cast<float>();
  v_ = still(x_);
}

Outcome Violence::outcome() {
  outcome_.energy_j = model_->energy_j(x_, v_);
  std::vector<MatchedPoint> matched;
  for (VertexId i = 0; i < x_.size(); ++i) matched.push_back({mesh_.vertices_body_m[i], at(i), model_->mass_kg(i)});
  const Pose frame = match_shape(matched, {});
  outcome_.away_m = 0;
  for (const MatchedPoint& p : matched)
    outcome_.away_m = std::max(outcome_.away_m, (p.at_world_m - frame.to_world(p.rest_body_m)).norm());
  return outcome_;
}

int Violence::inverted() const {
  int count = 0;
  for (const Tetrahedron& t : mesh_.tetrahedra) count += tet_volume_m3(at(t[0]), at(t[1]), at(t[2]), at(t[3])) <= 0;
  return count;
}

bool Violence::is_taken_over() const {
  return solid_ ? solid_->last_step_was_implicit() : lattice_ && lattice_->last_step_was_implicit();
}

int Violence::end_of(VertexId i) const {
  const double x = mesh_.vertices_body_m[i].x();
  return x < 1e-6 ? -1 : x > 0.1 - 1e-6 ? 1 : 0;
}

Vec3 Violence::place_m(VertexId i, Load load, double share) const {
  const Vec3 centre(0.05, 0.025, 0.025);
  Vec3 p = mesh_.vertices_body_m[i] - centre;
  if (load == Load::twist) return centre + Eigen::AngleAxisd(end_of(i) * share * M_PI / 2, Vec3::UnitX()) * p;
  const double stretch[] = {-0.7, 1, 0, -0.5};
  p.x() *= 1 + share * stretch[static_cast<std::size_t>(load)];
  return centre + p;
}

void Violence::step(std::span<const PointConstraint> grips, std::span<Reaction> reactions) {
  model_->step(x_, v_, grips, reactions);
  ++outcome_.steps;
  outcome_.taken_over += is_taken_over();
  if (lattice_) outcome_.divided += !is_taken_over() && lattice_->last_substeps() > lattice_->substeps();
  if (solid_ && !is_taken_over())
    outcome_.least_margin = std::min(outcome_.least_margin, solid_->diagnostics().stability_margin);
  if (springs_) outcome_.clamped = springs_->clamped();
  for (const Reaction& r : reactions) work_j_ += r.work_j;
  outcome_.most_work_j = std::max(outcome_.most_work_j, work_j_);
  double kinetic = 0;
  for (VertexId i = 0; i < x_.size(); ++i) {
    outcome_.finite = outcome_.finite && x_[i].allFinite() && v_[i].allFinite();
    outcome_.furthest_m = std::max(outcome_.furthest_m, at(i).norm());
    kinetic += 0.5 * model_->mass_kg(i) * double{v_[i].squaredNorm()};
  }
  outcome_.most_kinetic_j = std::max(outcome_.most_kinetic_j, kinetic);
  outcome_.finite = outcome_.finite && model_->first_bad_vertex() == kNone;
}

}  // namespace sectio::test
