// The values that pass between the instruments, a cutting engine and the commit of a body: what moves and enters, what
// is planned, and what the rest of the simulation knows of a cut. An engine keeps everything else by itself.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "common/delta/topology_delta.h"
#include "sim_server/surface/cutting/blade_place.h"
#include "sim_server/surface/cutting/islands.h"

namespace sectio {

// The motion of one instrument in this body in this step.
struct BladeMotion {
  std::uint32_t edge_id = 0;
  std::vector<Blade> path;  // poses since the last step in order; empty: the instrument stays where it was
  bool lift = false;        // the cut ends here, whatever the path
  // The triangles that the blade sweeps over, or that the poses of its line cross, as the collision engine found them.
  std::vector<TriangleId> active = {};
  Pose frame_world = {};         // the body's rest shape around the blade
  bool has_dragged_end = false;  // since its last cut the blade took the end of the cut along
};

// Null when the instrument does nothing here.
const BladeMotion* motion_of(std::span<const BladeMotion> motions, std::uint32_t edge_id);

// The point at which an instrument breaks the surface, as the collision engine found it.
struct Entry {
  std::uint32_t edge_id = 0;
  TriangleId triangle = kNone;
  Vec3 bary = Vec3::Constant(1.0 / 3);

  template <class A>
  void archive(A& a) {
    a(edge_id, triangle, bary);
  }
};

// No blade enters, moves or is lifted: the cuts stay as they are.
bool all_wait(std::span<const Entry> entries, std::span<const BladeMotion> motions);

// The place of an edge in the tissue.
struct CutPoint {
  bool cuts = false;                  // a cut is under way; else the edge is in the tissue and waits
  std::optional<Vec3> point_world_m;  // the edge enters the surface here; none: the surface has changed there
  std::optional<Vec3> rest_body_m;    // the end of the cut at rest
  Vec3 normal_body = Vec3::Zero();    // normal of the surface there at rest; zero: unknown
  VertexId near = kNone;              // a vertex of the tissue around the edge
  VertexId follows = kNone;           // a vertex that goes along with an edge that can't cut
  std::optional<Blade> blade;         // the last pose at which it cut
  double owed_m = 0;                  // from the end of the cut to the blade, which the cut can't follow
};

// A place between the lips of an open cut.
struct InOpenCut {
  Vec3 point_world_m = Vec3::Zero();  // the line of a blade enters the lid over the groove here
  TriangleId beside = kNone;          // skin at a lip
};

enum class StrokeEnd : std::uint8_t {
  going,    // nothing ended
  lifted,   // the blade is out of the tissue
  through,  // there is no tissue ahead of the blade any more
  joined,   // ran into another cut, or into its own
  refused,  // no valid subdivision
};

// Vertices that a delta, which has been applied to the mesh, has removed. Ascending.
std::vector<VertexId> gone_with(const TopologyDelta& delta, const TriangleMesh& mesh);

inline constexpr std::string_view kChangedBeneath = "the surface has changed under the cut";

// The end of a stroke's part of a plan. The stroke goes on if the plan still has it.
struct StrokeOutcome {
  std::uint32_t edge_id = 0;
  StrokeEnd end = StrokeEnd::going;
  std::string_view why = {};  // reason of a refusal, for a person
};

// A loop that was closed, and freed nothing.
struct KeptIsland {
  std::uint32_t edge_id = 0;
  std::string_view why;  // for a person
};

// The state of an engine after a plan. The engine gets it back when the plan has been accepted; nobody else knows what
// is in it.
struct CutTicket {
  virtual ~CutTicket() = default;
};

struct CutPlan {
  TopologyDelta delta;                                  // empty(): the topology doesn't change
  std::vector<std::pair<VertexId, VertexState>> seeds;  // state to set once the delta is applied
  std::vector<StrokeOutcome> outcomes;
  std::vector<std::uint32_t> going_on;  // edges that stay in the tissue
  std::vector<Island> islands;
  std::vector<KeptIsland> kept_islands;
  std::uint32_t refused = 0;                // cuts for which there was no valid subdivision
  std::shared_ptr<const CutTicket> ticket;  // none: the engine has nothing to remember
};

}  // namespace sectio
