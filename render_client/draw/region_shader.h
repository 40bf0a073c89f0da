// Regions (common/material/regions.h) for the shaders of skin and walls: a table of uniforms, and the same function in
// GLSL (shaders::kRegions). A coarse grid over the body says which parts may be at a point, so that a fragment
// evaluates only the few that are near it.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "common/material/regions.h"

namespace sectio {

static_assert(kMaxRegionParts == 32, "a cell has a bit for each part");
constexpr int kRegionGridSize = 32;  // cells along each axis

struct RegionTable {
  int count = 0;                                                  // regions
  std::array<Vec4f, kMaxRegionParts> part_a, part_b, part_q;      // a and its radius; b and its radius; orientation
  std::array<std::array<int, 2>, kMaxRegionParts> part_of{};      // form, region
  std::array<Vec4f, kMaxRegions> colour, grain, rim;              // linear light; w is rim_m, ripple_m, unused
  Vec3f grid_from_m = Vec3f::Zero(), grid_per_m = Vec3f::Ones();  // cell = (x - from) * per_m
  std::vector<std::uint32_t> cells;  // cells of the grid, x fastest: a bit for each part that may be there
};

// Parts are in the order of their regions. Parts beyond kMaxRegionParts are left out: flaw_of() refuses such regions.
// `rest_box`: the box of the body at rest.
RegionTable region_table(std::span<const Region> regions, const Eigen::AlignedBox3d& rest_box);

namespace shaders {

constexpr const char* kRegions = R"(
uniform ivec2 part_of[32];
uniform vec4 part_a[32];
uniform vec4 part_b[32];
uniform vec4 part_q[32];
uniform vec4 region_colour[16];
uniform vec4 region_grain[16];
uniform vec4 region_rim[16];
uniform vec3 grid_from;
uniform vec3 grid_per;
uniform usampler3D region_cells;

vec3 wave(vec3 t) {
  vec3 v = 2.0 * fract(t) - 1.0;
  return 4.0 * v * (1.0 - abs(v));
}
float ripple_at(vec3 x) {
  vec3 p = x / 0.014, q = x / 0.006 + vec3(0.15, 0.3, 0.45);
  return (0.65 * dot(wave(p), wave(p.yzx + 0.25)) + 0.35 * dot(wave(q), wave(q.yzx + 0.25))) / 3.0;
}

float part_m(int i, vec3 x) {
  vec3 a = part_a[i].xyz, b = part_b[i].xyz, p = x - a, axis = b - a;
  float s = clamp(dot(p, axis) / max(dot(axis, axis), 1e-12), 0.0, 1.0);
  float tube = length(p - s * axis) - mix(part_a[i].w, part_b[i].w, s);
  vec3 u = -part_q[i].xyz;
  vec3 turned = p + 2.0 * cross(u, cross(u, p) + part_q[i].w * p);
  vec3 q = turned / b;
  float k = length(q), slope = length(q / b);
  float ellipsoid = slope > 1e-6 ? k * (k - 1.0) / slope : -min(b.x, min(b.y, b.z));
  vec3 d = abs(turned) - b;
  int form = part_of[i].x;
  return form == 2 ? tube : form == 1 ? max(d.x, max(d.y, d.z)) : ellipsoid;
}

// The lowest bit alone, as a floating-point number, has its index as the exponent.
int lowest_bit(uint bits) { return int(floatBitsToUint(float(bits & (~bits + 1u))) >> 23u) - 127; }

// The colour of the regions at x, `around` outside them. Borders are as sharp as a pixel; a region is a little darker
// just inside its border. grain: 0 to 1; shade: about 1.
vec3 tissue_at(vec3 x, vec3 around, float grain, float shade) {
  float pixel_m = max(0.7 * (length(dFdx(x)) + length(dFdy(x))), 1e-7);
  float ripple = ripple_at(x);
  uint left = texelFetch(region_cells, clamp(ivec3((x - grid_from) * grid_per), ivec3(0), textureSize(region_cells, 0) - 1), 0).r;
  vec3 tissue = around;
  int region = -1;
  float d = 1e9;
  while (left != 0u) {
    int i = lowest_bit(left);
    left &= left - 1u;
    int r = part_of[i].y;
    d = min(r == region ? d : 1e9, part_m(i, x) - region_grain[r].w * ripple);
    region = r;
    bool last = left == 0u || part_of[lowest_bit(left)].y != r;
    vec4 colour = region_colour[r];
    vec3 own = mix(colour.rgb, region_grain[r].rgb, grain) * mix(0.7, 1.0, smoothstep(0.0, 0.0015, -d));
    own = mix(own, region_rim[r].rgb, colour.w > 0.0 ? clamp(0.5 + (d + colour.w) / pixel_m, 0.0, 1.0) : 0.0);
    tissue = mix(tissue, shade * own, last ? clamp(0.5 - d / pixel_m, 0.0, 1.0) : 0.0);
  }
  return tissue;
}
)";

}  // namespace shaders
}  // namespace sectio
