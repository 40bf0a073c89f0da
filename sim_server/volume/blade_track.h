// The tracks of blades in a volume, in its shape at rest.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sim_server/surface/cutting/cut_plan.h"
#include "sim_server/surface/cutting/mesh_draft.h"
#include "sim_server/volume/slit.h"
#include "sim_server/volume/volume_front.h"

namespace sectio {

// A blade in the tissue, and where it goes through the surface.
struct BladeInTissue {
  std::uint32_t edge_id = 0;
  std::array<VertexId, 3> v{kNone, kNone, kNone};
  Vec3 bary{1, 0, 0};
  std::optional<Blade> blade;  // the last pose at which it cut

  Vec3 position_world_m(const MeshDraft& surface) const {
    return bary[0] * surface.position(v[0]) + bary[1] * surface.position(v[1]) + bary[2] * surface.position(v[2]);
  }

  template <class A>
  void archive(A& a) {
    a(edge_id, v, bary, blade);
  }
};

// The places of one edge since its cut began or it left a slit, as far back as a sheet reaches.
struct BladeTrack {
  std::vector<BladeEdge> edges;          // the newest last
  double most_share = 0;                 // this much of the edge has been in tissue
  BladeEdge open_to;                     // how far the tissue is open, or where the track began
  Vec3 forward = Vec3::Zero();           // the blade went this way then, across its edge; zero: nowhere yet
  bool is_at_entry = false;              // it reaches back to where the blade went through the surface
  bool is_at_front = false;              // it reaches back to the end of a front that was left open for good
  bool has_front = false;                // the tissue there is open for the time being
  bool tissue_ends = false;              // just ahead of the blade
  bool is_through = false;               // the tissue has been cut to its end
  bool turns = false;                    // it has left the direction of its front, and may come to a corner
  bool is_in_slit = false;               // the slit was open before the blade came
  bool arrives = false;                  // with fronts: it has come across to a slit in this step, and is open up to it
  BladeEdge came_into_slit;              // the blade was here when it came into it
  Pose frame_world;                      // the tissue around the blade
  double since_cut_m = 0;                // how far the blade has gone forward from `open_to`
  double next_cut_m = 0;                 // the next cut is tried when it has gone this far
  std::vector<VertexId> front_vertices;  // vertices of the front
  std::vector<VertexId> vertices_near;   // around the blade; the next cut begins its search there

  // The blade is here now. `same_m`: places this close to each other, across the edge, are one.
  void add(const BladeEdge& edge, double same_m);
  // A blade that is put down where it went in, within `same_m` across its edge, has cut there as deep as it is now.
  void deepen_entry(double same_m);
  // With fronts: a blade that has gone down from where it went in begins its cut there. A sheet from the skin on would
  // be slanted, and nick the skin beside the cut.
  void begin_deeper();
  // The track begins anew at a place: nothing is left to cut there, or the blade has left its front.
  void restart_from(const BladeEdge& place);
  // The same at the end of its front, which is left open for good.
  void go_on_from_front(const Tissue& tissue);
  // With fronts: a blade that comes into a slit here has come to it through tissue, from one side.
  bool comes_across(const Tissue& tissue, const SlitPlane& plane, const BladeEdge& edge) const;
  // Without fronts: elements at the end of a slit have been cut in part. A blade that turns there, and has not gone
  // back, first finishes them along the way that it came.
  bool turns_at_end(const Tissue& tissue, const BladeEdge& edge) const;
  bool is_due() const { return !turns && edges.size() > 1 && since_cut_m > next_cut_m; }
  // The advance across the edge of the end that is ahead; with fronts, negative when it went back by more than one cut
  // interval.
  double ahead_m(const Tissue& tissue) const;
  // With a front: the blade has gone from where the tissue is open, in a direction that isn't the front's.
  bool turns_aside() const;
  // The edge with each end where it is, or, for an end that has gone back, where the tissue is open. Around a neck that
  // turns, an end may go back and aside, and what lies aside has been cut.
  BladeEdge furthest(const Tissue& tissue) const;
  // The way from the oldest place, or from where the blade has turned back, to the furthest; with the places where it
  // bends. Without fronts an element is cut when the blade has gone through it, along the way that it went; a front is
  // short, and flat.
  std::vector<BladeEdge> way(const Tissue& tissue) const;
  // The share of an edge that is in the tissue or a little above it: in the air an edge may turn as it likes.
  double share_in_tissue(const Tissue& tissue, const BladeEdge& edge) const;
  // With fronts: the edge up to where it leaves the tissue, or as much of it as has been in tissue. Without fronts: the
  // whole edge, as its part is found when a sheet is cut, from all that is around it then.
  BladeEdge part_of(const Tissue& tissue, const BladeEdge& edge);
  // The edges, each cut off where the newest one leaves the tissue.
  std::vector<BladeEdge> in_tissue(const Tissue& tissue) const;
  // The blade has left its front: it has turned round and is back in its slit, or beside the slit, because tissue has
  // swung; what lies between has been cut all the same. Or it goes on from its front around a corner, which a flat
  // front that follows it would cut off.
  enum class Beyond { nowhere, behind, beside, around_corner };
  Beyond beyond_front(const Tissue& tissue) const;

  template <class A>
  void archive(A& a) {
    a(edges, most_share, open_to, forward, is_at_entry, is_at_front, has_front, tissue_ends, is_through, turns,
      is_in_slit, arrives, came_into_slit, frame_world, since_cut_m, next_cut_m, front_vertices, vertices_near);
  }
};

// The tracks of all blades in a volume, and the front that they have opened.
struct BladeTracks {
  std::map<std::uint32_t, BladeTrack> by_edge;  // edge_id
  std::shared_ptr<const VolumeFront> front;     // nullptr: nothing is open for the time being
  Slit slit;                                    // without the front's vertices

  // A track that begins at a point of the surface. Tissue that the blade has pressed in springs back over it: the track
  // begins where the blade would be without that.
  void begin(const Tissue& tissue, const MeshDraft& surface, const BladeInTissue& at, const BladeMotion* motion);
  void extend(const Tissue& tissue, const BladeMotion& motion);
  // The open fronts stay open for good.
  void finalise_fronts();
  std::vector<VertexId> without_front(const std::vector<VertexId>& vertices) const {
    return front ? front->without_front(vertices) : vertices;
  }
  template <class Pred>
  void forget_vertices(const Pred& is_gone) {
    slit.forget_vertices(is_gone);
    for (auto& [edge_id, track] : by_edge) std::erase_if(track.vertices_near, is_gone);
  }
  template <class A>
  void archive(A& a) {
    a(by_edge, front, slit);
  }

 private:
  struct EdgeNearSlit {
    BladeEdge edge;
    std::optional<SlitPlane> plane;
    bool is_in_slit = false;
  };
  EdgeNearSlit edge_near_slit(const Tissue& tissue, const TissueAround& around_blade, const Blade& blade,
                              bool was_in_slit) const;
  TissueAround around(const Tissue& tissue, const Blade& blade, const Pose& otherwise_world, BladeTrack& track) const;
};

}  // namespace sectio
