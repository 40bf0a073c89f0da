// The rules by which a blade goes on, begins, branches off, joins and crosses. Each compares two places at rest.
#include <algorithm>
#include <utility>

#include "sim_server/surface/cutting/stroke_walk.h"

namespace sectio {
namespace {

constexpr int kMostCutsMet = 8;    // in the motion from one pose to the next
constexpr double kOnLip_m = 1e-6;  // an end this near to a place on a lip is there

class Advance {
 public:
  Advance(MeshDraft& draft, Stroke& stroke, const Blade& blade, std::span<const TriangleId> near, Grooves& grooves,
          const StrokeSettings& settings)
      : draft_(draft),
        stroke_(stroke),
        blade_(blade),
        near_(near),
        grooves_(grooves),
        settings_(settings),
        has_cut_(stroke.cuts() || stroke.has_moved) {}

  StrokeEnd run() {
    if (!settle(draft_, stroke_, &grooves_) && !leave_cut()) return StrokeEnd::refused;
    const auto place = find_place();
    if (!place) return out_of_surface();
    const bool was_away = std::exchange(stroke_.seen.was_away, false);
    if (was_away && stroke_.cuts() && distance_m(*place) > settings_.resumes_m && !leave_cut())
      return StrokeEnd::refused;
    stroke_.seen.at_world_m = place->point_world_m;
    stroke_.seen.owed_m = stroke_.cuts() ? distance_m(*place) : 0;
    stroke_.seen.depth_m = (place->point_world_m - blade_.tip_world_m).dot(blade_.up_world);
    if (stroke_.seen.depth_m < settings_.release_depth_m) return StrokeEnd::lifted;
    const StrokeEnd end = place->on == BladePlace::On::lid ? on_lid(*place) : on_skin(*place);
    if (end != StrokeEnd::refused) stroke_.seen.owed_m = owed_m_;
    return end;
  }

 private:
  enum class Start : std::uint8_t { begun, waits, refused };

  double distance_m(const BladePlace& place) const { return (place.rest_body_m - rest_of(draft_, stroke_)).norm(); }

  std::optional<BladePlace> find_place() const {
    auto place = place_on_skin(draft_, near_, blade_);
    if (place && stroke_.cuts() &&
        (place->point_world_m - position_of(draft_, stroke_)).norm() < settings_.same_sheet_world_m)
      return place;
    const auto lid = place_on_lid(draft_, grooves_, blade_);
    const auto height_m = [&](const BladePlace& p) { return p.point_world_m.dot(blade_.up_world); };
    return lid && (!place || height_m(*lid) > height_m(*place)) ? lid : place;
  }

  StrokeEnd out_of_surface() {
    stroke_.seen.was_away = true;
    if (stroke_.seen.at_world_m)
      stroke_.seen.depth_m = (*stroke_.seen.at_world_m - blade_.tip_world_m).dot(blade_.up_world);
    if (stroke_.seen.depth_m < settings_.release_depth_m) return StrokeEnd::lifted;
    return run_over_rim();
  }

  // The skin before the rim of a hole, which a piece has left, gives way to a blade that comes to it: the blade is in
  // the hole before the cut is at the rim. The cut runs into the rim that lies ahead once the blade has gone as far.
  StrokeEnd run_over_rim() {
    if (!stroke_.cuts() || !stroke_.blade) return StrokeEnd::going;
    const Vec3 end = rest_of(draft_, stroke_), course = course_from(end);
    const auto rim = nearest_on_rims(draft_, grooves_, end, settings_.join_tolerance_m, [&](const Vec3& place) {
      return (place - end).dot(course) >= settings_.ahead_cos * (place - end).norm();
    });
    const Vec3 went_world_m = blade_.tip_world_m - stroke_.blade->tip_world_m;
    if (!rim || (went_world_m - went_world_m.dot(blade_.up_world) * blade_.up_world).norm() < rim->distance_m)
      return StrokeEnd::going;
    return run_into(rim->rest_body_m);
  }

  // The cut goes to a place on a lip and over it, so that the two meet. A cut that has come to the lip already goes
  // over it in its course.
  StrokeEnd run_into(const Vec3& rest_body_m) {
    const Vec3 end = rest_of(draft_, stroke_), way = rest_body_m - end;
    const Vec3 over = way.norm() > kOnLip_m ? Vec3(way.normalized()) : course_from(end);
    return end_of(walk_to({rest_body_m + settings_.overshoot_m * over, kNone}));
  }

  static StrokeEnd end_of(WalkEnd walked) {
    switch (walked) {
      case WalkEnd::joined:
        return StrokeEnd::joined;
      case WalkEnd::refused:
        return StrokeEnd::refused;
      default:
        return StrokeEnd::going;
    }
  }

  // The unit direction in which the cut has gone lately, up to where it ends.
  Vec3 course_from(const Vec3& end_body_m) const {
    const Vec3 way = end_body_m - draft_.rest(stroke_.cell.apex);
    return way.norm() > settings_.min_step_m ? way.normalized() : stroke_.heading_body;
  }

  // The blade goes on without the cut that it worked on, whose opening stays. False: the draft must be dropped.
  [[nodiscard]] bool leave_cut() {
    if (!stroke_.cuts()) return true;
    stroke_.has_moved = true;
    stroke_.temporary_inverse.reset();
    const VertexId apex = stroke_.cell.apex;
    if (draft_.incident(apex) == kNone) {
      stroke_.cell = {};
      return true;
    }
    if (!open_temporarily(draft_, stroke_, settings_) || !finish(draft_, stroke_, grooves_)) {
      stroke_.why_refused = "the end of the cut can't be closed";
      return false;
    }
    stand_beside(draft_, stroke_, apex);
    return true;
  }

  // In a groove nothing is cut. A cut that comes to another groove runs into it.
  StrokeEnd on_lid(const BladePlace& place) {
    if (stroke_.cuts() && !is_behind(place.rest_body_m) && !is_own(place.lid) && !is_far_at_rest(place)) {
      if (const StrokeEnd end = run_into(place.rest_body_m); end != StrokeEnd::going) return end;
    }
    stroke_.seen.on_lid_body_m = place.rest_body_m;
    if (!stroke_.cuts()) touch(place.lid.lip);
    return StrokeEnd::going;
  }

  StrokeEnd on_skin(const BladePlace& place) {
    StrokeEnd end = StrokeEnd::going;
    if (has_followed(place)) return end;
    for (int i = 0; i < kMostCutsMet; ++i) {
      if (!stroke_.cuts()) {
        const Start start = start_at(place);
        if (start == Start::refused) return StrokeEnd::refused;
        if (start == Start::waits) return end;
        if (i > 0 && !stroke_.cuts()) return end;
      } else if (is_back(place)) {
        const auto beside = nearest_on_curves(draft_, grooves_, place.rest_body_m, settings_.stays_beside_m);
        const auto curve = beside ? beside : nearest_on_curves(draft_, grooves_, place.rest_body_m, settings_.leaves_m);
        if (curve) stroke_.seen.on_lid_body_m = curve->rest_body_m;
        if (beside || !curve || (place.rest_body_m - draft_.rest(stroke_.cell.apex)).norm() < settings_.node_m)
          return end;
        if (!stroke_.seen.has_dragged_end) {
          if (!leave_cut()) return StrokeEnd::refused;
          continue;
        }
      }
      const WalkEnd walked =
          walk_to({place.rest_body_m, kNone, rest_normal_of(draft_, draft_.triangle(place.triangle).v)});
      if (walked == WalkEnd::refused) return StrokeEnd::refused;
      if (walked == WalkEnd::there) {
        stroke_.seen.on_lid_body_m.reset();
        const StrokeEnd closed = close_gap();
        return closed == StrokeEnd::going ? end : closed;
      }
      if (walked == WalkEnd::waits) {
        return wait_for(place) ? end : StrokeEnd::refused;
      }
      end = StrokeEnd::joined;
      has_cut_ = true;
    }
    return end;
  }

  // The surface doesn't lead to the blade from where its cut has come to. A branch that has cut nothing is given up:
  // the next step looks for a better place, or begins anew when the blade is far already. A cut of more is left as soon
  // as the blade is far enough for a branch beside its end. False: the draft must be dropped.
  [[nodiscard]] bool wait_for(const BladePlace& place) {
    if (!stroke_.cuts()) return true;
    owed_m_ = distance_m(place);
    if (stroke_.bottom == kNone) return true;
    if (stroke_.points > 1) {
      if (owed_m_ < settings_.node_m) return true;
      if (const auto curve = nearest_on_curves(draft_, grooves_, place.rest_body_m, settings_.leaves_m))
        stroke_.seen.on_lid_body_m = curve->rest_body_m;
      return leave_cut();
    }
    const VertexId v = stroke_.cell.apex;
    const auto from = lip_from(draft_, v), to = lip_to(draft_, v);
    if (from && to && draft_.rest(from->to) == draft_.rest(to->from)) grooves_.ends[v] = stroke_.bottom;
    if (owed_m_ < settings_.most_owed_m) {
      stroke_.seen.on_lid_body_m = draft_.rest(v);
    } else {
      stroke_.seen.on_lid_body_m.reset();
      stroke_.seen.begins_anew = true;
    }
    stroke_.cell = {};
    stroke_.bottom = kNone;
    stroke_.lips.reset();
    stroke_.has_moved = has_cut_;
    return true;
  }

  WalkEnd walk_to(const WalkTarget& target) {
    const WalkEnd end = walk(draft_, stroke_, blade_, grooves_, settings_, target);
    stroke_.blade = blade_;
    stroke_.has_moved = true;
    return end;
  }

  // Is a place behind the end of the cut, seen along the cut?
  bool is_behind(const Vec3& rest_body_m) const {
    if (stroke_.heading_body.isZero()) return false;
    const Vec3 way = rest_body_m - draft_.rest(stroke_.cell.apex);
    return way.dot(stroke_.heading_body) < settings_.back_cos * way.norm();
  }

  // The blade has gone back along its cut, or has left the groove beside it.
  bool is_back(const BladePlace& place) const {
    if (stroke_.heading_body.isZero()) return false;
    for (const TriangleId t : triangles_of(draft_, stroke_.cell))
      if (t == place.triangle) return false;
    if (is_behind(place.rest_body_m)) return true;
    const Vec3 apex = draft_.rest(stroke_.cell.apex), way = place.rest_body_m - apex;
    return stroke_.seen.on_lid_body_m && (*stroke_.seen.on_lid_body_m - apex).norm() > settings_.resumes_m &&
           way.dot(stroke_.heading_body) < settings_.ahead_cos * way.norm();
  }

  // The cut is open up to the blade already, or beyond it and the blade has not gone back itself. Tissue swings to and
  // fro under a slow blade, and an end that is made anew at each swing drives it on. A cut doesn't heal, either, behind
  // an edge that leans and is drawn out: the skin slides down along it. A cut that has only just passed its last point
  // does not show yet where it heads.
  bool has_followed(const BladePlace& place) const {
    if (!stroke_.cuts() || !stroke_.temporary_inverse || !stroke_.blade) return false;
    const Vec3 end = rest_of(draft_, stroke_), way = place.rest_body_m - end;
    const Vec3 cut = end - draft_.rest(stroke_.cell.apex);
    const bool is_short = cut.norm() < settings_.node_m && !stroke_.heading_body.isZero();
    const Vec3 ahead = is_short ? stroke_.heading_body : Vec3(cut.stableNormalized());
    const double far_m = way.norm(), along_m = way.dot(ahead);
    const Vec3 went_world_m = went_beside_its_exit(place);
    if (far_m < settings_.min_step_m) return went_world_m.norm() < settings_.min_step_m;
    const Vec3 way_world = (place.point_world_m - position_of(draft_, stroke_)).stableNormalized();
    const double in_m = (stroke_.blade->tip_world_m - blade_.tip_world_m).dot(blade_.up_world);
    if (std::max(in_m, went_world_m.dot(way_world)) > settings_.own_way_ratio * far_m) return false;
    return along_m < settings_.back_cos * far_m || (far_m < settings_.node_m && along_m < settings_.ahead_cos * far_m);
  }

  // The blade's motion at the skin since the cut was made, without what draws it out along itself or straight out of
  // the skin. A leaning blade that turns about its tip sweeps the skin as well.
  Vec3 went_beside_its_exit(const BladePlace& place) const {
    const double above_m = (place.point_world_m - blade_.tip_world_m).dot(blade_.up_world);
    const Vec3 went =
        blade_.tip_world_m - stroke_.blade->tip_world_m + above_m * (blade_.up_world - stroke_.blade->up_world);
    const auto v = draft_.triangle(place.triangle).v;
    const Vec3 a = draft_.state(v[0]).position_world_m, b = draft_.state(v[1]).position_world_m,
               c = draft_.state(v[2]).position_world_m;
    const auto without = [&](const Vec3& out) -> Vec3 { return went - std::max(0.0, went.dot(out)) * out; };
    const Vec3 along_edge = without(blade_.up_world), along_normal = without((b - a).cross(c - a).stableNormalized());
    return along_edge.squaredNorm() < along_normal.squaredNorm() ? along_edge : along_normal;
  }

  // A wide gape lies over the end of the cut, while its lips are elsewhere at rest.
  bool is_far_at_rest(const BladePlace& place) const {
    return distance_m(place) >
           settings_.widest_gape_ratio * (place.point_world_m - position_of(draft_, stroke_)).norm() + settings_.node_m;
  }

  // The lid is over the last pieces of the cut itself.
  bool is_own(const Lid& lid) const {
    const auto is_last = [&](VertexId v) {
      return std::ranges::any_of(stroke_.behind_body_m,
                                 [&, at = draft_.rest(v)](const Vec3& x) { return (x - at).norm() < 1e-7; });
    };
    return is_last(lid.lip.from) && is_last(lid.lip.to);
  }

  void touch(const Lip& lip) {
    const TriangleId t = draft_.triangle_of_edge(lip.from, lip.to);
    if (t == kNone) return;
    const Triangle triangle = draft_.triangle(t);
    stroke_.touched = triangle.v;
    stroke_.bary = 0.5 * (Vec3::Unit(triangle.corner_of(lip.from)) + Vec3::Unit(triangle.corner_of(lip.to)));
  }

  // The end of a cut near a place, from which the place lies ahead.
  VertexId end_near(const Vec3& rest_body_m, double within_m, double least_cos) const {
    VertexId nearest = kNone;
    double least_m = within_m;
    for (const auto& [v, bottom] : grooves_.ends) {
      const Vec3 way = rest_body_m - draft_.rest(v);
      const double far_m = way.norm();
      if (far_m >= least_m || way.dot(heading_at(draft_, v)) < least_cos * far_m) continue;
      least_m = far_m;
      nearest = v;
    }
    return nearest;
  }

  bool is_in_groove(const Vec3& rest_body_m) {
    const auto curve = nearest_on_curves(draft_, grooves_, rest_body_m,
                                         stroke_.seen.on_lid_body_m ? settings_.stays_beside_m : settings_.beside_m);
    if (!curve) return false;
    for (const VertexId v : {curve->lip.from, curve->lip.to}) {
      const Vec3 way = rest_body_m - draft_.rest(v);
      if (grooves_.end_at(v) != kNone && curve->rest_body_m == draft_.rest(v) && way.dot(heading_at(draft_, v)) > 0)
        return false;  // ahead of the cut
    }
    stroke_.seen.on_lid_body_m = curve->rest_body_m;
    touch(curve->lip);
    return true;
  }

  // From no cut: in a groove, at the end of one, beside one, or on fresh skin.
  Start start_at(const BladePlace& place) {
    const Vec3& here = place.rest_body_m;
    if (is_in_groove(here)) return Start::waits;
    if (!stroke_.met.empty() && goes_on_over(stroke_.met.back()[0], here)) return Start::begun;
    const bool was_in_groove = stroke_.seen.on_lid_body_m.has_value();
    const VertexId end = was_in_groove ? end_near(here, settings_.resumes_m, settings_.ahead_cos)
                                       : end_near(here, settings_.join_tolerance_m, 0);
    if (end != kNone) return resume(end, here);
    if (was_in_groove)
      if (const auto curve = nearest_on_curves(draft_, grooves_, here, settings_.leaves_m)) {
        if (branch(*curve, here) == Start::begun) return Start::begun;
        owed_m_ = curve->distance_m;
        if (owed_m_ < settings_.most_owed_m) return Start::waits;
      }
    stroke_.seen.on_lid_body_m.reset();
    return begin(place, was_in_groove);
  }

  // From a vertex at which cuts have just met, unless that leads along a lip.
  bool goes_on_over(VertexId v, const Vec3& to_body_m) {
    const Vec3 at = draft_.rest(v), way = (to_body_m - at).stableNormalized();
    for (const VertexId twin : twins_of(draft_, grooves_, v))
      if (const auto lip = lip_from(draft_, twin);
          lip && way.dot((draft_.rest(lip->to) - at).stableNormalized()) > settings_.along_lip_cos)
        return false;
    stroke_.heading_body.setZero();
    return branch_off(draft_, stroke_, grooves_, v, to_body_m);
  }

  Start resume(VertexId end, const Vec3& to_body_m) {
    const Vec3 heading = heading_at(draft_, end);
    if (!branch_off(draft_, stroke_, grooves_, end, to_body_m)) {
      owed_m_ = (to_body_m - draft_.rest(end)).norm();
      return Start::waits;
    }
    grooves_.ends.erase(end);
    stroke_.heading_body = heading;
    return Start::begun;
  }

  Start branch(const PlaceOnCurve& from, const Vec3& to_body_m) {
    const double length_m = (draft_.rest(from.lip.to) - draft_.rest(from.lip.from)).norm();
    const auto is_near = [&](VertexId v, double along) {
      return along < settings_.rung_ratio ||
             (along * length_m < settings_.node_m && twins_of(draft_, grooves_, v).size() != 2);
    };
    const VertexId rung = rung_at(draft_, grooves_, from.lip, from.along, is_near);
    if (!branch_off(draft_, stroke_, grooves_, rung, to_body_m)) return Start::waits;
    grooves_.ends.erase(rung);
    stroke_.heading_body.setZero();
    return Start::begun;
  }

  // A scratch cuts nothing until the blade has moved on.
  Start begin(const BladePlace& place, bool was_in_groove) {
    const auto& t = stroke_.touched;
    const TriangleId touched = draft_.find_triangle(t[0], t[1], t[2]);
    const bool is_on_skin = touched != kNone && draft_.triangle(touched).surface == Surface::skin;
    if (was_in_groove || std::exchange(stroke_.seen.begins_anew, false) || !is_on_skin) {
      stroke_.touched = draft_.triangle(place.triangle).v;
      stroke_.bary = place.bary;
    }
    return distance_m(place) < settings_.min_step_m ? Start::waits : Start::begun;
  }

  // A cut that has come near the end of another one, or its own beginning, and goes there, joins it.
  StrokeEnd close_gap() {
    if (stroke_.bottom == kNone && stroke_.start == kNone) return StrokeEnd::going;
    const Vec3 here = rest_of(draft_, stroke_), course = course_from(here);
    VertexId nearest = kNone;
    double least_m = settings_.join_tolerance_m;
    for (const auto& [v, bottom] : grooves_.ends) {
      if (v == stroke_.cell.apex || v == stroke_.start) continue;
      if (v == stroke_.first && (stroke_.points < 4 || stroke_.length_m < 2 * settings_.join_tolerance_m)) continue;
      const Vec3 gap = draft_.rest(v) - here;
      if (gap.norm() >= least_m || gap.dot(course) < 0) continue;
      least_m = gap.norm();
      nearest = v;
    }
    if (nearest == kNone) return StrokeEnd::going;
    return end_of(walk_to({draft_.rest(nearest), nearest}));
  }

  MeshDraft& draft_;
  Stroke& stroke_;
  const Blade& blade_;
  std::span<const TriangleId> near_;
  Grooves& grooves_;
  const StrokeSettings& settings_;
  bool has_cut_;       // in this step, before the branch that the stroke is on
  double owed_m_ = 0;  // from the cut, or the groove that it was to leave, to a blade that it couldn't follow
};

}  // namespace

StrokeEnd advance(MeshDraft& draft, Stroke& stroke, const Blade& blade, std::span<const TriangleId> near,
                  Grooves& grooves, const StrokeSettings& settings) {
  return Advance(draft, stroke, blade, near, grooves, settings).run();
}

}  // namespace sectio
