// Meshes of instruments as a surgeon knows them, built from the four points that collision uses (paper B, figure 3).
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "render_client/draw/canvas.h"
#include "render_client/replica/frame.h"

namespace sectio {

struct ToolPart {
  IndexRange range;
  Material material;
};

struct ToolMesh {
  std::vector<CanvasVertex> vertices;  // tool frame; rest_m = position_m
  std::vector<std::uint32_t> indices;
  std::vector<ToolPart> parts;
  Occluder shadow;  // tool frame
};

// An instrument of this kind opens and closes.
bool has_jaws(std::string_view kind);

// scalpel: a thin blade in the plane of A, B, C, D, ground to an edge along AC, on a flat handle along AB.
// cautery_hook: an insulated shaft along AB, a wire hook A to C with a hot tip, its spark reaching to D.
// knife: as a scalpel. scissors, medical_scissors: two blades that turn about the pivot C, opened by the pose's angle,
// with handles and rings towards B; each blade of medical scissors is double, in the form of a U. forceps: the same
// with blunt jaws. probe: a rod with a round end at A, as thick as C is away from AB. Other kinds are drawn as a rod
// along AB. Points may coincide: the mesh is then small or plain, but valid.
ToolMesh make_tool_mesh(const ToolFrame& tool);

}  // namespace sectio
