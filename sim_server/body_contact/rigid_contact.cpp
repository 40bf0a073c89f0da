#include "sim_server/body_contact/rigid_contact.h"

#include <algorithm>
#include <array>
#include <set>

namespace sectio {
namespace {

constexpr std::array<std::array<double, 2>, 8> kDirections{
    {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};
constexpr std::array kTilts{0.1, 0.01, 0.001};
constexpr std::size_t kMostBearing = 1 + kDirections.size() * kTilts.size();

}  // namespace

void keep_bearing(std::vector<RigidContact>& contacts, std::size_t from) {
  if (contacts.size() - from <= kMostBearing) return;
  Vec3 normal = Vec3::Zero();
  for (std::size_t i = from; i < contacts.size(); ++i) normal += contacts[i].normal_world;
  if (!(normal.squaredNorm() > 0)) normal = contacts[from].normal_world;
  const Vec3 u = normal.unitOrthogonal(), w = normal.normalized().cross(u);
  const auto outermost = [&](const auto& measure) {
    std::size_t best = from;
    for (std::size_t i = from + 1; i < contacts.size(); ++i)
      if (measure(contacts[i]) > measure(contacts[best])) best = i;
    return best;
  };
  std::set<std::size_t> kept{outermost([](const RigidContact& c) { return c.depth_m; })};
  for (const auto& [du, dw] : kDirections)
    for (const double tilt : kTilts)
      kept.insert(
          outermost([&](const RigidContact& c) { return c.depth_m + tilt * (du * u + dw * w).dot(c.point_world_m); }));
  std::size_t next = from;
  for (const std::size_t i : kept) contacts[next++] = contacts[i];
  contacts.resize(next);
}

void floor_contacts(std::span<const Vec3f> points_world_m, std::span<const std::uint8_t> counts, double floor_z_m,
                    double reach_m, std::uint32_t body, std::vector<RigidContact>& contacts) {
  const std::size_t from = contacts.size();
  for (std::size_t v = 0; v < points_world_m.size(); ++v) {
    const Vec3 p = points_world_m[v].cast<double>();
    const double depth_m = floor_z_m - p.z();
    if (depth_m < -reach_m || (!counts.empty() && !counts[v])) continue;
    RigidContact contact;
    contact.point_world_m = p;
    contact.depth_m = depth_m;
    contact.body = body;
    contacts.push_back(contact);
  }
  keep_bearing(contacts, from);
}

}  // namespace sectio
