#include "sim_server/world/swept_tissue.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sectio {
namespace {

constexpr double kRow_m = 1e-4;        // the height of a row
constexpr double kNextPoint_m = 2e-4;  // between points of a way
constexpr double kBeside_m = 1e-3;     // an edge this far beside a way is in another cut, or cuts anew
constexpr double kBeyond_m = 2e-3;     // an edge this far beyond the end of a way, likewise
constexpr double kAtFront_m = 5e-5;    // an edge so near to the end of a cut stands at it
constexpr double kUpright = 0.5;       // least cosine of an edge to the rows' direction
constexpr double kTurned = 0.95;       // an edge that goes on at less has turned: its way goes on as a cut of its own
constexpr double kHeadsOver_m = 7e-4;  // a way heads where it goes from so far behind a place to as far beyond
constexpr double kNear_m = 3e-3;       // the part of a way that is looked at first: it may cross itself
constexpr double kEndless = std::numeric_limits<double>::infinity();

std::vector<Vec4f> rest_of(const TriangleMesh& mesh) {
  std::vector<Vec4f> at(mesh.vertex_slots(), Vec4f::Zero());
  for (VertexId v = 0; v < mesh.vertex_slots(); ++v) at[v].head<3>() = mesh.rest_body_m(v).cast<float>();
  return at;
}

Vec3 across_to(const Vec3& up, const Vec3& x) {
  return x - x.dot(up) * up;
}

}  // namespace

SweptTissue::SweptTissue(const TriangleMesh& mesh)
    : mesh_(mesh), at_rest_(rest_of(mesh_)), tree_(SurfaceView{mesh_, at_rest_}) {}

void SweptTissue::archive(Archive& a) {
  a(mesh_, cuts_);
  if (!a.reads()) return;
  at_rest_ = rest_of(mesh_);
  tree_ = SurfaceTree(SurfaceView{mesh_, at_rest_});
}

std::vector<SweptTissue::Span>& SweptTissue::Cut::row(std::ptrdiff_t number) {
  if (number < first_row) {
    rows.insert(rows.begin(), static_cast<std::size_t>(first_row - number), {});
    first_row = number;
  }
  const auto index = static_cast<std::size_t>(number - first_row);
  if (index >= rows.size()) rows.resize(index + 1);
  return rows[index];
}

std::vector<SweptTissue::Span> SweptTissue::inside(const EdgeAtRest& edge) const {
  const SurfaceView view{mesh_, at_rest_};
  const std::vector<SurfaceHit> hits = tree_.hits(view, edge.tip_m, edge.heel_m);
  std::vector<Span> spans;
  if (hits.empty()) {
    if (tree_.inside(view, edge.tip_m)) spans.push_back({0, 1});
    return spans;
  }
  double from = hits.front().entering ? -1 : 0;
  for (const SurfaceHit& hit : hits) {
    if (!hit.entering && from >= 0) spans.push_back({from, hit.parameter});
    from = hit.entering ? hit.parameter : -1;
  }
  if (from >= 0) spans.push_back({from, 1});
  return spans;
}

// Beyond its ends the way goes on straight.
SweptTissue::Place SweptTissue::place_on(const Cut& cut, const Vec3& at, double from_m, double to_m) {
  Place best{0, kEndless};
  for (std::size_t i = 0; i < cut.points.size(); ++i) {
    const bool is_last = i + 1 == cut.points.size();
    if ((!is_last && cut.gone_m[i + 1] < from_m) || (i > 0 && cut.gone_m[i] > to_m)) continue;
    const std::size_t a = is_last && i > 0 ? i - 1 : i, b = a + 1;
    const Vec3 heading = cut.points.size() < 2 ? cut.first_heading : Vec3((cut.points[b] - cut.points[a]).normalized());
    const double least_m = i == 0 ? -kEndless : 0, most_m = is_last ? kEndless : cut.gone_m[i + 1] - cut.gone_m[i];
    const double on_m = std::clamp((at - cut.points[i]).dot(heading), least_m, most_m);
    const double beside_m = (at - cut.points[i] - on_m * heading).norm();
    if (beside_m < best.beside_m) best = {cut.gone_m[i] + on_m, beside_m, heading};
  }
  return best;
}

// Between single points the heading would jump, and a leaning edge's place in each row with it.
Vec3 SweptTissue::heading_about(const Cut& cut, double gone_m) {
  if (cut.points.size() < 2) return cut.first_heading;
  const auto at = [&](double m) -> Vec3 {
    const double within_m = std::clamp(m, 0.0, cut.gone_m.back());
    const auto next = std::max<std::ptrdiff_t>(1, std::ranges::lower_bound(cut.gone_m, within_m) - cut.gone_m.begin());
    const auto b = static_cast<std::size_t>(next), a = b - 1;
    const double share = (within_m - cut.gone_m[a]) / (cut.gone_m[b] - cut.gone_m[a]);
    return cut.points[a] + share * (cut.points[b] - cut.points[a]);
  };
  const double middle_m = std::clamp(gone_m, 0.0, cut.gone_m.back());
  const Vec3 way = at(middle_m + kHeadsOver_m) - at(middle_m - kHeadsOver_m);
  return way.norm() > kAtFront_m ? Vec3(way.normalized()) : cut.first_heading;
}

std::optional<SweptTissue::Across> SweptTissue::across(const Cut& cut, const EdgeAtRest& edge,
                                                       std::optional<double> near_m) {
  const Vec3 along = edge.along();
  Across found;
  found.upright = along.dot(cut.up);
  if (std::abs(found.upright) < kUpright) return {};
  const Vec3 rise = along / found.upright;  // for each metre of height
  found.at_m = across_to(cut.up, edge.tip_m + (cut.level_m - edge.tip_m.dot(cut.up)) * rise);
  if (near_m) found.place = place_on(cut, found.at_m, *near_m - kNear_m, *near_m + kNear_m);
  if (!near_m || found.place.beside_m > kBeside_m) found.place = place_on(cut, found.at_m, -kEndless, kEndless);
  const Place& p = found.place;
  if (p.beside_m > kBeside_m || p.gone_m < -kBeyond_m || p.gone_m > cut.gone_m.back() + kBeyond_m) return {};
  found.leans = rise.dot(heading_about(cut, p.gone_m));
  return found;
}

SweptTissue::Across SweptTissue::find(const EdgeAtRest& edge, const Vec3& ahead, std::optional<Way>& way) {
  std::optional<Across> found;
  if (way && (found = across(cuts_[way->cut], edge, way->gone_m))) {
    way->gone_m = found->place.gone_m;
    const bool is_at_end = way->gone_m > cuts_[way->cut].gone_m.back() - kNextPoint_m;
    if (!is_at_end || std::abs(found->upright) > kTurned) return *found;
    way = begin(edge, ahead, kBeyond_m);
    return *across(cuts_.back(), edge, 0.0);
  }
  for (std::size_t i = 0; i < cuts_.size(); ++i)
    if (const auto other = across(cuts_[i], edge, {});
        other && (!found || other->place.beside_m < found->place.beside_m))
      found = other, way = Way{i, other->place.gone_m};
  if (found) return *found;
  way = begin(edge, ahead, 0);
  return *across(cuts_.back(), edge, 0.0);
}

// The way is told where the edge leaves the tissue towards its heel.
SweptTissue::Way SweptTissue::begin(const EdgeAtRest& edge, const Vec3& ahead, double cut_behind_m) {
  const std::vector<Span> spans = inside(edge);
  const Vec3 level = edge.at(spans.empty() ? 0.5 : spans.back().to);
  Cut cut{edge.along(), ahead};
  cut.level_m = level.dot(cut.up);
  cut.points = {across_to(cut.up, level)};
  cut.gone_m = {0};
  cut.first_row = static_cast<std::ptrdiff_t>(std::floor(cut.level_m / kRow_m));
  if (cut_behind_m > 0)
    each_row(cut, edge, spans, [&](std::ptrdiff_t r, double, double) { cut.row(r) = {{-cut_behind_m, 0}}; });
  cuts_.push_back(std::move(cut));
  return {cuts_.size() - 1, 0};
}

// Calls visit(number of the row, its height, share of the row that the edge's part in tissue takes).
template <class Visit>
void SweptTissue::each_row(const Cut& cut, const EdgeAtRest& edge, const std::vector<Span>& inside,
                           const Visit& visit) {
  for (const Span& span : inside) {
    const double a = edge.at(span.from).dot(cut.up) / kRow_m, b = edge.at(span.to).dot(cut.up) / kRow_m;
    const double low = std::min(a, b), high = std::max(a, b);
    for (auto r = static_cast<std::ptrdiff_t>(std::floor(low)); static_cast<double>(r) < high; ++r) {
      const double from = std::max(low, static_cast<double>(r)), to = std::min(high, static_cast<double>(r + 1));
      visit(r, 0.5 * (from + to) * kRow_m, to - from);
    }
  }
}

SweptTissue::Front SweptTissue::front(const EdgeAtRest& edge, const Vec3& ahead, std::optional<Way>& way) {
  const std::vector<Span> spans = inside(edge);
  if (spans.empty()) return {};
  const Across here = find(edge, ahead, way);
  const Cut& cut = cuts_[way->cut];
  const double towards = here.place.heading.dot(ahead) < 0 ? -1 : 1;
  Front front{0, true, 0.5 * (spans.front().from + spans.back().to)};
  each_row(cut, edge, spans, [&](std::ptrdiff_t r, double height_m, double share) {
    const auto index = r - cut.first_row;
    if (index >= 0 && index < static_cast<std::ptrdiff_t>(cut.rows.size())) {
      const double next_m = here.place.gone_m + here.leans * (height_m - cut.level_m) + towards * kAtFront_m;
      for (const Span& s : cut.rows[static_cast<std::size_t>(index)])
        if (s.from <= next_m && next_m <= s.to) return;
    }
    front.length_m += share * kRow_m / std::abs(here.upright);
  });
  return front;
}

double SweptTissue::sweep(const EdgeAtRest& from, const EdgeAtRest& to, const Vec3& ahead, std::optional<Way>& way) {
  const Across before = find(from, ahead, way);
  const std::size_t in = way->cut;
  const Across now = find(to, ahead, way);
  const std::vector<Span> spans = inside(to);
  if (spans.empty() || way->cut != in) return 0;
  Cut& cut = cuts_[in];
  double area_m2 = 0;
  each_row(cut, to, spans, [&](std::ptrdiff_t r, double height_m, double share) {
    const double a = before.place.gone_m + before.leans * (height_m - cut.level_m);
    const double b = now.place.gone_m + now.leans * (height_m - cut.level_m);
    Span swept{std::min(a, b), std::max(a, b)};
    double covered_m = 0;
    std::vector<Span>& row = cut.row(r);
    std::erase_if(row, [&](const Span& s) {
      if (s.to < swept.from - kAtFront_m || s.from > swept.to + kAtFront_m) return false;
      covered_m += std::max(0.0, std::min(s.to, std::max(a, b)) - std::max(s.from, std::min(a, b)));
      swept = {std::min(s.from, swept.from), std::max(s.to, swept.to)};
      return true;
    });
    row.insert(std::ranges::upper_bound(row, swept.from, {}, &Span::from), swept);
    area_m2 += share * kRow_m * std::max(0.0, std::abs(b - a) - covered_m);
  });
  const Vec3 onwards = now.at_m - cut.points.back();
  if (now.place.gone_m >= cut.gone_m.back() + kNextPoint_m) {
    cut.gone_m.push_back(cut.gone_m.back() + onwards.norm());
    cut.points.push_back(now.at_m);
    way->gone_m = cut.gone_m.back();
  }
  return area_m2;
}

}  // namespace sectio
