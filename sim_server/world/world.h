// The state that a simulation keeps from one step to the next: the bodies, the instruments, and the contact of each
// edge of an instrument with each body. The stages of a step (sim_server/step/) change it; commit() (step/commit.h) is
// the only way to change the topology of a body.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <memory>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "common/messages/session.h"
#include "sim_server/world/body.h"
#include "sim_server/world/edge_contact.h"
#include "sim_server/world/model_check.h"
#include "sim_server/world/stuck_points.h"
#include "sim_server/world/tool.h"
#include "sim_server/world/turning_gravity.h"

namespace sectio {

// One engine between bodies, and the bodies that it sees.
struct Interaction {
  std::unique_ptr<WorldEngine> engine;
  std::vector<std::uint32_t> bodies;  // in the order in which the scene names them, then parts

  bool covers(std::uint32_t body_id) const { return std::ranges::find(bodies, body_id) != bodies.end(); }
};

struct SimulatedWorld {
  // Throws InputError when a body has no engines, or when its step is beyond the stable one.
  SimulatedWorld(const Scene& scene, const EngineTable& engines);

  // The specification of the next part that comes off a body.
  const BodySpec& add_part_spec(Body& parent, bool anchored);
  // Adds a part that came off, with the next id, and with edge contacts, a check and processes of its own, while the
  // parent still has it. For welcome_part() (step/commit.h), which tells everyone else.
  void add_part(std::unique_ptr<Body> part, Body& parent, std::span<const VertexId> vertex_from);
  // Writes or reads all that is kept from step to step; a world reads it before its first step.
  void archive(Archive& a);
  // Both are held, and the surfaces of the bodies of the scene that they are, or came off, reached into each other from
  // the beginning.
  bool are_nested(const Body& one, const Body& other) const;
  std::vector<BodyOverlap> overlaps() const;  // but for nested ones
  // An engine between bodies moves the particles of this body.
  bool is_moved_from_outside(std::uint32_t body_id) const;
  // The fields that the engines of a body publish now.
  std::vector<ScalarField> scalars(std::uint32_t body_id);

  EdgeContact& contact(std::uint32_t body_id, std::uint32_t edge_id) {
    return contacts[body_id * edges.size() + edge_id];
  }
  std::span<EdgeContact> contacts_of(std::uint32_t body_id) {
    return std::span(contacts).subspan(body_id * edges.size(), edges.size());
  }
  Tool& tool_of(std::uint32_t edge_id) { return tools[edges[edge_id].tool_id]; }

  Scene scene;  // its gravity is that of the current step
  TurningGravity gravity;
  std::vector<std::unique_ptr<Body>> bodies;  // bodies of the scene, then parts in the order in which they came off
  std::deque<BodySpec> part_specs;            // a deque, since bodies refer to their specifications
  std::vector<Tool> tools;
  struct Edge {
    std::uint32_t tool_id = 0;
    std::size_t index = 0;  // among the edges of the tool
  };
  std::vector<Edge> edges;                // edges of all tools; engines that cut know each by its index here, edge_id
  std::vector<EdgeContact> contacts;      // a row a body, a column an edge
  std::vector<ModelCheck> checks;         // one a body
  std::vector<Interaction> interactions;  // engines between bodies, in the order of the processes of the scene
  StuckPoints stuck;                      // between bodies that deform
  std::size_t most_bodies = kMaxBodies;   // a session announces no more; parts that come off beyond stay
  double contact_work_j = 0;              // by instruments on bodies, pressing and holding, so far

 private:
  // The origin of a part that came off.
  struct Origin {
    std::uint32_t parent_id = 0, number = 0;  // it was the n-th one that came off
    bool anchored = false, rigid = false;
    Pose frame_at_first_world;

    template <class A>
    void archive(A& a) {
      a(parent_id, number, anchored, rigid, frame_at_first_world);
    }
  };
  void add(std::unique_ptr<Body> part, Body& parent, std::span<const VertexId> vertex_from, bool is_unread);
  void add_contacts(Body& body);
  void add_processes();

  void find_nested();
  std::uint32_t family_of(std::uint32_t body_id) const;  // the body of the scene that it is, or came off

  EngineTable engines_;
  std::set<std::pair<std::uint32_t, std::uint32_t>> nested_;  // families
  std::vector<Origin> origins_;                               // origins of the parts, in their order
  std::vector<std::vector<const ProcessSpec*>>
      processes_in_;  // by body: those that the scene names, the last ones of it
};

}  // namespace sectio
