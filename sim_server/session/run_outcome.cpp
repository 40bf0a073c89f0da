#include "sim_server/session/run_outcome.h"

#include <algorithm>
#include <utility>

#include "common/mesh/check.h"
#include "sim_server/session/count_cuts.h"

namespace sectio {
namespace {

constexpr double kMlPerM3 = 1e6;

// A component of a body at rest and now.
struct Part {
  std::uint32_t family = 0;
  double rest_volume_m3 = 0;
  double middle_moved_m = 0, furthest_m = 0;
  bool is_held = false;
};

// Held parts first, then large ones: those stay, and the others came off.
bool stays_before(const Part& a, const Part& b) {
  return std::pair(a.is_held, a.rest_volume_m3) > std::pair(b.is_held, b.rest_volume_m3);
}

std::vector<Part> parts_of(const BodySpec& spec, const TriangleMesh& mesh, PositionsView positions_world_m,
                           std::uint32_t family) {
  const std::vector<std::uint32_t> component = component_of_triangle(mesh);
  std::vector<Part> parts;
  for (const double volume_m3 : component_rest_volumes_m3(mesh, component))
    parts.push_back({.family = family, .rest_volume_m3 = volume_m3});
  std::vector<Vec3> way_m(parts.size(), Vec3::Zero());  // sum over corners
  std::vector<double> corners(parts.size(), 0);
  for (TriangleId t = 0; t < mesh.triangle_slots(); ++t) {
    if (component[t] == kNone) continue;
    for (const VertexId v : mesh.triangle(t).v) {
      const Vec3 moved_m = positions_world_m[v].cast<double>() - spec.pose.to_world(mesh.rest_body_m(v));
      Part& part = parts[component[t]];
      part.is_held |= spec.holds(mesh.rest_body_m(v));
      part.furthest_m = std::max(part.furthest_m, moved_m.norm());
      way_m[component[t]] += moved_m;
      ++corners[component[t]];
    }
  }
  for (std::size_t p = 0; p < parts.size(); ++p) parts[p].middle_moved_m = way_m[p].norm() / corners[p];
  return parts;
}

// Half the length of all lips at rest: a cut has two.
double cut_m_of(const TriangleMesh& mesh) {
  double lips_m = 0;
  for (TriangleId t = 0; t < mesh.triangle_slots(); ++t) {
    const Triangle& wall = mesh.triangle(t);
    if (!wall.alive() || wall.surface != Surface::wall) continue;
    for (int i = 0; i < 3; ++i) {
      const TriangleId next = mesh.neighbour(t, i);
      if (next == kNone || mesh.triangle(next).surface != Surface::skin) continue;
      const auto k = static_cast<std::size_t>(i);
      lips_m += (mesh.rest_body_m(wall.v[(k + 1) % 3]) - mesh.rest_body_m(wall.v[k])).norm();
    }
  }
  return 0.5 * lips_m;
}

// The numbers of an exercise.
void add_score(const Score& score, Outcome& outcome) {
  if (score.marked_m3 > 0) {
    outcome.marked_removed_fraction = score.marked_removed_m3 / score.marked_m3;
    outcome.marked_in_bin_fraction = score.marked_in_bin_m3 / score.marked_m3;
  }
  outcome.healthy_lost_ml = kMlPerM3 * score.healthy_lost_m3;
  outcome.spared_touches = static_cast<double>(score.spared_touches.value_or(0));
  if (!score.line) return;
  outcome.line_cut_fraction = score.line->cut_fraction;
  outcome.line_deviation_m = score.line->deviation_m;
  outcome.line_depth_m = score.line->depth_m;
}

}  // namespace

RunOutcome::RunOutcome(const Simulation& simulation) : simulation_(simulation) {
  for (std::uint32_t b = 0; b < simulation.body_count(); ++b) {
    family_of_.push_back(b);
    parts_begun_.push_back(check(simulation.mesh(b)).components);
  }
}

void RunOutcome::add(const StepOutput& output) {
  for (const NewBody& part : output.new_bodies) family_of_.push_back(family_of_[part.parent_id]);
}

Outcome RunOutcome::finish(const RunFigures& figures) const {
  Outcome outcome;
  std::vector<CutSurface> surfaces;
  std::vector<Part> parts;
  for (std::uint32_t b = 0; b < simulation_.body_count(); ++b) {
    const TriangleMesh& mesh = simulation_.mesh(b);
    const BodySpec& body = simulation_.body(b);
    surfaces.push_back({&mesh, body.pose, family_of_[b], body.cutting.open_top_m});
    outcome.cut_m += cut_m_of(mesh);
    const auto of_body = parts_of(body, mesh, simulation_.positions_world_m(b), family_of_[b]);
    parts.insert(parts.end(), of_body.begin(), of_body.end());
  }
  std::ranges::stable_sort(parts, stays_before);
  std::vector<std::size_t> left = parts_begun_;
  for (const Part& part : parts) {
    if (left[part.family] > 0) {
      --left[part.family];
      outcome.largest_displacement_m = std::max(outcome.largest_displacement_m, part.furthest_m);
      continue;
    }
    if (part.rest_volume_m3 < kLeastPiece_m3) continue;
    ++outcome.pieces_freed;
    outcome.freed_ml += kMlPerM3 * part.rest_volume_m3;
    outcome.freed_moved_m = std::max(outcome.freed_moved_m, part.middle_moved_m);
  }
  outcome.incisions = static_cast<double>(count_cuts(surfaces));
  outcome.removed_ml = kMlPerM3 * figures.last.removed_volume_m3;
  outcome.refusals = static_cast<double>(figures.last.cuts_refused);
  outcome.joins = static_cast<double>(count_of(figures, EventKind::joined));
  outcome.contacts = static_cast<double>(count_of(figures, EventKind::contact_began));
  outcome.grasps = static_cast<double>(count_of(figures, EventKind::grasped));
  outcome.touched_s = figures.last.contact_time_s;
  outcome.largest_force_n = figures.largest_force_n;
  outcome.largest_penetration_m = figures.largest_penetration_m;
  for (const DriverFigures& d : figures.last.drivers)
    outcome.largest_speed_m_per_s = std::max(outcome.largest_speed_m_per_s, d.largest_speed_m_per_s);
  for (const BodyOverlap& o : figures.overlaps) outcome.overlap_m = std::max(outcome.overlap_m, o.deepest_m);
  if (figures.score) add_score(*figures.score, outcome);
  return outcome;
}

}  // namespace sectio
