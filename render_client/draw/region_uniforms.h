// Regions (common/material/regions.h) as the shaders of skin and walls take them, and the same function in their
// language: shaders::kRegions.
#pragma once

#include <array>
#include <span>

#include "common/material/regions.h"

namespace sectio {

// Parts lie in the order of their regions; within one, tubes, then ellipsoids, then boxes.
struct RegionUniforms {
  int count = 0;
  std::array<std::array<int, 3>, kMaxRegions> part_end{};     // of a region: after its tubes, ellipsoids, boxes
  std::array<Vec4f, kMaxRegionParts> part_a, part_b, part_q;  // xyz and radius, twice; orientation
  std::array<Vec4f, kMaxRegions> colour, grain, rim;          // linear light; and rim_m, ripple_m, nothing
};

// Parts and regions beyond what shaders take are left out; flaw_of() has refused them before.
RegionUniforms pack(std::span<const Region> regions);

namespace shaders {

constexpr const char* kRegions = R"(
const int kMaxRegions = 16;
const int kMaxParts = 32;
uniform int region_count;
uniform ivec3 part_end[kMaxRegions];
uniform vec4 part_a[kMaxParts];
uniform vec4 part_b[kMaxParts];
uniform vec4 part_q[kMaxParts];
uniform vec4 region_colour[kMaxRegions];
uniform vec4 region_grain[kMaxRegions];
uniform vec4 region_rim[kMaxRegions];

vec3 wave(vec3 t) {
  vec3 v = 2.0 * fract(t) - 1.0;
  return 4.0 * v * (1.0 - abs(v));
}
float ripple_at(vec3 x) {
  vec3 p = x / 0.014, q = x / 0.006 + vec3(0.15, 0.3, 0.45);
  return (0.65 * dot(wave(p), wave(p.yzx + 0.25)) + 0.35 * dot(wave(q), wave(q.yzx + 0.25))) / 3.0;
}

float tube_m(int i, vec3 x) {
  vec3 axis = part_b[i].xyz - part_a[i].xyz, from = x - part_a[i].xyz;
  float s = clamp(dot(from, axis) / max(dot(axis, axis), 1e-12), 0.0, 1.0);
  return length(from - s * axis) - mix(part_a[i].w, part_b[i].w, s);
}
vec3 in_part(int i, vec3 x) {
  vec3 p = x - part_a[i].xyz, u = -part_q[i].xyz;
  return p + 2.0 * cross(u, cross(u, p) + part_q[i].w * p);
}
float ellipsoid_m(int i, vec3 x) {
  vec3 q = in_part(i, x) / part_b[i].xyz;
  float k = length(q), slope = length(q / part_b[i].xyz);
  return slope > 1e-6 ? k * (k - 1.0) / slope : -min(part_b[i].x, min(part_b[i].y, part_b[i].z));
}
float box_m(int i, vec3 x) {
  vec3 d = abs(in_part(i, x)) - part_b[i].xyz;
  return max(d.x, max(d.y, d.z));
}

// `around` where there is no region. Borders are as sharp as a pixel, a little darker inside. grain: 0 to 1; shade:
// about 1.
vec3 tissue_at(vec3 x, vec3 around, float grain, float shade) {
  float ripple = ripple_at(x);
  vec3 tissue = around;
  int i = 0;
  for (int r = 0; r < region_count; ++r) {
    float d = 1e9;
    for (; i < part_end[r].x; ++i) d = min(d, tube_m(i, x));
    for (; i < part_end[r].y; ++i) d = min(d, ellipsoid_m(i, x));
    for (; i < part_end[r].z; ++i) d = min(d, box_m(i, x));
    d -= region_grain[r].w * ripple;
    float pixel_m = max(fwidth(d), 1e-7);
    vec3 own = mix(region_colour[r].rgb, region_grain[r].rgb, grain) * mix(0.7, 1.0, smoothstep(0.0, 0.0015, -d));
    float rim = region_colour[r].w;
    own = mix(own, region_rim[r].rgb, rim > 0.0 ? clamp(0.5 + (d + rim) / pixel_m, 0.0, 1.0) : 0.0);
    tissue = mix(tissue, shade * own, clamp(0.5 - d / pixel_m, 0.0, 1.0));
  }
  return tissue;
}
)";

}  // namespace shaders
}  // namespace sectio
