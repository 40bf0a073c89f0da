#include "sim_server/deformation/tetra/tet_spring_net.h"

#include <algorithm>
#include <cmath>

namespace sectio {
namespace {

// The least number whose rounded square root is not below x.
double least_with_root(double x) {
  double square = x * x;
  while (std::sqrt(square) < x) square = std::nextafter(square, HUGE_VAL);
  while (square > 0 && std::sqrt(std::nextafter(square, 0.0)) >= x) square = std::nextafter(square, 0.0);
  return square;
}

}  // namespace

std::array<double, 6> SpringsAtVertex::sum_n_per_m() const {
  using Four = Eigen::Array4d;
  Four xx = Four::Zero(), xy = xx, xz = xx, yy = xx, yz = xx, zz = xx;
  for (std::size_t b = 0; 4 * b < to.size(); ++b) {
    const Four k = stiffness_n_per_m[b] / (length_m[b] * length_m[b]);
    const Four kx = k * x_m[b], ky = k * y_m[b];
    xx += kx * x_m[b];
    xy += kx * y_m[b];
    xz += kx * z_m[b];
    yy += ky * y_m[b];
    yz += ky * z_m[b];
    zz += k * z_m[b] * z_m[b];
  }
  return {xx.sum(), xy.sum(), xz.sum(), yy.sum(), yz.sum(), zz.sum()};
}

TetSpringNet::TetSpringNet(const TetBody& body, const VolumeMaterial& material, double second_share)
    : young_pa_(material.young_pa),
      density_kg_per_m3_(material.density_kg_per_m3),
      second_share_(second_share),
      neighbours_(body.vertex_count()),
      partners_(neighbours_.size()),
      edges_(neighbours_.size()),
      stiff_mass_(neighbours_.size(), 0),
      place_(neighbours_.size(), Eigen::Vector4d::Zero()),
      near_(neighbours_.size(), 0),
      number_(neighbours_.size(), 0) {
  for (VertexId v = 0; v < neighbours_.size(); ++v) {
    find_edges(body, v);
    partners_[v] = neighbours_[v];
    number_edges(v);
  }
  give_room(neighbours_, partners_, edges_, stiff_mass_, place_, near_, number_);
}

void TetSpringNet::find_second(double least_second_m) {
  least_second_m2_ = least_with_root(least_second_m);
  for (VertexId v = 0; v < neighbours_.size(); ++v) {
    if (!find_second(v)) continue;
    number_edges(v);
    weigh(v);
  }
}

std::size_t TetSpringNet::edges() const {
  std::size_t halves = 0;
  for (const auto& row : neighbours_) halves += row.size();
  return halves / 2;
}

// Finds the neighbours of v, the stiffness of the edges to them, and the stiff mass, from the tetrahedra at v.
void TetSpringNet::find_edges(const TetBody& body, VertexId v) {
  std::vector<VertexId>& found = neighbours_[v];
  found.clear();
  place_[v].head<3>() = body.mesh().vertices_body_m[v];
  stiff_mass_[v] = 0;
  for (const std::uint32_t t : body.stars().of(v)) {
    stiff_mass_[v] += 0.25 * density_kg_per_m3_ * body.stiffness_factor(t) * body.volume_m3(t);
    for (const VertexId w : body.mesh().tetrahedra[t]) {
      if (w == v || near_[w] != 0) continue;
      near_[w] = 1;
      found.push_back(w);
    }
  }
  std::ranges::sort(found);
  edges_[v].assign(found.size(), {0, 0});
  length2_m2_.resize(found.size());
  for (std::size_t n = 0; n < found.size(); ++n) {
    near_[found[n]] = 0;
    number_[found[n]] = n;
    const double length = (body.mesh().vertices_body_m[v] - body.mesh().vertices_body_m[found[n]]).norm();
    length2_m2_[n] = length * length;
  }
  for (const std::uint32_t t : body.stars().of(v)) {
    const double ev = young_pa_ * body.stiffness_factor(t) * body.volume_m3(t);
    for (const VertexId w : body.mesh().tetrahedra[t])
      if (w != v) edges_[v][number_[w]].stiffness_n_per_m += (1 - second_share_) * ev / length2_m2_[number_[w]];
  }
}

// Makes the neighbours of v and the vertices exactly two edges away its partners; returns whether they have changed.
bool TetSpringNet::find_second(VertexId v) {
  std::size_t room = neighbours_[v].size() + 1;
  for (const VertexId w : neighbours_[v]) room += neighbours_[w].size();
  if (list_.size() < room) list_.resize(room);
  VertexId* const list = list_.data();
  std::uint8_t* const near = near_.data();
  std::size_t count = 0;
  near[v] = 1;
  for (const VertexId w : neighbours_[v]) {
    near[w] = 1;
    list[count++] = w;
  }
  const std::size_t edges = count;
  for (const VertexId w : neighbours_[v])
    for (const VertexId u : neighbours_[w]) {
      list[count] = u;
      count += near[u] == 0;
      near[u] = 1;
    }
  std::size_t kept = edges;
  const Vec3 x = place_[v].head<3>();
  for (std::size_t n = edges; n < count; ++n) {
    const VertexId u = list[n];
    const bool keeps = (x - place_[u].head<3>()).squaredNorm() >= least_second_m2_;
    near[u] = keeps;
    list[kept] = u;
    kept += keeps;
  }
  near[v] = 0;
  return set_partners(v, kept);
}

// Makes the vertices among the first `near` of list_ that are marked in near_ the partners of v, in ascending order,
// and clears the marks. Partners that stay are merged with the sorted new ones. Returns whether the set has changed.
bool TetSpringNet::set_partners(VertexId v, std::size_t near) {
  std::vector<VertexId>& partners = partners_[v];
  const std::size_t before = partners.size();
  std::size_t kept = 0, fresh = 0;
  for (std::size_t n = 0; n < before; ++n) {
    const VertexId u = partners[n];
    partners[kept] = u;
    kept += near_[u];
    near_[u] = 0;
  }
  for (std::size_t n = 0; n < near; ++n) {
    const VertexId u = list_[n];
    list_[fresh] = u;
    fresh += near_[u];
    near_[u] = 0;
  }
  partners.resize(kept + fresh);
  std::sort(list_.begin(), list_.begin() + static_cast<std::ptrdiff_t>(fresh));
  for (std::size_t to = kept + fresh, n = fresh; n > 0;)
    partners[--to] = kept > 0 && partners[kept - 1] > list_[n - 1] ? partners[--kept] : list_[--n];
  return fresh > 0 || partners.size() != before;
}

void TetSpringNet::number_edges(VertexId v) {
  std::size_t column = 0;
  for (std::size_t n = 0; n < edges_[v].size(); ++n) {
    while (partners_[v][column] != neighbours_[v][n]) ++column;
    edges_[v][n].column = column;
  }
}

void TetSpringNet::weigh(VertexId v) {
  const std::size_t second = partners_[v].size() - neighbours_[v].size();
  place_[v][3] = second > 0 ? stiff_mass_[v] / static_cast<double>(second) : 0;
}

void TetSpringNet::follow(const TetBody& body, std::span<const VertexId> touched) {
  const std::size_t vertices = body.vertex_count();
  for (auto* lists : {&neighbours_, &partners_}) resize_slots(*lists, vertices, {});
  resize_slots(edges_, vertices, {});
  resize_slots(stiff_mass_, vertices, 0.0);
  resize_slots<Eigen::Vector4d>(place_, vertices, Eigen::Vector4d::Zero());
  resize_slots<std::uint8_t>(near_, vertices, 0);
  resize_slots<std::size_t>(number_, vertices, 0);
  changed_.begin(vertices);
  reached_.begin(vertices);
  for (const VertexId v : touched) {
    find_edges(body, v);
    changed_.insert(v);
    reached_.insert(v);
  }
  // If a path of two edges has appeared or disappeared, one of its edges has two touched ends.
  if (second_share_ > 0)
    for (const VertexId v : touched)
      for (const VertexId w : neighbours_[v]) reached_.insert(w);
  for (const VertexId v : reached_.list()) {
    bool other = false;
    if (second_share_ > 0) {
      other = find_second(v);
    } else {
      partners_[v] = neighbours_[v];
    }
    if (!other && !changed_.contains(v)) continue;
    changed_.insert(v);
    number_edges(v);
    weigh(v);
  }
  reached_.begin(vertices);
  for (const VertexId v : changed_.list()) reached_.insert(v);
  if (second_share_ > 0)
    for (const VertexId v : changed_.list())
      for (const VertexId w : partners_[v]) reached_.insert(w);
}

// k l^2 is 6 beta E / rho (m_i / d_i + m_j / d_j), with masses multiplied by the stiffness factor; the sum over all
// springs is 6 beta times the sum of E V.
void TetSpringNet::springs_at(VertexId v, double factor, SpringsAtVertex& springs) const {
  const std::vector<VertexId>& to = partners_[v];
  const double scale = 6 * second_share_ * young_pa_ / density_kg_per_m3_;
  const std::size_t blocks = (to.size() + 3) / 4;
  springs.to = to;
  for (auto* table : {&springs.x_m, &springs.y_m, &springs.z_m, &springs.length_m, &springs.stiffness_n_per_m})
    if (table->size() < blocks) table->resize(blocks);
  Eigen::Vector4d own = place_[v];
  own[3] = -own[3];
  for (std::size_t b = 0; b < blocks; ++b) {
    Eigen::Matrix4d ways;
    for (std::size_t n = 0; n < 4; ++n)
      ways.col(static_cast<Eigen::Index>(n)) = place_[to[std::min(4 * b + n, to.size() - 1)]] - own;
    ways.transposeInPlace();
    const Eigen::Array4d x = ways.col(0), y = ways.col(1), z = ways.col(2), shares = ways.col(3);
    const Eigen::Array4d length = (x * x + y * y + z * z).sqrt();
    springs.x_m[b] = x;
    springs.y_m[b] = y;
    springs.z_m[b] = z;
    springs.length_m[b] = length;
    springs.stiffness_n_per_m[b] = scale * shares / (length * length) * factor;
  }
  double* const stiffness = springs.stiffness_n_per_m.empty() ? nullptr : springs.stiffness_n_per_m.front().data();
  for (const Edge& e : edges_[v]) stiffness[e.column] = e.stiffness_n_per_m * factor;
  for (std::size_t n = to.size(); n < 4 * blocks; ++n) stiffness[n] = 0;
}

std::vector<bool> TetSpringNet::edges_at(VertexId v) const {
  std::vector<bool> edge(partners_[v].size(), false);
  for (const Edge& e : edges_[v]) edge[e.column] = true;
  return edge;
}

}  // namespace sectio
