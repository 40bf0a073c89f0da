// Input and output of a step of the simulation: plain values, no socket, clock or file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/delta/topology_delta.h"
#include "common/math/contact_model.h"
#include "common/math/types.h"
#include "common/messages/session.h"
#include "common/messages/tool.h"

namespace sectio {

struct StepInput {
  // All samples since the last step: each once, for each tool in order of sequence (SampleDeduplicator). The instrument
  // is swept through all of them.
  std::vector<ToolSample> samples;
  // Instruments for which nobody speaks any more: each leaves the tissue along its own axis, and is gone until its next
  // sample. One that has a sample in this step stays.
  std::vector<std::uint32_t> withdrawn = {};
  // The session is behind its clock: bodies that no instrument touches stay as they are in this step.
  bool spare_idle_bodies = false;
  // Gravity turns there from now on: somebody tilts the patient.
  std::optional<Vec3> gravity_m_per_s2 = {};
  std::string overrun;  // the session's answer to it, when that has changed: becomes an event; else empty
};

struct BodyDelta {
  std::uint32_t body_id = 0;  // index into Scene::bodies; from there on, parts in the order in which they came off
  TopologyDelta delta;
};

// A part that came off and is a body from now on, at revision 0. The same step has the delta that freed its slots in
// the parent.
struct NewBody {
  std::uint32_t body_id = 0;
  std::uint32_t parent_id = 0;
  std::string name;
};

// Two bodies of which one lies in the other; or a body of which a loose part has sunk into the rest.
struct BodyOverlap {
  std::uint32_t one = 0, other = 0;  // the same: the vertices are those of skin
  double deepest_m = 0;              // how far beneath the other's surface
  std::size_t come_through = 0;      // vertices of either that have gone right through the other, or a wall of it
};

enum class EventKind : std::uint8_t {
  contact_began,
  contact_ended,
  penetrated,         // contact -> penetration: the cut began
  cut_ended,          // the instrument was lifted
  joined,             // a cut ran into the end of another, or of itself
  island_freed,       // a loop was closed and its inside parted
  cut_refused,        // the mesh is as before; the text says why
  step_overrun,       // the session is behind its clock; the text says what it does about it
  body_frozen,        // the body is in trouble again and again, and stays in its last good state for a while
  body_split,         // a part came off and is a body of its own
  fragment_removed,   // a part below the stated size
  grasped,            // jaws hold a piece, or tissue
  released,           // the text says why: opened, slipped, cut away
  driver_taken_over,  // a step was beyond what the explicit driver of a volume can do safely: the implicit one goes on
  driver_handed_back,
  gravity_turned,        // it begins to, or to elsewhere; the text says where to
  instrument_withdrawn,  // nobody speaks for it any more
  recording_stopped,     // a file of the session can't be written any more; the text says why
  body_recovered,        // it was in trouble, and is mended; the text says how, and why
  body_thawed,           // a frozen body is free again
  mass_added,            // more than 5 % of a body's mass has been added for stability
  force_capped,          // the reaction on an instrument was beyond what its hand may feel
  paused,                // by an order, like those that follow; the text is for a person
  went_on,
  speed_set,
  begun_anew,  // bodies are as they were at first
  score_told,
  sought,             // the played session goes on from another time
  did_not_cut,        // a blade is in tissue where its body has no cut for it; the text says why
  left_world,         // the body fell or slid so far that it is out of every picture, and stays there
  instrument_frozen,  // by an order: it stays where it is, whatever its hand does
  instrument_thawed,  // by an order: it is taken out, and follows its hand again
  order_refused,      // nothing has changed; the text has the order's name, and why
  island_kept,        // a loop was closed, and freed nothing; the text says why
};
const char* to_string(EventKind kind);

struct Event {
  std::uint64_t step = 0;
  EventKind kind = EventKind::contact_began;
  std::uint32_t body_id = 0;
  std::uint32_t tool_id = 0;
  std::string text;  // for a person; may be empty
};

// How the driver of a body fares.
struct DriverFigures {
  double added_mass_fraction = 0;    // added mass over the mass of the tissue
  double residual = 0;               // if the last step was implicit: force left over, over the weight
  std::uint64_t steps_not_met = 0;   // implicit steps so far whose residual was above the tolerance
  double largest_speed_m_per_s = 0;  // any vertex, so far

  template <class A>
  void archive(A& a) {
    a(added_mass_fraction, residual, steps_not_met, largest_speed_m_per_s);
  }
};

// Numbers of one step, for ServerStatus and report.json.
struct StepReport {
  double stability_margin = 1;     // largest stable step over the step taken, least over the bodies
  double added_mass_fraction = 0;  // mass added by selective mass scaling, over the mass of the tissue
  std::uint64_t cuts_made = 0;     // deltas by cuts so far
  std::uint64_t cuts_refused = 0;
  std::uint64_t edges_collapsed = 0;  // short edges, left by cuts, that have collapsed so far
  double removed_volume_m3 = 0;       // rest volume of the fragments removed so far
  double penetration_m = 0;           // depth of pressing instruments beneath the surface, after this step
  double instrument_work_j = 0;       // work on deforming bodies so far, including that of cutting
  std::uint32_t bodies_asleep = 0;    // bodies that rest and are not stepped
  std::uint64_t forces_capped = 0;    // steps of instruments so far in which a reaction was beyond what they may feel
  double contact_time_s = 0;          // simulated time so far with any instrument in contact
  std::uint64_t global_searches = 0;
  std::uint64_t local_searches = 0;
  std::vector<BodyCheck> checks;       // one a body
  std::vector<DriverFigures> drivers;  // one a body
  std::vector<double> processor_s;     // processor's time of each body so far, if it is measured

  template <class A>
  void archive(A& a) {
    a(stability_margin, added_mass_fraction, cuts_made, cuts_refused, edges_collapsed, removed_volume_m3, penetration_m,
      instrument_work_j, bodies_asleep, forces_capped, contact_time_s, global_searches, local_searches, checks, drivers,
      processor_s);
  }
};

struct StepOutput {
  std::uint64_t step = 0;
  double sim_time_s = 0;
  std::vector<BodyDelta> deltas;       // in the order in which they were applied
  std::vector<NewBody> new_bodies;     // in order of body_id
  std::vector<ContactModel> contacts;  // one a tool that has a device
  std::vector<Event> events;
  Vec3 gravity_m_per_s2{0, 0, -9.81};         // gravity in this step
  Vec3 gravity_target_m_per_s2{0, 0, -9.81};  // gravity turns to this
  bool publish_now = false;  // contact just began: viewers must not wait for the frame rhythm (paper A, 2.1)
  StepReport report;
};

// The next step begins: lists of the last one are empty, sums go on.
void begin_step(StepOutput& output, double step_s);

// The gap between a surface and an instrument that presses it (paper A, figures 4 and 5). For measurements; no step
// needs it.
struct ContactGap {
  double depth_m = 0;  // the point that presses, beneath the undeformed surface
  // Largest distance between the instrument and the surface, along the normal, over points at least half as deep.
  // Points further out leave the dent whatever the way of contact.
  double gap_m = 0;
};

}  // namespace sectio
