// Surfaces of labels in a volume image: NIfTI, as segmentations of CT and MRI come.
#pragma once

#include <cstdint>
#include <string>

#include "common/mesh/triangle_mesh.h"

namespace sectio {

// The faces between voxels that have one of the labels and those that have none of them, two triangles each, outside
// outward, in metres in the image's own frame (sform, else qform, else its voxels' sizes; a file without a unit is in
// millimetres). labels: numbers apart by commas; empty: all but 0.
// Throws std::runtime_error with the reason; a label that isn't there is told with those that are.
TriangleSoup label_surface(const std::string& path, const std::string& labels, std::uint64_t max_triangles);

}  // namespace sectio
