#include "sim_server/session/exercise_score.h"

#include <algorithm>
#include <utility>

#include "common/core/formatted.h"
#include "common/mesh/check.h"
#include "sim_server/instruments/instrument.h"

namespace sectio {
namespace {

constexpr double kLinePitch_m = 0.001;  // between the points at which a line is looked at
constexpr double kResists_n = 1e-3;     // less: a blade that has gone through, or is drawn out
constexpr double kTouches_m = 1e-4;     // into the floor or side of a bin, which hold a piece up to rounding
constexpr double kOverhangs = 0.1;      // so much of a part in a bin may hang over the rim
constexpr double kSliver = 1e-5;        // share of the healthy tissue; less is rounding, and slivers of a cut
constexpr double kWhole = 0.999;        // share of a volume that is measured on a grid

std::string line(const char* format, double a, double b) {
  return formatted(format, a, b);
}

Vec3 edge_world_m(const ToolSpec& tool, const JointPose& pose) {
  const InstrumentState state{.intensity = tool.intensity, .opening_rad = pose.opening_rad};
  return pose.to_world(instrument_of(tool.kind).shape(tool.geometry, state).edge_tip_tool_m);
}

// The way to a place from where something was before, which it is from now on.
double way_to(const Vec3& place_m, std::optional<Vec3>& before_m) {
  const double way_m = before_m ? (place_m - *before_m).norm() : 0;
  before_m = place_m;
  return way_m;
}

}  // namespace

LineWatch::LineWatch(const LineSpec& line, const Pose& body_pose_world)
    : depth_wanted_m_(line.depth_m), within_m_(line.within_m) {
  double length_m = 0;
  for (std::size_t i = 0; i + 1 < line.points_body_m.size(); i += 2) {
    const Vec3 from = body_pose_world.to_world(line.points_body_m[i]);
    const Vec3 along = body_pose_world.to_world(line.points_body_m[i + 1]) - from;
    const int count = std::max(1, static_cast<int>(std::lround(along.norm() / kLinePitch_m)));
    for (int n = 0; n < count; ++n)
      points_.push_back({from + (n + 0.5) / count * along, along.stableNormalized(), false, 0, std::nullopt});
    length_m += along.norm();
  }
  pitch_m_ = points_.empty() ? 0 : length_m / static_cast<double>(points_.size());
}

// A cut that goes on beyond an end of the line is longer than the line, and not beside it; it is astray.
void LineWatch::add(const Vec3& tip_world_m, const Vec3& shaft_world, double way_m) {
  double least_m = HUGE_VAL, least_aside_m = HUGE_VAL;
  Point* nearest = nullptr;
  for (Point& point : points_) {
    const Vec3 to_point = point.at_world_m - tip_world_m;
    const double above_m = std::max(0.0, to_point.dot(shaft_world));
    const Vec3 from_point_m = above_m * shaft_world - to_point;
    const double along_m = from_point_m.dot(point.along_world), half_m = 0.5 * pitch_m_;
    const auto distance_m = [&](double least, double most) {
      return (from_point_m - std::clamp(along_m, least, most) * point.along_world).norm();
    };
    if (distance_m(-HUGE_VAL, HUGE_VAL) < within_m_) {
      const bool passes = std::abs(along_m) <= half_m + way_m;
      if (passes) point.depth_m = std::max(point.depth_m, above_m);
      // Scissors cut by the snip, which is longer than what one step shows of it.
      if ((passes || std::abs(along_m) <= within_m_) && above_m > 0.5 * depth_wanted_m_) point.is_cut = true;
    }
    const double beside_m = distance_m(-half_m, half_m);
    if (beside_m >= least_m) continue;
    least_m = beside_m;
    least_aside_m =
        distance_m(&point == &points_.front() ? -HUGE_VAL : -half_m, &point == &points_.back() ? HUGE_VAL : half_m);
    nearest = &point;
  }
  if (!nearest) return;
  if (least_m > within_m_) astray_m_ += way_m;
  nearest->beside_m = std::max(nearest->beside_m.value_or(0), least_aside_m);
  way_m_ += way_m;
  square_m3_ += way_m * least_aside_m * least_aside_m;
  most_m_ = std::max(most_m_, least_aside_m);
}

LineScore LineWatch::finish() const {
  LineScore score;
  const auto count = static_cast<double>(std::max<std::size_t>(1, points_.size()));
  score.length_m = pitch_m_ * static_cast<double>(points_.size());
  score.cut_fraction = static_cast<double>(std::ranges::count(points_, true, &Point::is_cut)) / count;
  score.astray_m = astray_m_;
  score.most_deviation_m = way_m_ > 0 ? most_m_ : score.length_m;
  score.deviation_m = way_m_ > 0 ? std::sqrt(square_m3_ / way_m_) : score.length_m;
  std::size_t reached = 0;
  score.beside_m.resize(std::min(kLineParts, points_.size()));
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Point& point = points_[i];
    score.depth_m += point.depth_m;
    reached += point.depth_m > 0;
    if (!point.beside_m) continue;
    std::optional<double>& part = score.beside_m[i * score.beside_m.size() / points_.size()];
    part = std::max(part.value_or(0), *point.beside_m);
  }
  score.depth_m /= static_cast<double>(std::max<std::size_t>(1, reached));
  return score;
}

ExerciseScore::ExerciseScore(const Scene& scene, const Simulation& simulation)
    : scene_(scene),
      simulation_(simulation),
      tremors_(scene.tools.size(), TremorGauge(scene.step_s)),
      untouched_m_(scene.tools.size()),
      tips_(scene.tools.size()),
      edges_(scene.tools.size()) {
  for (std::uint32_t b = 0; b < scene.bodies.size(); ++b)
    if (scene.bodies[b].name == scene.exercise->body) family_.push_back(b);
  for (const TissuePiece& piece : pieces()) {
    marked_m3_ += piece.marked_m3;
    healthy_m3_ += piece.healthy_m3;
  }
  for (const ToolSpec& tool : scene.tools) instruments_.push_back({tool.name});
  if (!scene.exercise->spare.empty()) spared_touches_ = 0;
  if (scene.exercise->line && !family_.empty()) line_.emplace(*scene.exercise->line, scene.bodies[family_[0]].pose);
}

std::vector<TissuePiece> ExerciseScore::pieces_of(std::uint32_t body_id) const {
  const BodySpec& spec = simulation_.body(body_id);
  const TriangleMesh& mesh = simulation_.mesh(body_id);
  const PositionsView positions_world_m = simulation_.positions_world_m(body_id);
  const Box bin = scene_.exercise->bin.value_or(Box{});
  const std::vector<std::uint32_t> component = component_of_triangle(mesh);
  std::map<std::uint32_t, std::vector<Triangle>> triangles;
  for (TriangleId t = 0; t < mesh.triangle_slots(); ++t)
    if (component[t] != kNone) triangles[component[t]].push_back(mesh.triangle(t));
  const Vec3 margin = Vec3::Constant(kTouches_m);
  const Box in_or_at{bin.min_world_m - margin, bin.max_world_m + margin};
  Weighed& weighed = weighed_[body_id];
  if (std::exchange(weighed.revision, mesh.revision()) != mesh.revision()) {
    weighed.pieces.clear();
    for (const auto& [id, of_piece] : triangles)
      weighed.pieces.push_back(region_volumes(spec.regions, mesh.rest_body_m(), of_piece));
  }
  std::vector<TissuePiece> pieces;
  for (const auto& [id, of_piece] : triangles) {
    TissuePiece piece{spec.name};
    const RegionVolumes& volumes = weighed.pieces[pieces.size()];
    piece.marked_m3 = volumes.marked_m3(spec.regions);
    piece.healthy_m3 = volumes.total_m3() - piece.marked_m3;
    std::size_t corners_outside = 0;
    for (const Triangle& t : of_piece)
      for (const VertexId v : t.v) {
        piece.held_in_place |= spec.holds(mesh.rest_body_m(v));
        corners_outside += in_or_at.contains(positions_world_m[v].cast<double>()) ? 0 : 1;
      }
    piece.in_bin = static_cast<double>(corners_outside) <= kOverhangs * 3 * static_cast<double>(of_piece.size());
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

std::vector<TissuePiece> ExerciseScore::pieces() const {
  std::vector<TissuePiece> all;
  for (const std::uint32_t b : family_) {
    const std::vector<TissuePiece> of_body = pieces_of(b);
    all.insert(all.end(), of_body.begin(), of_body.end());
  }
  return all;
}

void ExerciseScore::add(const StepOutput& output) {
  for (const NewBody& part : output.new_bodies)
    if (std::ranges::find(family_, part.parent_id) != family_.end()) family_.push_back(part.body_id);
  for (std::uint32_t i = 0; i < tips_.size(); ++i) {
    const auto& pose = simulation_.tool_pose_world(i);
    if (!pose) {  // it comes back elsewhere
      tips_[i].reset(), edges_[i].reset();
      continue;
    }
    untouched_m_[i] += way_to(pose->to_world(scene_.tools[i].geometry.a_tool_m), tips_[i]);
    const Vec3 edge = edge_world_m(scene_.tools[i], *pose);
    const double way_m = way_to(edge, edges_[i]);
    const bool cuts = std::ranges::any_of(output.contacts, [&](const ContactModel& contact) {
      return contact.tool_id == i && contact.state == ContactState::penetration &&
             contact.force_world_n.norm() > kResists_n;
    });
    if (line_) tremors_[i].add(edge, cuts);
    if (line_ && cuts) line_->add(edge, pose->orientation * Vec3::UnitZ(), way_m);
  }
  for (const Event& event : output.events)
    if (spared_touches_ && event.kind == EventKind::contact_began &&
        std::ranges::find(scene_.exercise->spare, simulation_.body(event.body_id).name) != scene_.exercise->spare.end())
      ++*spared_touches_;
  for (const ContactModel& contact : output.contacts) {
    if (contact.state == ContactState::free) continue;
    InstrumentUse& use = instruments_[contact.tool_id];
    const double way_m = std::exchange(untouched_m_[contact.tool_id], 0);
    if (use.contact_time_s > 0) use.path_m += way_m;
    use.largest_force_n = std::max(use.largest_force_n, contact.force_world_n.norm());
    use.contact_time_s += scene_.step_s;
    if (!first_touch_s_) first_touch_s_ = output.sim_time_s;
    last_touch_s_ = output.sim_time_s;
  }
}

Score ExerciseScore::finish() const {
  Score score;
  score.body = scene_.exercise->body;
  score.marked_m3 = score.marked_removed_m3 = marked_m3_;
  score.healthy_lost_m3 = healthy_m3_;
  std::vector<TissuePiece> all = pieces();
  const bool any_held = std::ranges::any_of(all, &TissuePiece::held_in_place);
  const auto largest =
      std::ranges::max_element(all, {}, [](const TissuePiece& p) { return p.marked_m3 + p.healthy_m3; });
  for (auto piece = all.begin(); piece != all.end(); ++piece) {
    if (any_held ? piece->held_in_place : piece == largest) {
      score.marked_removed_m3 -= piece->marked_m3;
      score.healthy_lost_m3 -= piece->healthy_m3;
      continue;
    }
    if (piece->in_bin) score.marked_in_bin_m3 += piece->marked_m3;
    score.removed.push_back(*piece);
  }
  if (std::abs(score.healthy_lost_m3) < kSliver * healthy_m3_) score.healthy_lost_m3 = 0;
  if (line_) {
    score.line = line_->finish();
    for (const TremorGauge& tremor : tremors_) score.line->tremor_m = std::max(score.line->tremor_m, tremor.rms_m());
  }
  score.spared_touches = spared_touches_;
  score.has_bin = scene_.exercise->bin.has_value();
  score.in_bin =
      score.marked_removed_m3 > (1 - kWhole) * marked_m3_ && score.marked_in_bin_m3 >= kWhole * score.marked_removed_m3;
  score.time_s = first_touch_s_ ? last_touch_s_ - *first_touch_s_ : 0;
  score.instruments = instruments_;
  for (const InstrumentUse& use : instruments_)
    score.largest_force_n = std::max(score.largest_force_n, use.largest_force_n);
  return score;
}

std::vector<std::string> to_lines(const Score& score) {
  constexpr double kMl = 1e6;
  const double share = score.marked_m3 > 0 ? score.marked_removed_m3 / score.marked_m3 : 0;
  std::vector<std::string> lines;
  if (score.line) {
    const LineScore& l = *score.line;
    lines.push_back(line("line cut                %8.1f %% of %.0f mm", 100 * l.cut_fraction, 1e3 * l.length_m));
    lines.push_back(l.has_cuts() ? line("beside the line         %8.2f mm rms, %.2f mm at most", 1e3 * l.deviation_m,
                                        1e3 * l.most_deviation_m)
                                 : "beside the line         nothing was cut at it");
    lines.push_back(l.depth_m > 0
                        ? line("depth                   %8.2f mm   astray %.1f mm", 1e3 * l.depth_m, 1e3 * l.astray_m)
                        : line("depth                   nowhere on the line   astray %.1f mm", 1e3 * l.astray_m, 0));
    lines.push_back(line("tremor                  %8.3f mm rms", 1e3 * l.tremor_m, 0));
    std::string along = "along the line, mm      ";
    for (const auto& beside_m : l.beside_m) along += beside_m ? line(" %.1f", 1e3 * *beside_m, 0) : " -";
    lines.push_back(along);
  }
  if (score.marked_m3 > 0) {
    lines.push_back(line("marked tissue removed   %8.3f ml  (%.1f %%)", kMl * score.marked_removed_m3, 100 * share));
    lines.push_back(line("healthy tissue lost     %8.3f ml", kMl * score.healthy_lost_m3, 0));
  }
  if (score.has_bin) {
    lines.push_back(std::string("in the bin              ") + (score.in_bin ? "yes" : "no") +
                    line(", %.3f ml of what is marked", kMl * score.marked_in_bin_m3, 0));
  }
  if (score.spared_touches)
    lines.push_back(line("touched beside          %8.0f times", static_cast<double>(*score.spared_touches), 0));
  lines.push_back(line("time                    %8.1f s   largest force %.2f N", score.time_s, score.largest_force_n));
  for (const InstrumentUse& use : score.instruments)
    lines.push_back(line("path %8.3f m   largest force %.2f N   ", use.path_m, use.largest_force_n) + use.name);
  return lines;
}

}  // namespace sectio
