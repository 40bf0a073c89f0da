#include "tests/chart/tet_specimen.h"

#include "sim_server/volume/tets/tet_cut.h"
#include "tests/support/tet_shapes.h"

namespace sectio::chart {
namespace {

TetMesh with_slit(const ChartScene& s, TetMesh mesh) {
  if (!s.slit || s.cut_by_knife) return mesh;
  TetTopology topology(mesh);
  const double x = s.slit->at_x_m, y0 = -s.size_m.y(), y1 = 2 * s.size_m.y(), z0 = s.slit->from_z_m - 1e-9,
               z1 = 2 * s.size_m.z();
  cut(topology, {{Vec3(x, y0, z0), Vec3(x, y1, z0), Vec3(x, y1, z1), Vec3(x, y0, z1)}}, {});
  return topology.mesh();
}

class TetSpecimen final : public Specimen {
 public:
  TetSpecimen(const ChartScene& scene, TetMesh mesh, double step_s, const MakeVolume& make)
      : scene_(scene), mesh_(with_slit(scene, std::move(mesh))), step_s_(step_s) {
    VolumeSettings settings;
    settings.step_s = step_s;
    settings.gravity_m_per_s2 = Vec3(0, 0, -scene.gravity_m_per_s2);
    for (const Vec3& p : mesh_.vertices_body_m) held_.push_back(scene.held(p));
    const VolumeMaterial material{{scene.young_pa, scene.poisson, scene.density_kg_per_m3}, scene.damping_per_s, {}};
    model_ = make(mesh_, material, settings);
    settings.fixed = held_;
    for (VertexId v = 0; v < held_.size(); ++v) {
      const Vec3& p = mesh_.vertices_body_m[v];
      const bool still = !model_.drags_all && scene.held_at(p, 1) == p;
      if (!held_[v] || (!scene.let_go(p) && (model_.forces || still))) continue;
      dragged_.push_back(v);
      settings.fixed[v] = 0;
    }
    model_ = make(mesh_, material, settings);
    x_ = test::at_rest(mesh_);
    v_ = test::still(x_);
    if (scene.ball)
      for (VertexId v = 0; v < x_.size(); ++v)
        if (mesh_.vertices_body_m[v].z() > scene.size_m.z() - 1e-7) top_.push_back(v);
  }

  void step(double to_s) override {
    constraints_.clear();
    const double share = scene_.share(to_s);
    const bool released = to_s - step_s_ > scene_.let_go_s - 1e-6;
    for (const VertexId v : dragged_) {
      const Vec3& rest = mesh_.vertices_body_m[v];
      if (!released || !scene_.let_go(rest)) constraints_.push_back(hold(v, scene_.held_at(rest, share)));
    }
    for (VertexId v = 0; v < held_.size() && model_.forces && share != share_; ++v)
      if (held_[v] && !scene_.let_go(mesh_.vertices_body_m[v]))
        x_[v].head<3>() = scene_.held_at(mesh_.vertices_body_m[v], share).cast<float>();
    share_ = share;
    if (scene_.ball) {  // all particles that are in the ball after the step
      const double reach_m = 2 * scene_.ball->depth_m / scene_.load_s * step_s_ + 1e-4;
      add_contacts(scene_, share, reach_m, top_, x_, constraints_);
    }
    reactions_.resize(constraints_.size());
    model_.model->step(x_, v_, constraints_, reactions_);
  }
  double step_s() const override { return step_s_; }
  std::size_t elements() const override { return model_.elements > 0 ? model_.elements : mesh_.tetrahedra.size(); }

  std::vector<double> answer() override {
    if (scene_.asks_force) return {force_on_ball_n()};
    if (scene_.asks_torque) return {torque()};
    std::vector<double> answer;
    for (const Probe& probe : scene_.probes) {
      Vec3 u = at(probe.rest_m, false);
      if (probe.right) u = at(probe.rest_m, true) - u;
      if (!probe.right) u -= probe.rest_m;
      for (int k = 0; k < 3; ++k) answer.push_back(u[k]);
    }
    return answer;
  }

 private:
  // The force on the vertices by all that holds or presses them.
  std::vector<Vec3> forces_n() const {
    std::vector<Vec3> force(x_.size(), Vec3::Zero());
    if (model_.forces) {
      model_.forces(x_, force);
      return force;
    }
    for (std::size_t n = 0; n < constraints_.size(); ++n) force[constraints_[n].v[0]] += reactions_[n].force_on_tool_n;
    return force;
  }

  // At rest the ball bears the force by which the tissue pushes out the vertices that touch it.
  double force_on_ball_n() const {
    const std::vector<Vec3> force = forces_n();
    double sum = 0;
    for (std::size_t n = dragged_.size(); n < constraints_.size(); ++n) {
      const PointConstraint& c = constraints_[n];
      const Vec3 x = x_[c.v[0]].head<3>().cast<double>();
      if ((x - c.target_world_m).dot(c.normal) > -1e-5) sum += force[c.v[0]].z();
    }
    return sum;
  }

  double torque() const {
    const std::vector<Vec3> force = forces_n();
    double torque = 0;
    for (VertexId v = 0; v < x_.size(); ++v)
      if (held_[v] && mesh_.vertices_body_m[v].x() > scene_.size_m.x() / 2) {
        const Vec3 arm(0, x_[v].y() - scene_.size_m.y() / 2, x_[v].z() - scene_.size_m.z() / 2);
        torque -= arm.cross(force[v]).x();
      }
    return torque;
  }

  // The present place of a rest point, by the tetrahedron that holds it; on a slit: by the one on that side.
  Vec3 at(const Vec3& rest_m, bool right) const {
    const bool is_right = right || (scene_.slit && rest_m.x() > scene_.slit->at_x_m + 1e-9);
    double best = -1e30;
    Vec3 found = rest_m;
    for (const Tetrahedron& t : mesh_.tetrahedra) {
      Mat3 d;
      Vec3 middle = mesh_.vertices_body_m[t[0]];
      for (int k = 0; k < 3; ++k) {
        d.col(k) = mesh_.vertices_body_m[t[static_cast<std::size_t>(k) + 1]] - mesh_.vertices_body_m[t[0]];
        middle += mesh_.vertices_body_m[t[static_cast<std::size_t>(k) + 1]];
      }
      if (scene_.slit && (middle.x() / 4 > scene_.slit->at_x_m) != is_right) continue;
      const Vec3 w = d.inverse() * (rest_m - mesh_.vertices_body_m[t[0]]);
      const double inside = std::min(w.minCoeff(), 1 - w.sum());
      if (inside <= best) continue;
      best = inside;
      found = (1 - w.sum()) * x_[t[0]].head<3>().cast<double>();
      for (int k = 0; k < 3; ++k) found += w[k] * x_[t[static_cast<std::size_t>(k) + 1]].head<3>().cast<double>();
    }
    return found;
  }

  const ChartScene& scene_;
  TetMesh mesh_;
  double step_s_;
  std::vector<std::uint8_t> held_;
  ChartModel model_;
  std::vector<VertexId> dragged_;  // by the first constraints
  std::vector<Vec4f> x_, v_;
  std::vector<VertexId> top_;
  std::vector<PointConstraint> constraints_;
  std::vector<Reaction> reactions_;
  double share_ = 0;
};

}  // namespace

std::unique_ptr<Specimen> tet_specimen(const ChartScene& scene, int across, double step_s, const MakeVolume& make) {
  const auto& c = scene.cells_per_across;
  return tet_specimen(scene, test::tet_box(across * c[0], across * c[1], across * c[2], scene.size_m), step_s, make);
}
std::unique_ptr<Specimen> tet_specimen(const ChartScene& scene, TetMesh mesh, double step_s, const MakeVolume& make) {
  return std::make_unique<TetSpecimen>(scene, std::move(mesh), step_s, make);
}

}  // namespace sectio::chart
