// The interface of a cutting engine: it plans a step's cuts in one body, and remembers the cuts that there are.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "sim_server/engine/engine.h"
#include "sim_server/surface/cutting/cut_plan.h"

namespace sectio {

// See CuttingEngine::tidy().
struct TidyPlan {
  TopologyDelta delta;                      // empty(): the topology stays
  std::uint32_t edges_collapsed = 0;        // edges that this plan collapses
  std::shared_ptr<const CutTicket> ticket;  // nullptr: there is nothing to do
};

// How an edge cuts with an engine, for the contact of the edge with the body.
struct CutTraits {
  bool edge_cuts_anywhere = false;  // every part of the edge in the body cuts; else the cut follows the tip
  bool cuts_inside = false;         // the edge cuts all that it meets in the body, the surface being ahead of it or not
  double join_tolerance_m = 2e-3;   // the end of a cut this close to a blade belongs to that blade
  double min_step_m = 1e-4;         // the instrument moves this far before a cut opens
};

class CuttingEngine : public Engine {
 public:
  virtual CutTraits traits() const = 0;

  // Plans the cuts of a step. Changes nothing: the engine goes on with the plan when it has to accept() its ticket.
  virtual CutPlan plan(const SharedBody& body, std::span<const Entry> entries,
                       std::span<const BladeMotion> motions) const = 0;

  // A plan has been accepted: its delta, unless that is empty, has been applied. Instead of follow(), which is for
  // changes that this engine has not planned.
  virtual void accept(const SharedBody&, const CutTicket&) {}
  // The delta of a plan did not fit the body, which is as before: all strokes end where they are.
  virtual void reject() {}

  // The place of an edge in the tissue; none: the edge is in no cut of this body.
  virtual std::optional<CutPoint> cut_point(const SharedBody&, std::uint32_t /*edge_id*/) const { return {}; }
  // The place where the line of a blade enters an open cut of the body. Such a blade is in the tissue, though it
  // touches none.
  virtual std::optional<InOpenCut> in_open_cut(const SharedBody&, const Blade&) const { return {}; }
  // The length that lies outside every cut, open or closed, of a part of a blade. The part is in tissue near a vertex.
  virtual double uncut_m(const SharedBody&, const Blade& part, VertexId /*near*/) const { return part.length_m; }
  // Parts have come off, or the body is one: it has walls of cuts that uncut_m() doesn't know any more.
  virtual bool has_come_apart() const { return false; }
  // Does one of these triangles (ascending) belong to a subdivision that is temporary? That is no cut yet.
  virtual bool is_temporary(std::span<const TriangleId> /*triangles*/) const { return false; }

  // Plans a small piece of work that can wait for a step in which no instrument is at the body. Like
  // plan() it changes nothing.
  virtual TidyPlan tidy(const SharedBody&) const { return {}; }
};

}  // namespace sectio
