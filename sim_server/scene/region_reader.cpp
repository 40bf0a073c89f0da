#include "sim_server/scene/region_reader.h"

#include <algorithm>

namespace sectio {
namespace {

constexpr double kLargest_m = 10;
constexpr double kGrainShade = 0.72;  // a grain whose colour isn't given

Range length() {
  return above_to(0, kLargest_m);
}
Range place() {
  return between(-kLargest_m, kLargest_m);
}

RegionPart read_ellipsoid(KeyReader& map) {
  RegionPart part;
  map.required().vector("centre_body_m", part.a_m, place(), "Its centre.");
  map.required().vector("radii_m", part.b_m, length(), "Its three half axes.");
  map.rotation(part.orientation, "mesh");
  return part;
}

RegionPart read_sphere(KeyReader& map) {
  RegionPart part;
  double radius_m = 0;
  map.required().vector("centre_body_m", part.a_m, place(), "Its centre.");
  map.required().number("radius_m", radius_m, length(), "Its radius.");
  part.b_m = Vec3::Constant(radius_m);
  return part;
}

RegionPart read_region_box(KeyReader& map) {
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();
  map.required().vector("min_body_m", low, place(), "Corner with the smallest coordinates.");
  map.required().vector("max_body_m", high, place(), "Corner with the largest coordinates.");
  map.check((low.array() < high.array()).all(), "each number of min_body_m must be below that of max_body_m");
  RegionPart part;
  part.form = RegionForm::box;
  part.a_m = 0.5 * (low + high);
  part.b_m = 0.5 * (high - low);
  return part;
}

std::vector<RegionPart> read_tube(KeyReader& map) {
  std::vector<Vec3> points;
  std::vector<double> radii;
  map.required().vectors("points_body_m", points, place(), "Points of its axis, two or more.");
  map.required().numbers("radii_m", radii, length(), "Its radius at each of them.");
  map.check(points.size() >= 2 && points.size() == radii.size(), "expected two points or more, and a radius for each");
  std::vector<RegionPart> parts;
  for (std::size_t i = 1; i < points.size(); ++i)
    parts.push_back({RegionForm::tube, points[i - 1], points[i], radii[i - 1], radii[i]});
  return parts;
}

void read_shape(KeyReader& map, std::vector<RegionPart>& parts) {
  const std::size_t before = parts.size();
  map.part(
      "ellipsoid", [&](KeyReader& part) { parts.push_back(read_ellipsoid(part)); }, "An ellipsoid.");
  map.part(
      "sphere", [&](KeyReader& part) { parts.push_back(read_sphere(part)); }, "A sphere.");
  map.part(
      "box", [&](KeyReader& part) { parts.push_back(read_region_box(part)); }, "A box along the mesh's axes.");
  map.part(
      "tube",
      [&](KeyReader& part) {
        const std::vector<RegionPart> pieces = read_tube(part);
        parts.insert(parts.end(), pieces.begin(), pieces.end());
      },
      "A tube with round ends, such as a vessel.");
  map.finish();  // a shape of another name is an unknown key in the first place
  map.check(parts.size() > before, "expected one of ellipsoid, sphere, box, tube");
}

Region read_region(KeyReader& map) {
  Region region;
  map.required().text("name", region.name, "Its name, at most 64 letters, which no other region of the body has.");
  map.check(region.name.size() <= 64, "a name has at most 64 letters");
  map.vector("colour", region.colour, between(0, 1), "Red, green and blue.");
  region.grain_colour = kGrainShade * region.colour;
  map.default_of("a darker shade of colour")
      .vector("grain_colour", region.grain_colour, between(0, 1), "Colour of its grain.");
  map.part(
      "rim",
      [&](KeyReader& part) {
        part.required().number("width_m", region.rim_m, above_to(0, 0.1), "How far it reaches below the border.");
        part.required().vector("colour", region.rim_colour, between(0, 1), "Red, green and blue.");
      },
      "A layer below its border: the wall of a vessel, a capsule.");
  map.number("ripple_m", region.ripple_m, between(0, 0.1), "By how much its border is uneven.");
  map.number("stiffness_factor", region.stiffness_factor, between(1e-3, 1e3),
             "Its Young's modulus over that of the body's material.");
  map.boolean("marked", region.marked, "An exercise wants this tissue removed.");
  map.required().each(
      "shapes", [&](KeyReader& shape) { read_shape(shape, region.parts); },
      "The region is the union of its shapes, in the frame of the mesh.");
  return region;
}

}  // namespace

Regions read_regions(KeyReader& body) {
  Regions regions;
  body.each(
      "regions",
      [&](KeyReader& map) {
        const Region region = read_region(map);
        map.finish();
        map.check(std::ranges::find(regions, region.name, &Region::name) == regions.end(),
                  "the name " + region.name + " is used twice");
        regions.push_back(region);
      },
      "The regions inside; where regions overlap, the later one is there.");
  const std::string flaw = flaw_of(regions);
  body.check("regions", flaw.empty(), flaw);
  return regions;
}

}  // namespace sectio
