// The motions of blades and probes over the organs of the scenes, as a table.
#pragma once

#include <array>
#include <vector>

#include "deploy/meshes/shapes.h"

namespace sectio {

using Path = std::vector<Vec3>;  // in the body frame, seen from above; only x and y count

struct Stroke {
  Path through;
  bool closed = false;
  double overlap_m = 0;  // closed: how far the blade goes on past the start
};

struct Motion {
  const char* name;
  double (*shape)(const Vec3&);
  std::vector<Stroke> strokes;
  double depth_m;           // the tip, below the skin while cutting; a hook: its virtual tip reaches deeper
  double speed_m_per_s;     // along the stroke
  double lean_deg;          // the shaft leans back against the stroke
  double height_m = 0.020;  // the tip, above the skin, before and after a stroke
  double hover_s = 0.4;     // at rest before the first stroke
  double press_s = 1.0;     // from the height to the depth, along the first press_run_m of the stroke
  double press_run_m = 0.0;
  double lift_s = 0.6;
  double travel_s = 1.2;        // between two strokes
  double sink_m = 0.0;          // knife: this much deeper, down to its blunt part, for a while
  double open_rad = 0.0;        // scissors: of the blades, before and after each snip
  int snips = 1;                // evenly along the stroke
  double close_s = 1.0;         // a snip
  Vec3 leave_m = Vec3::Zero();  // at the end, out of the way of other instruments
  Vec3 place_m = Vec3::Zero();  // the body's place in its scene
};

inline const Stroke kKidneyLoop{.through = {{0.017, 0.000, 0},
                                            {0.012, 0.0085, 0},
                                            {0.000, 0.012, 0},
                                            {-0.012, 0.0085, 0},
                                            {-0.017, 0.000, 0},
                                            {-0.012, -0.0085, 0},
                                            {0.000, -0.012, 0},
                                            {0.012, -0.0085, 0}},
                                .closed = true,
                                .overlap_m = 0.006};

inline const auto kMotions = std::to_array<Motion>({
    {.name = "liver_incision",
     .shape = liver,
     .strokes = {{.through = {{-0.066, -0.018, 0}, {-0.040, -0.028, 0}, {-0.012, -0.022, 0}, {0.020, 0.000, 0}}}},
     .depth_m = 0.008,
     .speed_m_per_s = 0.025,
     .lean_deg = 10},
    {.name = "kidney_loop",
     .shape = kidney,
     .strokes = {kKidneyLoop},
     .depth_m = 0.0045,
     .speed_m_per_s = 0.020,
     .lean_deg = 5,
     .leave_m = {-0.07, 0.04, 0.03}},
    {.name = "skin_cross",
     .shape = skin_pad,
     .strokes = {{.through = {{-0.035, 0.004, 0}, {0.000, 0.000, 0}, {0.035, -0.004, 0}}},
                 {.through = {{0.003, -0.035, 0}, {0.0055, 0.000, 0}, {0.003, 0.035, 0}}}},
     .depth_m = 0.006,
     .speed_m_per_s = 0.030,
     .lean_deg = 10},
    {.name = "skin_angles",
     .shape = skin_pad,
     .strokes = {{.through = {{-0.042, 0.001, 0}, {0.042, -0.001, 0}}},
                 {.through = {{-0.0365, -0.016, 0}, {-0.0180, 0.016, 0}}},
                 {.through = {{-0.0160, -0.016, 0}, {0.0160, 0.016, 0}}},
                 {.through = {{0.0060, -0.010, 0}, {0.0400, 0.0096, 0}}}},
     .depth_m = 0.006,
     .speed_m_per_s = 0.030,
     .lean_deg = 10},
    {.name = "skin_star",
     .shape = skin_pad,
     .strokes = {{.through = {{-0.026, 0.000, 0}, {0.026, 0.001, 0}}},
                 {.through = {{-0.013, -0.0225, 0}, {0.013, 0.0225, 0}}},
                 {.through = {{0.013, -0.0225, 0}, {-0.013, 0.0225, 0}}}},
     .depth_m = 0.006,
     .speed_m_per_s = 0.030,
     .lean_deg = 10},
    {.name = "skin_grid",
     .shape = skin_pad,
     .strokes = {{.through = {{-0.022, -0.012, 0}, {0.022, -0.0125, 0}}},
                 {.through = {{-0.022, 0.000, 0}, {0.022, 0.000, 0}}},
                 {.through = {{-0.022, 0.012, 0}, {0.022, 0.0125, 0}}},
                 {.through = {{-0.012, -0.022, 0}, {-0.0115, 0.022, 0}}},
                 {.through = {{0.000, -0.022, 0}, {0.0005, 0.022, 0}}},
                 {.through = {{0.012, -0.022, 0}, {0.0115, 0.022, 0}}}},
     .depth_m = 0.005,
     .speed_m_per_s = 0.030,
     .lean_deg = 10},
    {.name = "skin_parallel",
     .shape = skin_pad,
     .strokes = {{.through = {{-0.030, 0.0005, 0}, {0.030, 0.0005, 0}}},
                 {.through = {{-0.026, -0.0040, 0}, {0.026, -0.0040, 0}}}},
     .depth_m = 0.005,
     .speed_m_per_s = 0.030,
     .lean_deg = 10},
    {.name = "skin_t",
     .shape = skin_pad,
     .strokes = {{.through = {{-0.030, 0.000, 0}, {0.030, 0.001, 0}}},
                 {.through = {{0.001, 0.000, 0}, {0.003, 0.030, 0}}}},
     .depth_m = 0.006,
     .speed_m_per_s = 0.030,
     .lean_deg = 10},
    {.name = "skin_eight",
     .shape = skin_pad,
     .strokes = {{.through = {{0.024, 0.000, 0},
                              {0.012, -0.010, 0},
                              {0.000, 0.000, 0},
                              {-0.012, 0.010, 0},
                              {-0.024, 0.000, 0},
                              {-0.012, -0.010, 0},
                              {0.000, 0.000, 0},
                              {0.012, 0.010, 0}},
                  .closed = true,
                  .overlap_m = 0.004}},
     .depth_m = 0.006,
     .speed_m_per_s = 0.020,
     .lean_deg = 5},
    {.name = "skin_arcs",
     .shape = skin_pad,
     .strokes =
         {{.through = {{0.012, -0.002, 0}, {0.009, 0.009, 0}, {0.000, 0.012, 0}, {-0.009, 0.009, 0}, {-0.012, 0, 0}}},
          {.through =
               {{-0.012, 0.002, 0}, {-0.009, -0.009, 0}, {0.000, -0.012, 0}, {0.009, -0.009, 0}, {0.012, 0.002, 0}}}},
     .depth_m = 0.006,
     .speed_m_per_s = 0.020,
     .lean_deg = 5},
    {.name = "skin_two_along",
     .shape = skin_pad,
     .strokes = {{.through = {{-0.030, 0.001, 0}, {0.030, -0.001, 0}}}},
     .depth_m = 0.006,
     .speed_m_per_s = 0.030,
     .lean_deg = 10},
    {.name = "skin_two_across",
     .shape = skin_pad,
     .strokes = {{.through = {{0.002, -0.030, 0}, {0.001, 0.030, 0}}}},
     .depth_m = 0.005,
     .speed_m_per_s = 0.030,
     .lean_deg = 10},
    // The probe glides on the skin; its virtual tip, 5 mm below, cuts.
    {.name = "cautery_liver",
     .shape = liver,
     .strokes = {{.through = {{-0.050, 0.030, 0}, {-0.020, 0.020, 0}, {0.012, 0.022, 0}}}},
     .depth_m = -0.0005,
     .speed_m_per_s = 0.020,
     .lean_deg = 0},
    {.name = "probe_liver",
     .shape = liver,
     .strokes = {{.through = {{-0.040, -0.015, 0}, {-0.020, -0.022, 0}, {0.000, -0.010, 0}}}},
     .depth_m = 0.007,
     .speed_m_per_s = 0.020,
     .lean_deg = 0},
    // Almost flat on the liver, so that the side of the rod presses, too.
    {.name = "probe_liver_flat",
     .shape = liver,
     .strokes = {{.through = {{-0.020, -0.020, 0}, {-0.004, -0.014, 0}}}},
     .depth_m = 0.008,
     .speed_m_per_s = 0.012,
     .lean_deg = 65},
    {.name = "knife_liver",
     .shape = liver,
     .strokes = {{.through = {{-0.055, -0.020, 0}, {-0.030, -0.024, 0}, {0.000, -0.014, 0}}}},
     .depth_m = 0.008,
     .speed_m_per_s = 0.020,
     .lean_deg = 10,
     .sink_m = 0.006},
    {.name = "scissors_skin",
     .shape = skin_pad,
     .strokes = {{.through = {{-0.006, 0.001, 0}, {0.012, 0.001, 0}}}},
     .depth_m = 0.004,
     .speed_m_per_s = 0.030,
     .lean_deg = 0,
     .open_rad = 0.4,
     .snips = 2},
    {.name = "medical_scissors_skin",
     .shape = skin_pad,
     .strokes = {{.through = {{0.012, 0.001, 0}, {0.020, 0.001, 0}}}},
     .depth_m = 0.004,
     .speed_m_per_s = 0.030,
     .lean_deg = 0,
     .open_rad = 0.4},
    {.name = "exercise_curve",
     .shape = skin_pad,
     .strokes = {{.through = {{-0.0177, -0.0003, 0},
                              {-0.0090, -0.0023, 0},
                              {0.0000, -0.0030, 0},
                              {0.0090, -0.0023, 0},
                              {0.0177, -0.0003, 0},
                              {0.0252, 0.0025, 0}}}},
     .depth_m = 0.003,
     .speed_m_per_s = 0.030,
     .lean_deg = 0,
     .height_m = 0.017,
     .press_s = 0.5,
     .lift_s = 0.4,
     .open_rad = 0.14,
     .snips = 6,
     .close_s = 0.7},
    {.name = "exercise_disc",
     .shape = skin_pad,
     .strokes = {{.through = {{0.012, 0.000, 0},
                              {0.0085, 0.0085, 0},
                              {0.000, 0.012, 0},
                              {-0.0085, 0.0085, 0},
                              {-0.012, 0.000, 0},
                              {-0.0085, -0.0085, 0},
                              {0.000, -0.012, 0},
                              {0.0085, -0.0085, 0}},
                  .closed = true,
                  .overlap_m = 0.004}},
     .depth_m = 0.005,
     .speed_m_per_s = 0.020,
     .lean_deg = 5},
    {.name = "exercise_tumour",
     .shape = liver,
     .strokes = {{.through = {{-0.014, -0.030, 0},
                              {-0.0195, -0.0205, 0},
                              {-0.030, -0.017, 0},
                              {-0.0405, -0.0205, 0},
                              {-0.046, -0.030, 0},
                              {-0.0405, -0.0395, 0},
                              {-0.030, -0.043, 0},
                              {-0.0195, -0.0395, 0}},
                  .closed = true,
                  .overlap_m = 0.006}},
     .depth_m = 0.007,
     .speed_m_per_s = 0.020,
     .lean_deg = 5,
     .leave_m = {-0.07, 0.04, 0.03}},
    {.name = "organs_kidney",
     .shape = kidney,
     .strokes = {kKidneyLoop},
     .depth_m = 0.0045,
     .speed_m_per_s = 0.020,
     .lean_deg = 5,
     .place_m = {0.145, 0, 0}},
});

}  // namespace sectio
