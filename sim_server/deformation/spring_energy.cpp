#include "sim_server/deformation/spring_energy.h"

#include <algorithm>
#include <cmath>

namespace sectio {
void SpringEnergy::read(const SpringRows& rows, std::uint32_t vertex_count) {
  vertices_.assign(vertex_count, {});
  first_.assign(vertex_count + 1, 0);
  ends_.clear();
  for (VertexId v = 0; v < vertex_count; ++v) {
    first_[v] = static_cast<std::uint32_t>(ends_.size());
    if (!rows.contains(v)) continue;
    const VertexRow row = rows.row(v);
    vertices_[v] = {double{row.k_home}, row.home_world_m.cast<double>()};
    for (std::uint32_t n = 0; n < rows.degree(v); ++n) ends_.push_back({rows.half_edge(v, n)});
  }
  first_[vertex_count] = static_cast<std::uint32_t>(ends_.size());
}

double SpringEnergy::energy_j(std::span<const Vec3> x) {
  double energy = 0;
  for (VertexId v = 0; v < vertices_.size(); ++v) {
    energy += 0.5 * vertices_[v].k_home * (vertices_[v].home_world_m - x[v]).squaredNorm();
    for (std::uint32_t n = first_[v]; n < first_[v + 1]; ++n) {
      const HalfEdge& s = ends_[n].spring;
      energy += 0.25 * double{s.k} * std::pow((x[s.to] - x[v]).norm() - s.rest_length_m(), 2);  // met twice
    }
  }
  return energy;
}

void SpringEnergy::add_forces(std::span<const Vec3> x, std::span<Vec3> force_n) {
  for (VertexId v = 0; v < vertices_.size(); ++v) {
    Vec3 force = vertices_[v].k_home * (vertices_[v].home_world_m - x[v]);
    for (std::uint32_t n = first_[v]; n < first_[v + 1]; ++n) {
      const HalfEdge& s = ends_[n].spring;
      const Vec3 d = x[s.to] - x[v];
      const double length = d.norm();
      if (length > 0) force += (double{s.k} - double{s.k_l0} / length) * d;
    }
    force_n[v] += force;
  }
}

void SpringEnergy::linearise(std::span<const Vec3> x) {
  for (VertexId v = 0; v < vertices_.size(); ++v)
    for (std::uint32_t n = first_[v]; n < first_[v + 1]; ++n) {
      End& e = ends_[n];
      const Vec3 d = x[e.spring.to] - x[v];
      const double length = d.norm(), k = double{e.spring.k};
      const double across = length > 0 ? std::max(0.0, k - double{e.spring.k_l0} / length) : k;
      e.along = length > 0 ? Vec3f((d / length).cast<float>()) : Vec3f(Vec3f::Zero());
      e.k_across = static_cast<float>(across);
      e.k_more_along = static_cast<float>(k - across);
    }
}

void SpringEnergy::add_product(std::span<Vec4f> p, std::span<Vec4f> force_n) const {
  for (VertexId v = 0; v < vertices_.size(); ++v) {
    const Vec3f own = p[v].head<3>();
    Vec3f sum = static_cast<float>(vertices_[v].k_home) * own;
    for (std::uint32_t n = first_[v]; n < first_[v + 1]; ++n) {
      const End& e = ends_[n];
      const Vec3f d = own - p[e.spring.to].head<3>();
      sum += e.k_across * d + (e.k_more_along * e.along.dot(d)) * e.along;
    }
    force_n[v].head<3>() += sum;
  }
}

void SpringEnergy::add_blocks(std::span<Mat3> blocks) const {
  for (VertexId v = 0; v < vertices_.size(); ++v) {
    Eigen::Matrix3f sum = static_cast<float>(vertices_[v].k_home) * Eigen::Matrix3f::Identity();
    for (std::uint32_t n = first_[v]; n < first_[v + 1]; ++n) {
      const End& e = ends_[n];
      sum += e.k_across * Eigen::Matrix3f::Identity() + e.k_more_along * e.along * e.along.transpose();
    }
    blocks[v] += sum.cast<double>();
  }
}

}  // namespace sectio
