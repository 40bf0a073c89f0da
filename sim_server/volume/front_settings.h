// The settings of tracks and fronts that a scene or the engine may set; numeric tolerances stand where they are used.
// Lengths whose names end in `_edges` are in mean lengths of an edge of the volume.
#pragma once

#include <cstddef>

#include "sim_server/volume/tets/tet_cut.h"

namespace sectio {

struct FrontSettings {
  TetCutSettings tets;  // semi_progressive: no fronts

  // When a blade cuts.
  double cut_every_edges = 0.5;      // without fronts: it goes this far between two cuts
  double follow_every_edges = 0.05;  // with fronts: it goes this far before its front is made anew
  double retry_after_edges = 0.1;    // it goes this far after a cut that could not be made
  double give_up_after_edges = 0.5;  // a front that could not be made anew for this far stays as it is

  // The sheet that it cuts along.
  double close_edges = 0.01;       // vertices this close to the sheet are on it
  double overlap_edges = 0.25;     // the sheet begins this far behind the track
  double half_cut_edges = 1.0;     // without fronts and with a slit: elements at its end have been cut in part
  double lag_edges = 0.05;         // a front ends this far behind the blade, which touches what it cuts next
  double thread_edges = 0.5;       // tissue ahead, this thin and with nothing behind it, is cut together with the rest
  double joined_edges = 1.0;       // vertices of a slit this close to the blade join the sheet
  double joined_behind_edges = 3;  // without fronts, vertices this far behind the sheet join it, too
  double joined_beside_edges = 0.5;    // only vertices this close to the sheet's plane join it, where it goes on
  double joined_end_edges = 0.25;      // vertices this close to the end of a front join the sheet that begins there
  double joined_crossing_edges = 0.1;  // only vertices this close to it join it, where it crosses the slit
  double longest_sheet_edges = 8;      // a sheet is flat, a track is not
  // Without fronts a sheet bends where the track lies this far beside it, in pieces at least this long,
  double bend_edges = 0.5, least_piece_edges = 0.25;
  // or where the track lies this far beside it, and so many times as far as a place of the track from the last.
  double smooth_bend_edges = 0.1, bend_jumps = 4;
  double above_edges = 1;           // without fronts, a sheet reaches this far above the tissue
  double same_place_edges = 0.1;    // without fronts: a blade that slides along its edge stays at a place by so much
  double behind_edges = 2.75;       // without fronts a sheet reaches this far back, into what was cut in part
  double front_behind_edges = 0.5;  // and with fronts, since the tissue is open so far

  double deepest_dent_edges = 1;  // a blade that breaks in has pressed the tissue in by so much at most

  // A blade that has turned round leaves its front behind when it is further than this from it.
  double left_beside_edges = 0.3;
  double left_behind_edges = 1.0;
  double corner_after_edges = 0.25;  // so does one that has gone this far around a corner

  // A blade this close to a slit is in it, and stays in it.
  double slit_edges = 0.25, slit_left_edges = 0.4;
  double turn_edges = 0.5;   // without fronts: one that has gone so far back at most has not left the end of its cut
  double strip_edges = 0.5;  // a slit is remembered in strips of this length
  double lid_edges = 1;      // lips that gape belong to the slit when the place between them is this close to it
  double slit_closed_edges = 0.6;  // lips that have closed in on a blade lie over it by so much at most

  // Tissue this far beside a slit belongs to a side of it; what connects the sides is looked for so far from it.
  double bridge_side_edges = 0.5, bridge_beside_edges = 1.0;

  // The tissue around a blade, whose motion takes the track along.
  double around_edges = 2;
  std::size_t fewest_vertices_around = 8;

  // Bounds that a cut must keep.
  double crumb_cubic_edges = 0.12;      // volume of an element
  double least_half_cubic_edges = 10;   // volume of a part that can lie against the blade that has cut it off
  double least_kept_area_ratio = 0.97;  // over the area that a front had opened, when it is made anew
  int pinch_rounds = 3;                 // edges are opened that opening others has pinched, this often

  bool follows_blade() const { return !tets.semi_progressive; }
  double joined_reach_edges() const { return follows_blade() ? joined_edges : joined_behind_edges; }
  double next_cut_edges() const { return follows_blade() ? follow_every_edges : cut_every_edges; }
};

}  // namespace sectio
