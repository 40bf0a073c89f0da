#include "sim_server/body_contact/find_floor.h"

#include <array>
#include <set>

namespace sectio {
namespace {

constexpr std::array<std::array<double, 2>, 8> kDirections{
    {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};
constexpr std::array kTilts{0.1, 0.01, 0.001};
constexpr std::size_t kManifoldPoints = 1 + kDirections.size() * kTilts.size();

// Reduces the contacts from `from` on, whose normals are vertical, to the manifold.
void reduce_to_manifold(std::vector<BodyContact>& contacts, std::size_t from) {
  if (contacts.size() - from <= kManifoldPoints) return;
  const Vec3 u = Vec3::UnitZ().unitOrthogonal(), w = Vec3::UnitZ().cross(u);
  const auto outermost = [&](const auto& measure) {
    std::size_t best = from;
    for (std::size_t i = from + 1; i < contacts.size(); ++i)
      if (measure(contacts[i]) > measure(contacts[best])) best = i;
    return best;
  };
  std::set<std::size_t> kept{outermost([](const BodyContact& c) { return c.depth_m; })};
  for (const auto& [du, dw] : kDirections)
    for (const double tilt : kTilts) {
      const Vec3 tilted = tilt * (du * u + dw * w);
      kept.insert(outermost([&](const BodyContact& c) { return c.depth_m + tilted.dot(c.point_world_m); }));
    }
  std::size_t next = from;
  for (const std::size_t i : kept) contacts[next++] = contacts[i];
  contacts.resize(next);
}

}  // namespace

void find_floor_contacts(PositionsView points_world_m, double floor_z_m, double reach_m, std::uint32_t body,
                         std::vector<BodyContact>& contacts) {
  const std::size_t from = contacts.size();
  for (std::size_t v = 0; v < points_world_m.size(); ++v) {
    const Vec3 p = points_world_m[v].cast<double>();
    const double depth_m = floor_z_m - p.z();
    if (depth_m < -reach_m) continue;
    BodyContact contact;
    contact.point_world_m = p;
    contact.depth_m = depth_m;
    contact.one = side_at(body, static_cast<VertexId>(v));
    contacts.push_back(contact);
  }
  reduce_to_manifold(contacts, from);
}

}  // namespace sectio
