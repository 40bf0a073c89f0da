#include "sim_server/scene/region_reader.h"

#include <algorithm>

#include "sim_server/scene/yaml_reader.h"

namespace sectio {
namespace {

constexpr double kLargest_m = 10;
constexpr double kGrainShade = 0.72;  // of a grain whose colour isn't given

Range length() {
  return above_to(0, kLargest_m);
}
Vec3 place(YamlMap& map, const std::string& key) {
  return map.require(key).vector3(between(-kLargest_m, kLargest_m));
}

RegionPart read_ellipsoid(YamlMap& map) {
  RegionPart part;
  part.a_m = place(map, "centre_body_m");
  part.b_m = map.require("radii_m").vector3(length());
  part.orientation = read_rotation(map);
  return part;
}

RegionPart read_sphere(YamlMap& map) {
  RegionPart part;
  part.a_m = place(map, "centre_body_m");
  part.b_m = Vec3::Constant(map.require("radius_m").number(length()));
  return part;
}

RegionPart read_region_box(YamlMap& map) {
  const Vec3 low = place(map, "min_body_m"), high = place(map, "max_body_m");
  if (!(low.array() < high.array()).all())
    map.value().fail("each number of min_body_m must be below that of max_body_m");
  RegionPart part;
  part.form = RegionForm::box;
  part.a_m = 0.5 * (low + high);
  part.b_m = 0.5 * (high - low);
  return part;
}

std::vector<RegionPart> read_tube(YamlMap& map) {
  std::vector<Vec3> points;
  std::vector<double> radii;
  for (const YamlValue& p : map.require("points_body_m").list())
    points.push_back(p.vector3(between(-kLargest_m, kLargest_m)));
  for (const YamlValue& r : map.require("radii_m").list()) radii.push_back(r.number(length()));
  if (points.size() < 2 || points.size() != radii.size())
    map.value().fail("expected two points or more, and a radius for each");
  std::vector<RegionPart> parts;
  for (std::size_t i = 1; i < points.size(); ++i)
    parts.push_back({RegionForm::tube, points[i - 1], points[i], radii[i - 1], radii[i]});
  return parts;
}

void read_shape(const YamlValue& value, std::vector<RegionPart>& parts) {
  YamlMap map(value);
  const std::size_t before = parts.size();
  map.part("ellipsoid", [&](YamlMap& part) { parts.push_back(read_ellipsoid(part)); });
  map.part("sphere", [&](YamlMap& part) { parts.push_back(read_sphere(part)); });
  map.part("box", [&](YamlMap& part) { parts.push_back(read_region_box(part)); });
  map.part("tube", [&](YamlMap& part) {
    const std::vector<RegionPart> pieces = read_tube(part);
    parts.insert(parts.end(), pieces.begin(), pieces.end());
  });
  map.finish();
  if (parts.size() == before) value.fail("expected one of ellipsoid, sphere, box, tube");
}

Region read_region(YamlMap& map) {
  Region region;
  region.name = map.require("name").text();
  if (region.name.size() > 64) map.value().fail("a name has at most 64 letters");
  map.read("colour", region.colour, between(0, 1));
  region.grain_colour = kGrainShade * region.colour;
  map.read("grain_colour", region.grain_colour, between(0, 1));
  map.part("rim", [&](YamlMap& part) {
    region.rim_m = part.require("width_m").number(above_to(0, 0.1));
    region.rim_colour = part.require("colour").vector3(between(0, 1));
  });
  map.read("ripple_m", region.ripple_m, between(0, 0.1));
  map.read("stiffness_factor", region.stiffness_factor, between(1e-3, 1e3));
  map.read("marked", region.marked);
  for (const YamlValue& shape : map.require("shapes").list()) read_shape(shape, region.parts);
  map.finish();
  return region;
}

}  // namespace

Regions read_regions(const YamlValue& list) {
  Regions regions;
  for (const YamlValue& value : list.list()) {
    YamlMap map(value);
    regions.push_back(read_region(map));
    const auto same = [&](const Region& r) { return r.name == regions.back().name; };
    if (std::ranges::count_if(regions, same) > 1) value.fail("the name " + regions.back().name + " is used twice");
  }
  if (const std::string flaw = flaw_of(regions); !flaw.empty()) list.fail(flaw);
  return regions;
}

}  // namespace sectio
