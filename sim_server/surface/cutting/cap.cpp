#include "sim_server/surface/cutting/cap.h"

#include <algorithm>
#include <cmath>

namespace sectio {
namespace {

constexpr double kHeight = 0.87;  // an equilateral triangle has this, in edges
constexpr double kCoarser = 1.3;  // edges of a ring, in edges of the one around it
constexpr double kFewest = 5;     // vertices of a ring

struct Ring {
  std::vector<std::uint32_t> vertices;
  std::vector<double> shares;  // along the rim at rest; one more than vertices, from 0 to 1
};

// The strip between two rings: edges of both are taken in the order of their middles along the rim.
void close_strip(const Ring& outer, const Ring& inner, Cap& cap) {
  const std::size_t n = outer.vertices.size(), m = inner.vertices.size();
  const auto middle = [](const Ring& ring, std::size_t k) { return ring.shares[k] + ring.shares[k + 1]; };
  for (std::size_t i = 0, j = 0; i < n || j < m;) {
    const std::uint32_t o = outer.vertices[i % n], q = inner.vertices[j % m];
    if (j == m || (i < n && middle(outer, i) <= middle(inner, j)))
      cap.triangles.push_back({o, outer.vertices[++i % n], q});
    else
      cap.triangles.push_back({o, inner.vertices[++j % m], q});
  }
}

VertexState mean_of(std::span<const VertexState> rim) {
  VertexState c;
  for (const VertexState& s : rim) {
    c.rest_body_m += s.rest_body_m;
    c.position_world_m += s.position_world_m;
    c.velocity_world_m_per_s += s.velocity_world_m_per_s;
  }
  const double n = static_cast<double>(rim.size());
  return {c.rest_body_m / n, c.position_world_m / n, c.velocity_world_m_per_s / n};
}

}  // namespace

Cap cap_of(std::span<const VertexState> rim) {
  const std::size_t n = rim.size();
  const VertexState centre = mean_of(rim);
  Ring ring;
  double length_m = 0, radius_m = 0;
  ring.shares.push_back(0);
  for (std::size_t i = 0; i < n; ++i) {
    ring.vertices.push_back(static_cast<std::uint32_t>(i));
    length_m += (rim[(i + 1) % n].rest_body_m - rim[i].rest_body_m).norm();
    ring.shares.push_back(length_m);
    radius_m += (rim[i].rest_body_m - centre.rest_body_m).norm() / static_cast<double>(n);
  }
  for (double& share : ring.shares) share /= length_m;
  const std::vector<double> along = ring.shares;

  Cap cap;
  double edge_m = length_m / static_cast<double>(n), share_of_radius = 1;
  while (true) {
    share_of_radius -= kHeight * edge_m / radius_m;
    edge_m *= kCoarser;
    const double count = std::round(length_m * share_of_radius / edge_m);
    if (!(count >= kFewest) || count > static_cast<double>(ring.vertices.size())) break;
    Ring inner;
    for (std::size_t j = 0, i = 0; j < static_cast<std::size_t>(count); ++j) {
      const double share = static_cast<double>(j) / count;
      while (i + 1 < n && along[i + 1] <= share) ++i;
      const VertexState on_rim =
          VertexState::mix(rim[i], rim[(i + 1) % n], (share - along[i]) / (along[i + 1] - along[i]));
      inner.vertices.push_back(static_cast<std::uint32_t>(n + cap.inner.size()));
      inner.shares.push_back(share);
      cap.inner.push_back(VertexState::mix(centre, on_rim, share_of_radius));
    }
    inner.shares.push_back(1);
    close_strip(ring, inner, cap);
    ring = std::move(inner);
  }
  const auto middle = static_cast<std::uint32_t>(n + cap.inner.size());
  cap.inner.push_back(centre);
  for (std::size_t k = 0; k < ring.vertices.size(); ++k)
    cap.triangles.push_back({ring.vertices[k], ring.vertices[(k + 1) % ring.vertices.size()], middle});
  return cap;
}

}  // namespace sectio
