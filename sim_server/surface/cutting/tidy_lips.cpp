#include "sim_server/surface/cutting/tidy_lips.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/core/sort_unique.h"
#include "common/math/intersect.h"
#include "common/mesh/check.h"
#include "sim_server/surface/cutting/incisions.h"

namespace sectio {
namespace {

constexpr std::size_t kRungsAStep = 8, kChangesAStep = 4, kLargestRing = 12;
constexpr double kCurveStays_m = 2e-4;  // a rung may go whose place is this close to the curve without it
constexpr double kDepthStays = 0.25;    // the same for its bottom, of the depth
constexpr double kVolumeStays = 2e-3;   // change of the body's volume, in cubic edges, for each mend
constexpr double kVolumeOfBed = 1e-2;   // likewise, where a bottom and the bed beside it are made anew
constexpr double kVolumeOfBody = 4e-5;  // share of the body's volume that all mends together may change
constexpr double kFlat = 0.94;          // cosine of the angle at which faces make an edge of the body
constexpr double kFlatBed = 0.5;        // likewise in a bed, which is as uneven as the bottoms of its cuts
constexpr double kLeastGain = 0.1;      // gain of the worst triangle, in units of the limit
constexpr double kRadian = std::numbers::pi / 180;

using Face = std::array<VertexId, 3>;

// One way to mend a sliver: triangles that fill the hole of others.
struct Mend {
  std::vector<TriangleId> removed;
  std::vector<Triangle> added;
  std::vector<VertexId> rung;  // the lips and the bottom of the rung that goes, if one does
  bool changes_bed = false;
  double change_m3 = 0;
  double before = 1e30, after = 1e30;  // the worst triangle; below 1: a sliver
};

class Tidier {
 public:
  Tidier(MeshDraft& draft, Grooves& grooves, LipSearch& search)
      : draft_(draft), grooves_(grooves), search_(search), edge_m_(search.edge_m) {}

  // Mends slivers around a vertex of a lip. False: the draft must be dropped.
  bool mend_around(VertexId lip, std::size_t& changes, std::uint32_t& edges_collapsed) {
    while (changes < kChangesAStep && grooves_.bottom_of(lip) != kNone) {
      std::optional<Mend> best;
      for (const TriangleId t : draft_.fan(lip))
        if (score(draft_.triangle(t).v) < 1) consider_all(t, best);
      if (!best) return true;
      if (!draft_.replace(best->removed, best->added)) return false;
      edges_collapsed += best->added.size() < best->removed.size();
      sort_unique(best->rung);
      grooves_.forget(best->rung);
      search_.change_m3 += best->change_m3;
      ++changes;
    }
    return true;
  }

 private:
  Vec3 rest(VertexId v) const { return draft_.rest(v); }

  // At rest: least angle and least height, each over its limit.
  double score(const Face& v) const {
    const std::array x{rest(v[0]), rest(v[1]), rest(v[2])};
    const double area_2 = (x[1] - x[0]).cross(x[2] - x[0]).norm();
    double longest = 0, least_rad = 10;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 a = x[(i + 1) % 3] - x[i], b = x[(i + 2) % 3] - x[i];
      longest = std::max(longest, a.norm());
      least_rad = std::min(least_rad, std::atan2(area_2, a.dot(b)));
    }
    return std::min(least_rad / (kSliver_deg * kRadian), area_2 / std::max(longest, 1e-30) / (kSliverOfEdge * edge_m_));
  }

  template <typename Place>
  Vec3 area_vector(const Face& v, const Place& place) const {
    return (place(v[1]) - place(v[0])).cross(place(v[2]) - place(v[0]));
  }
  Vec3 rest_area(const Face& v) const {
    return area_vector(v, [&](VertexId x) { return rest(x); });
  }
  Vec3 world_area(const Face& v) const {
    return area_vector(v, [&](VertexId x) { return draft_.position(x); });
  }

  bool has_edge(VertexId a, VertexId b) const {
    return draft_.triangle_of_edge(a, b) != kNone || draft_.triangle_of_edge(b, a) != kNone;
  }

  // The directions, at rest and in the world, of triangles that lie in one plane but for slivers.
  struct Facing {
    Vec3 rest, world;
    double least_cosine;
  };
  std::optional<Facing> facing(std::span<const TriangleId> triangles, double least_cosine = kFlat) const {
    Facing sum{Vec3::Zero(), Vec3::Zero(), least_cosine};
    for (const TriangleId t : triangles) {
      sum.rest += rest_area(draft_.triangle(t).v);
      sum.world += world_area(draft_.triangle(t).v);
    }
    sum.rest = sum.rest.stableNormalized();
    for (const TriangleId t : triangles) {
      const Face v = draft_.triangle(t).v;
      if (const Vec3 area = rest_area(v); score(v) > 0.3 && area.dot(sum.rest) < least_cosine * area.norm()) return {};
    }
    return sum;
  }

  // Fills a ring of vertices, counter-clockwise, so that its worst triangle is as good as can be.
  bool fill(std::span<const VertexId> ring, const Facing& facing, Surface surface, Mend& mend) const {
    const std::size_t n = ring.size();
    if (n < 3 || n > kLargestRing) return false;
    std::array<std::array<double, kLargestRing>, kLargestRing> best;
    std::array<std::array<std::size_t, kLargestRing>, kLargestRing> middle{};
    for (std::size_t i = 0; i + 1 < n; ++i) best[i][i + 1] = 1e30;
    for (std::size_t span = 2; span < n; ++span)
      for (std::size_t i = 0; i + span < n; ++i) {
        const std::size_t j = i + span;
        best[i][j] = -1;
        if (span < n - 1 && has_edge(ring[i], ring[j])) continue;
        for (std::size_t k = i + 1; k < j; ++k) {
          const double sides = std::min(best[i][k], best[k][j]);
          if (sides <= best[i][j]) continue;
          const Face v{ring[i], ring[k], ring[j]};
          const Vec3 area = rest_area(v);
          if (area.dot(facing.rest) < facing.least_cosine * area.norm() || world_area(v).dot(facing.world) <= 0)
            continue;
          if (const double worst = std::min(sides, score(v)); worst > best[i][j]) best[i][j] = worst, middle[i][j] = k;
        }
      }
    if (best[0][n - 1] <= 0) return false;
    mend.after = std::min(mend.after, best[0][n - 1]);
    std::vector<std::array<std::size_t, 2>> open{{0, n - 1}};
    while (!open.empty()) {
      const auto [i, j] = open.back();
      open.pop_back();
      if (j - i < 2) continue;
      const std::size_t k = middle[i][j];
      mend.added.push_back({{ring[i], ring[k], ring[j]}, surface});
      open.push_back({i, k}), open.push_back({k, j});
    }
    return true;
  }

  void remove(Mend& mend, TriangleId t) const {
    mend.removed.push_back(t);
    mend.before = std::min(mend.before, score(draft_.triangle(t).v));
  }

  // Six times the volume at rest between a triangle and a point.
  double sixfold_volume_m3(const Face& v, const Vec3& origin) const {
    return (rest(v[0]) - origin).cross(rest(v[1]) - origin).dot(rest(v[2]) - origin);
  }
  double volume_change_m3(const Mend& mend) const {
    const Vec3 origin = rest(mend.added[0].v[0]);
    double sum_m3 = 0;
    for (const Triangle& t : mend.added) sum_m3 += sixfold_volume_m3(t.v, origin);
    for (const TriangleId t : mend.removed) sum_m3 -= sixfold_volume_m3(draft_.triangle(t).v, origin);
    return sum_m3 / 6;
  }

  void keep_if_better(std::optional<Mend>& best, std::optional<Mend> mend) const {
    if (!mend || mend->after < mend->before + kLeastGain) return;
    const double most = (mend->changes_bed ? kVolumeOfBed : kVolumeStays) * edge_m_ * edge_m_ * edge_m_;
    mend->change_m3 = volume_change_m3(*mend);
    const double together_m3 = std::abs(search_.change_m3 + mend->change_m3);
    const bool is_too_much = together_m3 > kVolumeOfBody * search_.body_m3 && together_m3 > std::abs(search_.change_m3);
    if (std::abs(mend->change_m3) > most || is_too_much) return;
    if (!best || std::min(mend->after, 2.0) > std::min(best->after, 2.0)) best = std::move(mend);
  }

  void consider_all(TriangleId t, std::optional<Mend>& best) const {
    const Face v = draft_.triangle(t).v;
    for (std::size_t i = 0; i < 3; ++i) keep_if_better(best, flipped(t, static_cast<int>(i)));
    for (const VertexId x : v) {
      if (grooves_.bottom_of(x) != kNone)
        keep_if_better(best, without_rung(x));
      else
        keep_if_better(best, without_vertex(x));
    }
  }

  std::optional<Mend> flipped(TriangleId t, int side) const {
    const TriangleId u = draft_.neighbour(t, side);
    const Triangle here = draft_.triangle(t), there = draft_.triangle(u);
    if (here.surface != there.surface) return {};
    const VertexId a = here.v[static_cast<std::size_t>(side)], b = here.after(a);
    if (here.surface == Surface::wall) {  // diagonals alone: rungs and bottoms stay
      const VertexId under_a = grooves_.bottom_of(a), under_b = grooves_.bottom_of(b);
      if ((under_a == kNone) == (under_b == kNone) || under_a == b || under_b == a) return {};
    }
    const VertexId c = here.before(a), d = there.after(a);
    if (c == d || has_edge(c, d)) return {};
    Mend mend;
    remove(mend, t), remove(mend, u);
    const auto plane = facing(mend.removed);
    if (!plane || !fill(std::array{c, a, d}, *plane, here.surface, mend) ||
        !fill(std::array{d, b, c}, *plane, here.surface, mend))
      return {};
    return mend;
  }

  // Without a vertex of uncut skin.
  std::optional<Mend> without_vertex(VertexId v) const {
    Mend mend;
    std::vector<VertexId> ring;
    for (const TriangleId t : draft_.fan(v)) {
      const Triangle triangle = draft_.triangle(t);
      if (triangle.surface != Surface::skin) return {};
      remove(mend, t);
      ring.push_back(triangle.after(v));
    }
    const auto plane = facing(mend.removed);
    if (!plane || !fill(ring, *plane, Surface::skin, mend)) return {};
    return mend;
  }

  // The skin around a vertex of a lip, from the lip that leads away from it to the one that leads to it.
  std::optional<std::vector<VertexId>> skin_beside(VertexId lip, Mend& mend) const {
    const auto away = lip_from(draft_, lip);
    if (!away) return {};
    std::vector<VertexId> ring{away->to};
    std::vector<TriangleId> skin;
    for (TriangleId t = draft_.triangle_of_edge(lip, away->to);
         t != kNone && draft_.triangle(t).surface == Surface::skin && ring.size() <= kLargestRing;
         t = draft_.triangle_of_edge(lip, ring.back())) {
      ring.push_back(draft_.triangle(t).before(lip));
      skin.push_back(t);
    }
    std::size_t in_fan = 0;
    for (const TriangleId t : draft_.fan(lip)) in_fan += draft_.triangle(t).surface == Surface::skin;
    if (in_fan != skin.size()) return {};  // cuts meet here
    if (ring.size() == 2 && draft_.triangle(draft_.triangle_of_edge(ring[1], ring[0])).surface != Surface::skin)
      return {};  // another cut's lip is beside this one
    for (const TriangleId t : skin) remove(mend, t);
    return ring;
  }

  // The triangles around the bottom of a rung that are no walls of one side, as a ring from gp to gq: a bed, once the
  // other side has left as an island.
  std::optional<std::vector<VertexId>> bed_beside(VertexId g, VertexId gp, VertexId gq,
                                                  std::span<const TriangleId> walls, Mend& mend) const {
    std::vector<VertexId> ring{gp};
    std::vector<TriangleId> bed;
    while (ring.back() != gq && ring.size() <= kLargestRing) {
      const TriangleId t = draft_.triangle_of_edge(g, ring.back());
      if (t == kNone || std::ranges::find(walls, t) != walls.end()) return {};
      ring.push_back(draft_.triangle(t).before(g));
      if (grooves_.bottom_of(ring.back()) != kNone) return {};  // a lip: another cut meets this one
      bed.push_back(t);
    }
    if (ring.size() < 3 || ring.size() > kLargestRing) return {};
    for (const TriangleId t : bed) remove(mend, t);
    return ring;
  }

  // Without a rung in the middle of a plain groove: both lips and the bottom lose a vertex. Or the lip and the bottom
  // that an island has left behind, or has taken along.
  //
  //   p --- v --- q          p --------- q
  //   |     |     |    ->    |           |
  //   gp -- g -- gq          gp ------- gq
  std::optional<Mend> without_rung(VertexId lip) const {
    const std::vector<VertexId> twins = twins_of(draft_, grooves_, lip);
    const VertexId g = grooves_.bottom_of(lip);
    if (twins.size() > 2) return {};
    Mend mend;
    mend.rung = twins;
    mend.rung.push_back(g);
    std::vector<TriangleId> of_sides;
    VertexId gp = kNone, gq = kNone;  // vertices of the last side
    for (const VertexId v : twins) {
      if (grooves_.end_at(v) != kNone || grooves_.bottom_of(v) != g) return {};
      Mend side;
      const auto ring = skin_beside(v, side);
      if (!ring) return {};
      const VertexId q = ring->front(), p = ring->back(), came_from = std::exchange(gq, grooves_.bottom_of(q));
      if (v != twins[0] && (gq != gp || grooves_.bottom_of(p) != came_from)) return {};  // no plain groove
      gp = grooves_.bottom_of(p);
      if (gq == kNone || gp == kNone || gq == gp || has_edge(gp, gq) || (ring->size() > 2 && has_edge(p, q))) return {};
      if (distance_to_segment(rest(v), rest(p), rest(q)) > kCurveStays_m ||
          distance_to_segment(rest(g), rest(gp), rest(gq)) > kDepthStays * (rest(v) - rest(g)).norm())
        return {};
      const auto plane = facing(side.removed);
      if (!plane || (ring->size() > 2 && !fill(*ring, *plane, Surface::skin, mend))) return {};

      const std::size_t skin = side.removed.size();
      const auto is_of_side = [&](VertexId x) { return x == v || x == p || x == q || x == g || x == gp || x == gq; };
      for (const VertexId x : {v, g})
        for (const TriangleId t : draft_.fan(x)) {
          const Triangle triangle = draft_.triangle(t);
          if (triangle.surface == Surface::wall && std::ranges::all_of(triangle.v, is_of_side) &&
              std::ranges::find(side.removed, t) == side.removed.end())
            remove(side, t);
        }
      if (side.removed.size() != skin + 4) return {};
      const Face upper_1{q, p, gp}, lower_1{q, gp, gq}, upper_2{q, p, gq}, lower_2{p, gp, gq};
      const double first = has_edge(q, gp) ? -1 : std::min(score(upper_1), score(lower_1));
      const double second = has_edge(p, gq) ? -1 : std::min(score(upper_2), score(lower_2));
      if (std::max(first, second) < 0) return {};
      mend.added.push_back({first >= second ? upper_1 : upper_2, Surface::wall});
      mend.added.push_back({first >= second ? lower_1 : lower_2, Surface::wall});
      mend.after = std::min(mend.after, std::max(first, second));
      mend.before = std::min(mend.before, side.before);
      mend.removed.insert(mend.removed.end(), side.removed.begin(), side.removed.end());
      of_sides.insert(of_sides.end(), side.removed.begin() + static_cast<std::ptrdiff_t>(skin), side.removed.end());
    }
    if (twins.size() == 1) {
      Mend bed;
      const auto ring = bed_beside(g, gp, gq, of_sides, bed);
      const auto plane = ring ? facing(bed.removed, kFlatBed) : std::nullopt;
      if (!plane || !fill(*ring, *plane, Surface::wall, mend)) return {};
      mend.changes_bed = true;
      mend.before = std::min(mend.before, bed.before);
      mend.removed.insert(mend.removed.end(), bed.removed.begin(), bed.removed.end());
      of_sides.insert(of_sides.end(), bed.removed.begin(), bed.removed.end());
    }
    for (const TriangleId t : draft_.fan(g))
      if (std::ranges::find(of_sides, t) == of_sides.end()) return {};
    for (const VertexId v : twins)
      for (const TriangleId t : draft_.fan(v))
        if (std::ranges::find(mend.removed, t) == mend.removed.end()) return {};
    return mend;
  }

  MeshDraft& draft_;
  Grooves& grooves_;
  LipSearch& search_;
  double edge_m_;
};

double mean_edge_m(const TriangleMesh& mesh) {
  double sum_m = 0;
  std::size_t count = 0;
  for (const Triangle& t : mesh.triangles()) {
    if (!t.alive() || t.surface != Surface::skin) continue;
    sum_m += (mesh.rest_body_m(t.v[1]) - mesh.rest_body_m(t.v[0])).norm();
    ++count;
  }
  return count ? sum_m / static_cast<double>(count) : 0;
}

}  // namespace

TidiedLips tidy_lips(const TriangleMesh& mesh, ParticleView particles, const Grooves& grooves, LipSearch search) {
  if (search.edge_m == 0) {
    search.edge_m = mean_edge_m(mesh);
    search.body_m3 = enclosed_m3(mesh.rest_body_m(), mesh.triangles());
  }
  MeshDraft draft(mesh, particles);
  TidiedLips tidied{{}, grooves, search, 0};
  Tidier tidier(draft, tidied.grooves, tidied.search);
  std::size_t changes = 0;
  for (std::size_t looked_at = 0; looked_at < kRungsAStep && changes < kChangesAStep; ++looked_at) {
    const auto rung = std::lower_bound(tidied.grooves.rungs.begin(), tidied.grooves.rungs.end(), tidied.search.next,
                                       [](const Rung& r, VertexId v) { return r.lip < v; });
    if (rung == tidied.grooves.rungs.end()) {
      tidied.search.next = std::exchange(tidied.search.has_changed, false) ? 0 : kNone;
      break;
    }
    const VertexId lip = rung->lip;
    const std::size_t before = changes;
    if (!tidier.mend_around(lip, changes,
                            tidied.edges_collapsed)) {  // the mesh stays as it was; the next look is at the next one
      search.next = lip + 1;
      return {{}, grooves, search, 0};
    }
    tidied.search.has_changed |= changes > before;
    if (changes < kChangesAStep) tidied.search.next = lip + 1;
  }
  if (changes) tidied.delta = draft.delta();
  return tidied;
}

}  // namespace sectio
