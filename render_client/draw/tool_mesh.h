// Instruments as a surgeon would know them, built from the four points that collision uses (paper B, figure 3).
#pragma once

#include <cstdint>
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

// scalpel: a thin blade in the plane of A, B, C, D, ground to an edge along AC, on a flat handle along AB.
// cautery_hook: an insulated shaft along AB, a wire hook A to C with a hot tip, its spark reaching to D.
// knife: a scalpel's blade, larger. scissors, medical_scissors: two blades about the pivot C, as far apart as the pose
// says, plain or two abreast in the form of a U, with handles and rings towards B; forceps: the same with blunt jaws.
// probe: a rod as thick as C says, with a round end at A. Other kinds are drawn as a rod along AB. Points may coincide;
// the tool then is small or plain, never broken.
ToolMesh make_tool_mesh(const ToolFrame& tool);

}  // namespace sectio
