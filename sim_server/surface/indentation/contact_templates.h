// Deformation templates (paper A, section 2.2, figures 2 and 3): while instruments press, the touched faces get new
// particles that follow the shape of the instrument; no original particle is moved. Pure functions on a draft.
//
// Contact templates are temporary. The inverse keeps the elements that they replace (inactive, not deleted), and
// release() puts these back into their slots bit for bit. Particles have their rest positions on the undeformed face,
// so that springs pull them back.
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "sim_server/surface/cutting/sweep_path.h"

namespace sectio {

// The template for a face under the instrument.
struct ContactTemplate {
  int active_edges = 0;
  int vertices_inside = 0;  // vertices of the instrument in the face
  bool coincident = false;  // both new particles coincide: only one is made
  const char* figure = "";
  int particles = 0;
  int triangles = 0;  // these replace the face
  int springs = 0;    // between particles and corners within the face
  int halved = 0;     // springs of active edges that are divided
};
std::span<const ContactTemplate> contact_templates();
// There is at most one tip with one active edge, none with two edges, and one or two with no edge. Faces that are
// touched by more of an instrument, or by several, are divided by the same operations, one particle after the other.
const ContactTemplate& contact_template_for(int active_edges, int vertices_inside, bool coincident);

struct PressSettings {
  double least_ratio = 0.05;  // no particle is nearer to a corner (ratio of the edge) or to an edge (barycentric)
  double coincidence = 0.08;  // particles closer than this ratio of the face's longest edge are one
  double least_move = 0.01;   // a contact that slides by less (ratio, as before) leaves the particle's place at rest
};

// A place of the original surface that an instrument touches, and the point at which the instrument wants it.
struct ContactPoint {
  PathPoint place;  // on_edge or in_face
  Vec3 target_world_m = Vec3::Zero();
  Vec3 normal_world =
      Vec3::Zero();         // out of the tissue; points not further out than the target are left alone; zero: none are
  std::uint32_t owner = 0;  // number of the instrument
  bool presses = true;      // false: it has let go, the particle is on its way home

  template <class A>
  void archive(A& a) {
    a(place, target_world_m, normal_world, owner, presses);
  }
};

struct HeldParticle {
  VertexId vertex = kNone;
  Vec3 target_world_m = Vec3::Zero();
  std::uint32_t owner = 0;
};

// All instruments' temporary elements in one body.
struct TemporaryContact {
  std::vector<ContactPoint> points;  // after coincident ones have been merged
  std::vector<VertexId> particles;   // one for each point
  std::optional<TopologyDelta> inverse;

  template <class A>
  void archive(A& a) {
    a(points, particles, inverse);
  }
};

enum class ContactChange : std::uint8_t {
  displaced,  // the templates stay: only particles move
  exchanged,  // the templates have changed, or are the first
  refused,    // there is no valid subdivision; nothing has changed
};

struct Press {
  ContactChange change = ContactChange::displaced;
  // Particles to hold at their targets for one step; nothing remembers them beyond it. A particle that instruments
  // share is named once for each of them; the first particle of an owner belongs to the first of the owner's points.
  std::vector<HeldParticle> held;
};

// The draft without the contact's elements. Contact points refer to it, so that touching the new faces counts as
// touching the old ones. Nothing if the mesh has changed under the contact.
std::optional<MeshDraft> without(const MeshDraft& draft, const TemporaryContact& contact);

// The state of a place of the original surface.
VertexState state_at(const MeshDraft& original, const PathPoint& place);

// Presses at the given points, ordered by instrument, the most important first. Points whose face or edge the original
// surface no longer has are left out. Particles that are pushed are put to their targets and stop there.
Press press(MeshDraft& draft, TemporaryContact& contact, std::span<const ContactPoint> points,
            const PressSettings& settings);

// Gives the faces their shape back. False when the mesh has changed under the contact.
[[nodiscard]] bool release(MeshDraft& draft, TemporaryContact& contact);

}  // namespace sectio
