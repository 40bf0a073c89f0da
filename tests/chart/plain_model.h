// Particles in double precision behind the interface of the volume models, for methods that are taken from a paper as
// they are.
#pragma once

#include <cmath>

#include "common/math/fixed_sequence.h"
#include "sim_server/deformation/tetra/tet_star.h"
#include "sim_server/deformation/tetra/volume_model.h"

namespace sectio::chart {

class PlainModel : public VolumeModel {
 public:
  PlainModel(const TetMesh& mesh, const VolumeMaterial& material, const VolumeSettings& settings)
      : VolumeModel(material, settings),
        mesh_(mesh),
        mass_(masses_by_volume(mesh, material.density_kg_per_m3)),
        x_(mesh.vertices_body_m),
        v_(x_.size(), Vec3::Zero()),
        force_(x_.size()) {
    for (const Tetrahedron& t : mesh.tetrahedra) shape_.push_back(tet_shape(mesh, t));
    set_inverse_masses();
  }

  void change(const TetChange&) override {}  // the scenes are cut before they begin
  const TetMesh& mesh() const override { return mesh_; }
  double mass_kg(VertexId v) const override { return mass_[v]; }
  double inverse_mass_per_kg(VertexId v) const override { return inverse_mass_[v]; }
  VertexId first_bad_vertex() const override {
    for (VertexId v = 0; v < x_.size(); ++v)
      if (!x_[v].allFinite()) return v;
    return kNone;
  }
  double energy_j(std::span<const Vec4f>, std::span<const Vec4f>) const override { return 0; }
  void elastic_forces_n(std::span<const Vec4f> position, std::span<Vec3> force) const {
    std::vector<Vec3> x(position.size());
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = position[i].head<3>().cast<double>();
    forces(x, force);
  }

  void step(std::span<Vec4f> position, std::span<Vec4f> velocity, std::span<const PointConstraint> constraints,
            std::span<Reaction> reactions) override {
    for (std::size_t i = 0; i < x_.size(); ++i) {
      x_[i] = position[i].head<3>().cast<double>();
      v_[i] = velocity[i].head<3>().cast<double>();
    }
    divided_.begin(constraints, position, parts_);
    pressed_ = constraints;
    for (int part = 0; part < parts_; ++part) {
      move(settings_.step_s / parts_);
      for (std::size_t i = 0; i < x_.size(); ++i) {
        position[i].head<3>() = x_[i].cast<float>();
        velocity[i].head<3>() = v_[i].cast<float>();
      }
      if (constraints.empty() || keeps_contact()) continue;
      divided_.project_substep(part, settings_.step_s / parts_, inverse_mass_, position, velocity);
      for (std::size_t i = 0; i < x_.size(); ++i) {
        x_[i] = position[i].head<3>().cast<double>();
        v_[i] = velocity[i].head<3>().cast<double>();
      }
    }
    divided_.finish(reactions);
  }

 protected:
  virtual void move(double step_s) = 0;
  virtual bool keeps_contact() const { return false; }  // by itself, while it moves: pressed_
  virtual void forces(std::span<const Vec3> x, std::span<Vec3> force) const = 0;

  void set_inverse_masses() {
    inverse_mass_.resize(mass_.size());
    for (std::size_t i = 0; i < mass_.size(); ++i)
      inverse_mass_[i] = !settings_.fixed.empty() && settings_.fixed[i] ? 0 : 1 / mass_[i];
  }

  // Equal parts of the step, each 0.6 of the limit at rest, which power iteration finds.
  void divide_step() {
    const double length_m = std::cbrt(6 * shape_.front().volume_m3), by = 1e-5 * length_m;
    std::vector<Vec3> u(x_.size()), at(x_.size()), f(x_.size());
    for (std::size_t i = 0; i < u.size(); ++i) u[i] = inverse_mass_[i] > 0 ? fixed_vector(i) : Vec3::Zero();
    double omega2 = 0;
    for (int n = 0; n < 100; ++n) {
      double largest = 0;
      for (const Vec3& d : u) largest = std::max(largest, d.cwiseAbs().maxCoeff());
      for (std::size_t i = 0; i < u.size(); ++i) at[i] = mesh_.vertices_body_m[i] + by / largest * u[i];
      forces(at, f);
      double up = 0, down = 0;
      for (Vec3& d : u) d /= largest;
      for (std::size_t i = 0; i < u.size(); ++i) {
        const Vec3 next = -inverse_mass_[i] / by * f[i];
        if (inverse_mass_[i] > 0)
          up += u[i].dot(next) / inverse_mass_[i], down += u[i].squaredNorm() / inverse_mass_[i];
        u[i] = next;
      }
      omega2 = up / down;
    }
    parts_ = static_cast<int>(std::ceil(settings_.step_s * std::sqrt(omega2) / (2 * 0.6)));
  }

  TetMesh mesh_;
  std::vector<double> mass_, inverse_mass_;
  std::vector<TetShape> shape_;
  std::vector<Vec3> x_, v_, force_;
  std::span<const PointConstraint> pressed_;  // single vertices that stay on their side of a plane
  int parts_ = 1;

 private:
  DividedConstraints divided_;
};

}  // namespace sectio::chart
