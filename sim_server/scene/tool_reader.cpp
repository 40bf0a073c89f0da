#include "sim_server/scene/tool_reader.h"

namespace sectio {
namespace {

// A key that a kind has no use for is unknown to it.
void read_geometry(KeyReader& map, const InstrumentKind& instrument, ToolGeometry& g) {
  const auto point = [&](const char* key, Vec3& target, const char* meaning) {
    map.default_of("as usual for the kind").vector(key, target, {}, meaning);
  };
  const auto length = [&](const char* key, double& target, const Range& range, const char* meaning) {
    map.default_of("as usual for the kind").number(key, target, range, meaning);
  };
  point("a_tool_m", g.a_tool_m, "The tip; of scissors and forceps the tips when they are closed.");
  point("b_tool_m", g.b_tool_m, "Upper end of the shaft; of scissors and forceps the end of the handles.");
  point("c_tool_m", g.c_tool_m, "Upper end of the edge; of a cautery hook of the probe, of scissors the pivot.");
  point("d_tool_m", g.d_tool_m, "Upper end of the blunt front; of a cautery hook the virtual tip.");
  if (map.describes() || instrument.geometry.sharp_length_m > 0)
    length("sharp_length_m", g.sharp_length_m, above(0),
           "For a knife only: how much of the edge is sharp, from the tip on.");
  if (map.describes() || instrument.geometry.gauge_m > 0)
    length("gauge_m", g.gauge_m, above(0), "For medical scissors only: distance between the two edges.");
  length("sphere_radius_m", g.sphere_radius_m, above_to(0, 0.1),
         "Radius of a ball about the tip that pushes tissue out of the way; bodies with contact style templates meet "
         "the instrument's lines, without it.");
}

void read_grip(KeyReader& map, const InstrumentKind& instrument, ToolSpec& tool) {
  if (!map.describes() && instrument.grip_force_n == 0) return;
  map.default_of("as usual for the kind")
      .number("grip_force_n", tool.grip_force_n, above_to(0, 1000),
              "For forceps only: the force that they hold with at most.");
  map.default_of("as usual for the kind")
      .number("grip_radius_m", tool.grip_radius_m, above_to(0, 0.1),
              "For forceps only: how close to their tips tissue is held.");
  map.check(tool.grip_radius_m.value_or(instrument.grip_radius_m) > tool.geometry.sphere_radius_m,
            "grip_radius_m must be more than sphere_radius_m: the ball pushes out what is held");
}

}  // namespace

ToolSpec read_tool(KeyReader& map) {
  ToolSpec tool;
  map.required().name("name", tool.name, "Its name, which no other tool has.");
  map.required().choice("kind", tool.kind, instrument_kinds(), "Kind of instrument.");
  const InstrumentKind& instrument = instrument_of(tool.kind);
  tool.geometry = instrument.geometry;
  map.part(
      "geometry", [&](KeyReader& part) { read_geometry(part, instrument, tool.geometry); },
      "Its corner points, in its own frame.");
  if (map.describes() || instrument.front_is_virtual)
    map.number("intensity", tool.intensity, above_to(0, 10),
               "For a cautery hook only: length of the virtual tip over that of its geometry.");
  map.number("largest_force_n", tool.largest_force_n, above_to(0, 1000), "The largest force that its hand may feel.");
  map.number(
      "max_speed_m_per_s", tool.max_speed_m_per_s, above_to(0, 100),
      "A bridge that moves it faster is followed at this speed. The server's --max-speed-m-per-s goes before it.");
  read_grip(map, instrument, tool);
  const std::string flaw = instrument.flaw(tool.geometry);
  map.check(flaw.empty(), "geometry: " + flaw);
  map.text(
      "trace", tool.trace_file,
      "A recorded motion (CSV): time_s, x_world_m, y_world_m, z_world_m, qw, qx, qy, qz and, of jaws, opening_rad. "
      "The path is relative to the scene's own folder.");
  return tool;
}

}  // namespace sectio
