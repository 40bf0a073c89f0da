#include "sim_server/deformation/tetra/tet_energy.h"

#include <algorithm>
#include <cmath>

namespace sectio {
namespace {

using Corners = std::array<Vec3, 4>;

Corners corners_at(const Tetrahedron& t, std::span<const Vec3> x) {
  return {x[t[0]], x[t[1]], x[t[2]], x[t[3]]};
}

// The gradients of the volume.
Corners growth_of(const Corners& x) {
  const Vec3 a = x[1] - x[0], b = x[2] - x[0], c = x[3] - x[0];
  Corners n{Vec3::Zero(), b.cross(c) / 6, c.cross(a) / 6, a.cross(b) / 6};
  n[0] = -(n[1] + n[2] + n[3]);
  return n;
}

// dn_k / dx_j = s x for k < j, in the order of kTetEdges; the other half has the opposite sign.
std::array<Vec3, 6> turns_of(const Corners& x) {
  const Vec3 a = x[1] - x[0], b = x[2] - x[0], c = x[3] - x[0];
  return {(b - c) / 6, (c - a) / 6, (a - b) / 6, -c / 6, b / 6, -a / 6};
}

}  // namespace

void TetEnergy::build() {
  stale_ = false;
  const TetMesh& mesh = body_->mesh();
  const std::uint32_t count = body_->vertex_count();
  vertices_.assign(count, {});
  first_.assign(count + 1, 0);
  elements_.clear();
  half_edges_.clear();
  std::vector<std::uint32_t> element_of(mesh.tetrahedra.size(), kNone);
  for (std::uint32_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const Tetrahedron& c = mesh.tetrahedra[t];
    if (c == kNoTetrahedron) continue;
    const TetShape shape = tet_shape(mesh, c);
    if (!(shape.volume_m3 > 0) || !shape.gradient[1].allFinite()) continue;  // it can't carry anything
    element_of[t] = static_cast<std::uint32_t>(elements_.size());
    elements_.push_back({c, shape.gradient, shape.volume_m3, stiffness_->shear_pa[t], {}});
    for (const VertexId v : c) {
      vertices_[v].rest_m3 += shape.volume_m3;
      vertices_[v].bulk_j += stiffness_->bulk_pa[t] * shape.volume_m3;
    }
  }
  VertexStar star;
  for (VertexId v = 0; v < count; ++v) {
    first_[v] = static_cast<std::uint32_t>(half_edges_.size());
    star.begin(mesh, body_->stars(), v);
    const auto at_itself = static_cast<std::uint32_t>(std::ranges::find(star.vertices(), v) - star.vertices().begin());
    for (const VertexId w : star.vertices())
      if (w != v) half_edges_.push_back({w, 0, Vec3f::Zero(), Vec3f::Zero(), Vec3f::Zero()});
    for (const VertexStar::Corner& corner : star.corners()) {
      if (element_of[corner.tetrahedron] == kNone) continue;
      Element& e = elements_[element_of[corner.tetrahedron]];
      for (std::size_t j = 0, n = 3 * corner.corner; j < 4; ++j) {
        const double weight = e.volume_m3 * e.shear_pa * e.gradient[corner.corner].dot(e.gradient[j]);
        if (j == corner.corner) {
          vertices_[v].l += static_cast<float>(weight);
          continue;
        }
        const std::uint32_t half = first_[v] + corner.at[j] - (corner.at[j] > at_itself ? 1 : 0);
        half_edges_[half].l += static_cast<float>(weight);
        e.half_edge[n++] = half;
      }
    }
  }
  first_[count] = static_cast<std::uint32_t>(half_edges_.size());
}

void TetEnergy::measure(std::span<const Vec3> x) {
  if (stale_) build();
  for (Vertex& v : vertices_) v.volume_m3 = 0;
  for (const Element& e : elements_) {
    const double volume = tet_volume_m3(x[e.corners[0]], x[e.corners[1]], x[e.corners[2]], x[e.corners[3]]);
    for (const VertexId v : e.corners) vertices_[v].volume_m3 += volume;
  }
  for (Vertex& v : vertices_)
    if (v.rest_m3 > 0) v.pressure_pa = 0.25 * v.bulk_j / v.rest_m3 * (v.volume_m3 / v.rest_m3 - 1);
}

double TetEnergy::energy_j(std::span<const Vec3> x) {
  measure(x);
  double energy = 0;
  for (const Element& e : elements_) {
    Mat3 f = Mat3::Zero();
    for (std::size_t k = 0; k < 4; ++k) f += x[e.corners[k]] * e.gradient[k].transpose();
    energy += e.volume_m3 * e.shear_pa * (0.5 * (f.squaredNorm() - 3) - (f.determinant() - 1));
  }
  for (const Vertex& v : vertices_)
    if (v.rest_m3 > 0) energy += 0.125 * v.bulk_j * std::pow(v.volume_m3 / v.rest_m3 - 1, 2);
  return energy;
}

void TetEnergy::add_forces(std::span<const Vec3> x, std::span<Vec3> force_n) {
  measure(x);
  for (const Element& e : elements_) {
    const Corners at = corners_at(e.corners, x), growth = growth_of(at);
    Mat3 f = Mat3::Zero();
    double pressure_pa = -e.shear_pa;
    for (std::size_t k = 0; k < 4; ++k) {
      f += (at[k] - at[0]) * e.gradient[k].transpose();
      pressure_pa += vertices_[e.corners[k]].pressure_pa;
    }
    const Mat3 stress = e.volume_m3 * e.shear_pa * f;
    for (std::size_t k = 0; k < 4; ++k) force_n[e.corners[k]] -= stress * e.gradient[k] + pressure_pa * growth[k];
  }
}

void TetEnergy::linearise(std::span<const Vec3> x) {
  measure(x);
  for (HalfEdge& h : half_edges_) h.s = h.g = h.t = Vec3f::Zero();
  for (Vertex& v : vertices_) v.g.setZero();
  const auto root = [&](VertexId v) { return std::sqrt(0.25 * vertices_[v].bulk_j) / vertices_[v].rest_m3; };
  for (const Element& e : elements_) {
    const Corners at = corners_at(e.corners, x), growth = growth_of(at);
    const std::array<Vec3, 6> turns = turns_of(at);
    double c = -e.shear_pa;
    std::array<double, 4> roots;
    for (std::size_t k = 0; k < 4; ++k) {
      c += vertices_[e.corners[k]].pressure_pa;
      roots[k] = root(e.corners[k]);
    }
    c = std::clamp(c, -e.shear_pa, e.shear_pa);
    for (std::size_t k = 0; k < 4; ++k) {
      vertices_[e.corners[k]].g += (roots[k] * growth[k]).cast<float>();
      for (std::size_t j = 0, n = 3 * k; j < 4; ++j) {
        if (j == k) continue;
        HalfEdge& half = half_edges_[e.half_edge[n++]];
        half.g += (roots[k] * growth[j]).cast<float>();
        half.t += (roots[j] * growth[k]).cast<float>();
      }
    }
    for (std::size_t n = 0; n < 6; ++n) {
      const auto [k, j] = kTetEdges[n];
      const Vec3f turn = (c * turns[n]).cast<float>();
      half_edges_[e.half_edge[3 * k + j - 1]].s += turn;
      half_edges_[e.half_edge[3 * j + k]].s -= turn;
    }
  }
}

void TetEnergy::add_product(std::span<Vec4f> p, std::span<Vec4f> force_n) const {
  for (VertexId v = 0; v < vertices_.size(); ++v) {
    float q = vertices_[v].g.dot(p[v].head<3>());
    for (std::uint32_t n = first_[v]; n < first_[v + 1]; ++n) q += half_edges_[n].g.dot(p[half_edges_[n].to].head<3>());
    p[v].w() = q;
  }
  for (VertexId v = 0; v < vertices_.size(); ++v) {
    Vec3f sum = vertices_[v].l * p[v].head<3>() + p[v].w() * vertices_[v].g;
    for (std::uint32_t n = first_[v]; n < first_[v + 1]; ++n) {
      const HalfEdge& half = half_edges_[n];
      const Vec4f& other = p[half.to];
      const Vec3f o = other.head<3>();
      sum += half.l * o + half.s.cross(o) + other.w() * half.t;
    }
    force_n[v].head<3>() += sum;
  }
}

void TetEnergy::add_blocks(std::span<Mat3> blocks) const {
  for (VertexId v = 0; v < vertices_.size(); ++v) {
    Eigen::Matrix3f block = vertices_[v].l * Eigen::Matrix3f::Identity() + vertices_[v].g * vertices_[v].g.transpose();
    for (std::uint32_t n = first_[v]; n < first_[v + 1]; ++n) block += half_edges_[n].t * half_edges_[n].t.transpose();
    blocks[v] += block.cast<double>();
  }
}

}  // namespace sectio
