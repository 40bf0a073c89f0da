#include "tests/support/shapes.h"

#include <cmath>
#include <map>
#include <utility>
#include <vector>

namespace sectio::test {

TriangleSoup ellipsoid(int levels, const Vec3& half_axes_m) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  TriangleSoup soup;
  for (const double s : {-1.0, 1.0})
    for (const double t : {-g, g}) {
      soup.vertices_body_m.emplace_back(s, t, 0);
      soup.vertices_body_m.emplace_back(0, s, t);
      soup.vertices_body_m.emplace_back(t, 0, s);
    }
  for (auto& v : soup.vertices_body_m) v.normalize();
  const auto& p = soup.vertices_body_m;
  for (VertexId a = 0; a < 12; ++a)
    for (VertexId b = a + 1; b < 12; ++b)
      for (VertexId c = b + 1; c < 12; ++c) {
        const double ab = (p[a] - p[b]).norm(), bc = (p[b] - p[c]).norm(), ca = (p[c] - p[a]).norm();
        if (std::max({ab, bc, ca}) > 1.1) continue;
        const bool outward = (p[b] - p[a]).cross(p[c] - p[a]).dot(p[a]) > 0;
        soup.triangles.push_back(outward ? std::array{a, b, c} : std::array{a, c, b});
      }
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<VertexId, VertexId>, VertexId> middles;
    const auto middle = [&](VertexId a, VertexId b) {
      const auto [it, is_new] = middles.try_emplace(std::minmax(a, b), 0);
      if (is_new) {
        it->second = static_cast<VertexId>(soup.vertices_body_m.size());
        soup.vertices_body_m.push_back((soup.vertices_body_m[a] + soup.vertices_body_m[b]).normalized());
      }
      return it->second;
    };
    std::vector<std::array<VertexId, 3>> finer;
    for (const auto& [a, b, c] : soup.triangles) {
      const VertexId ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    soup.triangles = std::move(finer);
  }
  for (auto& v : soup.vertices_body_m) v = v.cwiseProduct(half_axes_m);
  return soup;
}

TriangleSoup moved(TriangleSoup soup, const Vec3& by_m) {
  for (Vec3& p : soup.vertices_body_m) p += by_m;
  return soup;
}

TriangleSoup box(int nx, int ny, int nz, const Vec3& size_m) {
  TriangleSoup soup;
  std::map<std::array<int, 3>, VertexId> ids;
  const auto vertex = [&](const std::array<int, 3>& c) {
    const auto [it, is_new] = ids.try_emplace(c, static_cast<VertexId>(soup.vertices_body_m.size()));
    if (is_new)
      soup.vertices_body_m.push_back(
          Vec3(double(c[0]) / nx, double(c[1]) / ny, double(c[2]) / nz).cwiseProduct(size_m));
    return it->second;
  };
  const std::array<int, 3> n{nx, ny, nz};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = (axis + 1) % 3, w = (axis + 2) % 3;
    for (const bool far : {false, true})
      for (int i = 0; i < n[u]; ++i)
        for (int j = 0; j < n[w]; ++j) {
          const auto at = [&](int di, int dj) {
            std::array<int, 3> c{};
            c[axis] = far ? n[axis] : 0;
            c[u] = i + di;
            c[w] = j + dj;
            return vertex(c);
          };
          const VertexId a = at(0, 0), b = at(1, 0), c = at(1, 1), d = at(0, 1);
          if (far)
            soup.triangles.insert(soup.triangles.end(), {{a, b, c}, {a, c, d}});
          else
            soup.triangles.insert(soup.triangles.end(), {{a, c, b}, {a, d, c}});
        }
  }
  return soup;
}

TriangleSoup torus(int around, int across, double radius_m, double tube_m) {
  TriangleSoup soup;
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      const double a = 2 * M_PI * i / around, b = 2 * M_PI * j / across;
      const double r = radius_m + tube_m * std::cos(b);
      soup.vertices_body_m.emplace_back(r * std::cos(a), r * std::sin(a), tube_m * std::sin(b));
    }
  const auto at = [&](int i, int j) { return static_cast<VertexId>((i % around) * across + j % across); };
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      soup.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      soup.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return soup;
}

TriangleSoup joined(TriangleSoup one, const TriangleSoup& other) {
  const auto first = static_cast<VertexId>(one.vertices_body_m.size());
  one.vertices_body_m.insert(one.vertices_body_m.end(), other.vertices_body_m.begin(), other.vertices_body_m.end());
  for (const auto& t : other.triangles) one.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  return one;
}

}  // namespace sectio::test
