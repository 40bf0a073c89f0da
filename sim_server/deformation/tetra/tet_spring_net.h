// The connectivity of a net of springs with second neighbours (tet_springs.h), and the stiffness of each spring. Both
// are functions of the present volume, whatever its history; after a change only the affected vertices are recomputed.
#pragma once

#include <array>

#include "sim_server/deformation/tetra/tet_body.h"
#include "sim_server/deformation/tetra/vertex_set.h"

namespace sectio {

// The springs at one vertex in the order of their other ends, in blocks of four; padding of the last block has
// stiffness 0.
struct SpringsAtVertex {
  std::span<const VertexId> to;
  std::vector<Eigen::Array4d> x_m, y_m, z_m, length_m, stiffness_n_per_m;
  double length(std::size_t n) const { return length_m[n / 4][static_cast<Eigen::Index>(n % 4)]; }
  double stiffness(std::size_t n) const { return stiffness_n_per_m[n / 4][static_cast<Eigen::Index>(n % 4)]; }
  // The components xx xy xz yy yz zz of the sum of k n n^T.
  std::array<double, 6> sum_n_per_m() const;
};

class TetSpringNet {
 public:
  TetSpringNet(const TetBody& body, const VolumeMaterial& material, double second_share);

  // Finds all second neighbours at this distance or further.
  void find_second(double least_second_m);
  // Call after the body has followed a change. Then reached() are the vertices whose springs, or whose share of the
  // stiffness between second neighbours, have changed, and those at the other ends of their springs.
  void follow(const TetBody& body, std::span<const VertexId> touched);
  std::span<const VertexId> reached() const { return reached_.list(); }  // the changed ones first
  bool has_changed(VertexId v) const { return changed_.contains(v); }

  std::size_t degree(VertexId v) const { return partners_[v].size(); }
  std::size_t edges() const;  // number of edges in the net
  // Multiplies stiffness by a common factor.
  void springs_at(VertexId v, double factor, SpringsAtVertex& springs) const;
  // Whether each spring at v is an edge.
  std::vector<bool> edges_at(VertexId v) const;

  template <class A>
  void archive(A& a) {
    a(least_second_m2_, neighbours_, partners_, edges_, stiff_mass_, place_, near_, number_);
  }

 private:
  struct Edge {
    double stiffness_n_per_m;
    std::size_t column;  // in partners_

    template <class A>
    void archive(A& a) {
      a(stiffness_n_per_m, column);
    }
  };
  void find_edges(const TetBody& body, VertexId v);
  bool find_second(VertexId v);
  bool set_partners(VertexId v, std::size_t near);
  void number_edges(VertexId v);
  void weigh(VertexId v);

  double young_pa_, density_kg_per_m3_, second_share_;
  double least_second_m2_ = 0;
  std::vector<std::vector<VertexId>> neighbours_, partners_;  // by vertex, ascending; partners: second ones, too
  std::vector<std::vector<Edge>> edges_;                      // by vertex, as neighbours_
  std::vector<double> stiff_mass_;                            // by vertex: mass times stiffness factor
  std::vector<Eigen::Vector4d> place_;  // by vertex: rest position, and stiff mass per second neighbour
  VertexSet changed_, reached_;
  std::vector<std::uint8_t> near_;   // by vertex; scratch
  std::vector<std::size_t> number_;  // by vertex; scratch
  std::vector<VertexId> list_;       // scratch
  std::vector<double> length2_m2_;   // scratch
};

}  // namespace sectio
