#include "render_client/draw/region_shader.h"

#include <algorithm>

namespace sectio {

namespace {

using Box = Eigen::AlignedBox3d;

constexpr double kMargin_m = 5e-4;  // around a part, for borders that are blended over a pixel

Vec4f packed(const Vec3& v, double w) {
  return Vec4f(static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()), static_cast<float>(w));
}

// The display gamma is taken as 2 (shaders.h).
Vec3 linear(const Vec3& colour) {
  return colour.cwiseProduct(colour);
}

Box box_of(const RegionPart& p) {
  if (p.form != RegionForm::tube) {
    const Vec3 reach = Vec3::Constant(p.form == RegionForm::box ? p.b_m.norm() : p.b_m.maxCoeff());
    return {p.a_m - reach, p.a_m + reach};
  }
  const Vec3 reach = Vec3::Constant(std::max(p.radius_a_m, p.radius_b_m));
  return {p.a_m.cwiseMin(p.b_m) - reach, p.a_m.cwiseMax(p.b_m) + reach};
}

std::size_t cell_index(int i, int j, int k) {
  constexpr auto kSize = static_cast<std::size_t>(kRegionGridSize);
  return (static_cast<std::size_t>(k) * kSize + static_cast<std::size_t>(j)) * kSize + static_cast<std::size_t>(i);
}

// Marks the cells that a part may reach.
void mark(const RegionPart& part, double ripple_m, const Box& grid, std::uint32_t bit,
          std::vector<std::uint32_t>& cells) {
  const Vec3 cell_m = grid.sizes() / kRegionGridSize;
  const double reach_m = 0.5 * cell_m.norm() + ripple_m + kMargin_m;
  const Box box = box_of(part);
  const auto cell_of = [&](const Vec3& x) {
    return (x - grid.min()).cwiseQuotient(cell_m).array().floor().max(0).min(kRegionGridSize - 1).cast<int>().eval();
  };
  const Eigen::Array3i low = cell_of(box.min() - Vec3::Constant(reach_m));
  const Eigen::Array3i high = cell_of(box.max() + Vec3::Constant(reach_m));
  for (int k = low.z(); k <= high.z(); ++k)
    for (int j = low.y(); j <= high.y(); ++j)
      for (int i = low.x(); i <= high.x(); ++i) {
        const Vec3 middle = grid.min() + cell_m.cwiseProduct(Vec3(i + 0.5, j + 0.5, k + 0.5));
        if (may_reach(part, middle, reach_m)) cells[cell_index(i, j, k)] |= bit;
      }
}

}  // namespace

RegionTable region_table(std::span<const Region> regions, const Box& rest_box) {
  RegionTable table;
  for (auto* parts : {&table.part_a, &table.part_b, &table.part_q}) parts->fill(Vec4f::Ones());
  for (auto* colours : {&table.colour, &table.grain, &table.rim}) colours->fill(Vec4f::Zero());
  const Vec3 margin = Vec3::Constant(2e-3);  // walls of a cut may lie a little outside
  const Box grid = rest_box.isEmpty() ? Box(-margin, margin) : Box(rest_box.min() - margin, rest_box.max() + margin);
  table.grid_from_m = grid.min().cast<float>();
  table.grid_per_m = (kRegionGridSize * grid.sizes().cwiseInverse()).cast<float>();
  table.cells.assign(static_cast<std::size_t>(kRegionGridSize) * kRegionGridSize * kRegionGridSize, 0);
  std::size_t part = 0;
  for (const Region& region : regions.first(std::min(regions.size(), kMaxRegions))) {
    const auto r = static_cast<std::size_t>(table.count++);
    for (const RegionPart& p : region.parts) {
      if (part == kMaxRegionParts) break;
      table.part_a[part] = packed(p.a_m, p.radius_a_m);
      table.part_b[part] = packed(p.b_m, p.radius_b_m);
      table.part_q[part] = p.orientation.coeffs().cast<float>();
      table.part_of[part] = {static_cast<int>(p.form), static_cast<int>(r)};
      mark(p, region.ripple_m, grid, 1u << part, table.cells);
      ++part;
    }
    table.colour[r] = packed(linear(region.colour), region.rim_m);
    table.grain[r] = packed(linear(region.grain_colour), region.ripple_m);
    table.rim[r] = packed(linear(region.rim_colour), 0);
  }
  return table;
}

}  // namespace sectio
