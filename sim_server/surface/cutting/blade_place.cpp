#include "sim_server/surface/cutting/blade_place.h"

#include <algorithm>

#include "common/math/intersect.h"

namespace sectio {
namespace {

constexpr double kAboveHeel_m = 2e-3, kBelowTip_m = 3e-4;
constexpr double kLongestLine_m = 0.05;  // a blade without an end
constexpr double kNear_m = 0.015;        // from a blade's line to the corners of a lid that it may enter

double distance_to_line_m(const BladeLine& line, const Vec3& x) {
  return distance_to_segment(x, line.heel_world_m, line.tip_world_m);
}

}  // namespace

BladeLine line_of(const Blade& blade) {
  const double length_m = std::min(blade.length_m, kLongestLine_m);
  return {blade.tip_world_m + (length_m + kAboveHeel_m) * blade.up_world,
          blade.tip_world_m - kBelowTip_m * blade.up_world};
}

std::optional<BladePlace> place_on_skin(const MeshDraft& draft, std::span<const TriangleId> triangles,
                                        const Blade& blade) {
  const BladeLine line = line_of(blade);
  std::optional<BladePlace> place;
  double first = 2;
  for (const TriangleId t : triangles) {
    const Triangle triangle = draft.triangle(t);
    if (!triangle.alive() || triangle.surface != Surface::skin) continue;
    const auto& v = triangle.v;
    const auto hit = cross_segment(line.heel_world_m, line.tip_world_m,
                                   {draft.position(v[0]), draft.position(v[1]), draft.position(v[2])});
    if (!hit || !hit->entering || hit->parameter >= first) continue;
    first = hit->parameter;
    place = {BladePlace::On::skin, t, hit->bary, {}, Vec3::Zero(), hit->point};
    place->rest_body_m =
        hit->bary[0] * draft.rest(v[0]) + hit->bary[1] * draft.rest(v[1]) + hit->bary[2] * draft.rest(v[2]);
  }
  return place;
}

std::optional<BladePlace> place_on_lid(const MeshDraft& draft, const Grooves& grooves, const Blade& blade) {
  const BladeLine line = line_of(blade);
  std::optional<BladePlace> place;
  double first = 2;
  const auto ask = [&](const Lid& lid, VertexId a, VertexId b, VertexId c) {
    if (a == b || b == c || c == a) return;
    const auto hit =
        cross_segment(line.heel_world_m, line.tip_world_m, {draft.position(a), draft.position(b), draft.position(c)});
    if (!hit || !hit->entering || hit->parameter >= first) return;
    first = hit->parameter;
    place = {BladePlace::On::lid, kNone, hit->bary, lid, Vec3::Zero(), hit->point};
    place->rest_body_m = hit->bary[0] * draft.rest(a) + hit->bary[1] * draft.rest(b) + hit->bary[2] * draft.rest(c);
  };
  for (const Rung& rung : grooves.rungs) {
    if (distance_to_line_m(line, draft.position(rung.lip)) > kNear_m) continue;
    const auto lip = lip_from(draft, rung.lip);
    const auto lid = lip ? lid_of(draft, grooves, *lip) : std::nullopt;
    if (!lid) continue;
    ask(*lid, lid->lip.to, lid->lip.from, lid->opposite.to);
    ask(*lid, lid->lip.to, lid->opposite.to, lid->opposite.from);
    for (const auto& joint : joints_of(draft, grooves, rung.lip))
      for (std::size_t i = 1; i + 1 < joint.size(); ++i) ask(*lid, joint[0], joint[i], joint[i + 1]);
  }
  return place;
}

}  // namespace sectio
