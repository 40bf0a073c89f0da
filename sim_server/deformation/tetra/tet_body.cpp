#include "sim_server/deformation/tetra/tet_body.h"

namespace sectio {

TetBody::TetBody(const TetMesh& mesh, const VolumeMaterial& material, std::span<const std::uint8_t> fixed)
    : mesh_(mesh),
      stars_(mesh),
      density_kg_per_m3_(material.density_kg_per_m3),
      stiffness_factor_(material.stiffness_factor),
      fixed_(fixed.begin(), fixed.end()),
      mass_(mesh.vertices_body_m.size(), 0),
      added_(mass_.size(), 0),
      inverse_mass_(mass_.size(), 0) {
  fixed_.resize(mass_.size(), 0);
  for (const Tetrahedron& t : mesh_.tetrahedra) volume_m3_.push_back(tet_volume_m3(mesh_, t));
  for (VertexId v = 0; v < mass_.size(); ++v) weigh(v);
  give_room(mesh_.vertices_body_m, mesh_.tetrahedra, volume_m3_, fixed_, mass_, added_, inverse_mass_);
  if (!stiffness_factor_.empty()) give_room(stiffness_factor_);
}

void TetBody::weigh(VertexId v) {
  total_kg_ -= mass_[v];
  added_kg_ -= added_[v];
  mass_[v] = added_[v] = 0;
  for (const std::uint32_t t : stars_.of(v)) mass_[v] += 0.25 * density_kg_per_m3_ * volume_m3_[t];
  total_kg_ += mass_[v];
  inverse_mass_[v] = fixed(v) || !(mass_[v] > 0) ? 0 : 1 / mass_[v];
}

void TetBody::weigh_at_least(VertexId v, double mass_kg) {
  if (!(mass_[v] > 0)) return;
  added_kg_ -= added_[v];
  added_[v] = std::max(0.0, mass_kg - mass_[v]);
  if (added_kg_ + added_[v] > kAddedMassGiven * total_kg_) {
    added_[v] = 0;
    refused_ = true;
  }
  added_kg_ += added_[v];
  if (!fixed(v)) inverse_mass_[v] = 1 / (mass_[v] + added_[v]);
}

void TetBody::shed_added_mass() {
  for (VertexId v = 0; v < mass_.size(); ++v) {
    added_[v] = 0;
    inverse_mass_[v] = fixed(v) || !(mass_[v] > 0) ? 0 : 1 / mass_[v];
  }
  added_kg_ = 0;
  refused_ = false;
}

std::span<const VertexId> TetBody::follow(const TetChange& change) {
  // Whether a number that has been in use before now belongs to a vertex at another place.
  const auto is_elsewhere = [&, used = mass_.size()](VertexId v) {
    return v >= change.first_added && v - change.first_added < change.added_body_m.size() && v < used &&
           mesh_.vertices_body_m[v] != change.added_body_m[v - change.first_added];
  };
  touched_.begin(std::max(mass_.size(), change.first_added + change.added_body_m.size()));
  for (const TetEdit& e : change.tetrahedra) {
    if (e.before == e.after && std::ranges::none_of(e.after, is_elsewhere)) continue;
    for (const Tetrahedron& t : {e.before, e.after})
      for (const VertexId v : t)
        if (v != kNone) touched_.insert(v);
  }
  const std::span<const VertexId> touched = touched_.sorted();
  sectio::follow(mesh_, change);
  const std::size_t vertices = mesh_.vertices_body_m.size();
  for (auto* table : {&mass_, &added_, &inverse_mass_}) resize_slots(*table, vertices, 0.0);
  resize_slots<std::uint8_t>(fixed_, vertices, 0);
  const auto added = fixed_.begin() + change.first_added;
  std::fill_n(added, change.added_body_m.size(), std::uint8_t{0});
  std::ranges::copy(change.fixed, added);
  if (!stiffness_factor_.empty()) follow_stiffness(change);
  resize_slots(volume_m3_, mesh_.tetrahedra.size(), 0.0);
  for (const TetEdit& e : change.tetrahedra)
    volume_m3_[e.id] = e.after == kNoTetrahedron ? 0 : tet_volume_m3(mesh_, e.after);
  stars_.follow(vertices, change.tetrahedra);
  for (const VertexId v : touched) weigh(v);
  return touched;
}

// All factors are read before any is written, since a number that is used again may be an origin, too.
void TetBody::follow_stiffness(const TetChange& change) {
  std::vector<double> factors;
  for (const TetEdit& e : change.tetrahedra)
    factors.push_back(e.after == kNoTetrahedron ? 1 : stiffness_factor_[e.origin]);
  resize_slots(stiffness_factor_, mesh_.tetrahedra.size(), 1.0);
  for (std::size_t k = 0; k < factors.size(); ++k) stiffness_factor_[change.tetrahedra[k].id] = factors[k];
}

}  // namespace sectio
