#include "tests/support/own_engines.h"

#include <algorithm>
#include <cmath>

#include "common/math/intersect.h"

namespace sectio::test {

Neighbours neighbours_of(const TriangleMesh& mesh) {
  Neighbours result;
  for (const Triangle& t : mesh.triangles())
    for (std::size_t i = 0; t.alive() && i < 3; ++i) {
      result[t.v[i]].insert(t.v[(i + 1) % 3]);
      result[t.v[(i + 1) % 3]].insert(t.v[i]);
    }
  return result;
}

Bleeding::Bleeding(const SharedBody& body) : vessels_(neighbours_of(body.mesh)), blood_ml_(body.mesh.vertex_slots()) {
  find_wounds(body.mesh);
}

Bleeding::Bleeding(const SharedBody& part, const Bleeding& parent, std::span<const VertexId> vertex_from)
    : Bleeding(part) {
  for (std::size_t v = 0; v < vertex_from.size(); ++v) blood_ml_[v] = parent.blood_ml_[vertex_from[v]];
}

void Bleeding::follow(const SharedBody& body, const TopologyChange& change) {
  const TriangleMesh& mesh = body.mesh;
  for (VertexId v = mesh.vertex_slots(); v < blood_ml_.size(); ++v) lost_ml_ += blood_ml_[v];
  blood_ml_.resize(mesh.vertex_slots());
  for (const VertexEdit& e : change.delta.vertices)
    if (e.id < mesh.vertex_slots() && !e.alive) lost_ml_ += std::exchange(blood_ml_[e.id], 0);
  for (const VertexId v : change.vertices) {
    for (const VertexId w : vessels_[v]) vessels_[w].erase(v);
    vessels_.erase(v);
  }
  for (const VertexId v : change.vertices)
    if (v < mesh.vertex_slots() && mesh.vertex_alive(v)) reconnect(mesh, v);
  find_wounds(mesh);
}

void Bleeding::step(const SharedBody&, double step_s) {
  std::vector<double> gained_ml(blood_ml_.size());
  for (const auto& [v, around] : vessels_)
    for (const VertexId w : around) gained_ml[v] += kSpreading_per_s * step_s * (blood_ml_[w] - blood_ml_[v]) / 16;
  for (const VertexId v : wounds_) gained_ml[v] += kRate_ml_per_s * step_s;
  bled_ml_ += static_cast<double>(wounds_.size()) * kRate_ml_per_s * step_s;
  for (std::size_t v = 0; v < gained_ml.size(); ++v) blood_ml_[v] += gained_ml[v];
}

void Bleeding::reconnect(const TriangleMesh& mesh, VertexId v) {
  TriangleId t = mesh.incident(v);
  const TriangleId first = t;
  do {
    const Triangle& at = mesh.triangle(t);
    const std::size_t i = at.v[0] == v ? 0 : at.v[1] == v ? 1 : 2;
    for (const VertexId w : {at.v[(i + 1) % 3], at.v[(i + 2) % 3]}) {
      vessels_[v].insert(w);
      vessels_[w].insert(v);
    }
    t = mesh.neighbours(t)[i];
  } while (t != first && t != kNone);
}

void Bleeding::find_wounds(const TriangleMesh& mesh) {
  wounds_.clear();
  for (const Triangle& t : mesh.triangles())
    if (t.alive() && t.surface == Surface::wall) wounds_.insert(t.v.begin(), t.v.end());
}

Verlet::Verlet(const SharedBody& body, const Pose& frame, const BodySpec& spec, double step_s)
    : frame_(frame), fixed_box_(spec.fixed), step_s_(step_s) {
  add_points(body);
}

void Verlet::follow(const SharedBody& body, const TopologyChange& change) {
  add_points(body);
  for (const VertexId v : change.placed) acceleration_[v].setZero();
}

void Verlet::step(const SharedBody& body, std::span<const PointConstraint> constraints, std::span<Reaction> reactions) {
  std::vector<double> inverse_mass(acceleration_.size(), 0);
  for (VertexId v = 0; v < acceleration_.size(); ++v) {
    if (!body.mesh.vertex_alive(v) || fixed(v)) continue;
    inverse_mass[v] = 1 / kMass_kg;
    const Vec3 half = velocity(body, v) + 0.5 * step_s_ * acceleration_[v];
    body.particles.place(v, position(body, v) + step_s_ * half, half);
  }
  accelerate(body);
  for (VertexId v = 0; v < acceleration_.size(); ++v)
    if (inverse_mass[v] > 0)
      body.particles.place(v, position(body, v), (1 - kDrag) * (velocity(body, v) + 0.5 * step_s_ * acceleration_[v]));
  project(constraints, inverse_mass, step_s_, body.particles.position_world_m, body.particles.velocity_world_m_per_s,
          reactions);
  ++steps_;
}

double Verlet::largest_stable_step_s() const {
  return 2 * std::sqrt(kMass_kg / (kHome_n_per_m + 24 * kEdge_n_per_m));
}

double Verlet::energy_j(const SharedBody& body) const {
  double energy = 0;
  for (const auto& [v, around] : neighbours_of(body.mesh)) {
    const Vec3 x = body.particles.position_world_m[v].head<3>().cast<double>();
    const Vec3 velocity = body.particles.velocity_world_m_per_s[v].head<3>().cast<double>();
    energy += 0.5 * kMass_kg * velocity.squaredNorm();
    energy += 0.5 * kHome_n_per_m * (frame_.to_world(body.mesh.rest_body_m(v)) - x).squaredNorm();
    for (const VertexId w : around) {
      const double rest_m = (body.mesh.rest_body_m(w) - body.mesh.rest_body_m(v)).norm();
      const double now_m = (body.particles.position_world_m[w] - body.particles.position_world_m[v]).head<3>().norm();
      energy += 0.25 * kEdge_n_per_m * std::pow(now_m - (1 - kPretension) * rest_m, 2);
    }
  }
  return energy;
}

Vec3 Verlet::position(const SharedBody& body, VertexId v) {
  return body.particles.position_world_m[v].head<3>().cast<double>();
}

Vec3 Verlet::velocity(const SharedBody& body, VertexId v) {
  return body.particles.velocity_world_m_per_s[v].head<3>().cast<double>();
}

void Verlet::accelerate(const SharedBody& body) {
  std::vector<Vec3> force_n(acceleration_.size(), Vec3::Zero());
  for (const auto& t : body.mesh.triangles())
    for (std::size_t i = 0; t.alive() && i < 3; ++i) {
      const VertexId a = t.v[i], b = t.v[(i + 1) % 3];
      const Vec3 d = position(body, b) - position(body, a);
      const double rest_m = (body.mesh.rest_body_m(b) - body.mesh.rest_body_m(a)).norm();
      if (a > b || d.norm() == 0) continue;
      const Vec3 pull = kEdge_n_per_m * (1 - (1 - kPretension) * rest_m / d.norm()) * d;
      force_n[a] += pull;
      force_n[b] -= pull;
    }
  for (VertexId v = 0; v < acceleration_.size(); ++v) {
    if (!body.mesh.vertex_alive(v)) continue;
    force_n[v] += kHome_n_per_m * (frame_.to_world(body.mesh.rest_body_m(v)) - position(body, v));
    acceleration_[v] = force_n[v] / kMass_kg;
  }
}

void Verlet::add_points(const SharedBody& body) {
  acceleration_.resize(body.mesh.vertex_slots(), Vec3::Zero());
  fixed_.resize(acceleration_.size());
  for (VertexId v = 0; v < acceleration_.size(); ++v) {
    fixed_[v] = fixed_box_ && fixed_box_->contains(frame_.to_world(body.mesh.rest_body_m(v)));
  }
}

void EveryTriangle::follow(const SharedBody& body, const TopologyChange&) {
  moved({body.mesh, body.positions_world_m(), body.id});
}

void EveryTriangle::moved(const SurfaceView& view) {
  bounds_ = Box3();
  each(view, [&](TriangleId t) { bounds_.extend(box_of(view.corners(t))); });
}

std::vector<SurfaceHit> EveryTriangle::hits(const SurfaceView& view, const Vec3& p, const Vec3& q) const {
  std::vector<SurfaceHit> found;
  each(view, [&](TriangleId t) {
    if (auto hit = hit_triangle(view, t, p, q)) found.push_back(*hit);
  });
  sort_hits(found);
  return found;
}

std::optional<SurfaceHit> EveryTriangle::first_hit(const SurfaceView& view, const Vec3& p, const Vec3& q) const {
  const std::vector<SurfaceHit> found = hits(view, p, q);
  return found.empty() ? std::nullopt : std::optional(found.front());
}

bool EveryTriangle::inside(const SurfaceView& view, const Vec3& point) const {
  std::size_t crossings = 0;
  each(view, [&](TriangleId t) { crossings += cross_ray(point, Vec3(10, 0, 0), view.corners(t)).has_value(); });
  return crossings % 2 == 1;
}

std::optional<ClosestSurfacePoint> EveryTriangle::closest(const SurfaceView& view, const Vec3& point,
                                                          double within_m) const {
  std::optional<ClosestSurfacePoint> best;
  double limit = within_m * within_m;
  each(view, [&](TriangleId t) {
    const ClosestPoint c = closest_on_triangle(point, view.corners(t));
    if (c.squared_distance > limit || (best && c.squared_distance == limit)) return;
    limit = c.squared_distance;
    best = ClosestSurfacePoint{t, c.bary, c.point, std::sqrt(limit)};
  });
  return best;
}

void EveryTriangle::near_segments(const SurfaceView& view, std::span<const Vec3> points,
                                  std::span<const std::array<std::size_t, 2>> segments, double reach_m,
                                  std::vector<TriangleId>& out) const {
  out.clear();
  const Vec3 reach = Vec3::Constant(reach_m + 1e-9);
  each(view, [&](TriangleId t) {
    const Box3 box = box_of(view.corners(t));
    const Box3 reached(box.min() - reach, box.max() + reach);
    if (std::ranges::any_of(segments, [&](const auto& s) { return overlaps(points[s[0]], points[s[1]], reached); }))
      out.push_back(t);
  });
}

}  // namespace sectio::test
