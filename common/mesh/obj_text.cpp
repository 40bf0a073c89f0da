#include "common/mesh/obj_text.h"

#include "common/core/formatted.h"

namespace sectio {

std::string obj_text(const TriangleSoup& soup, const std::string& comment) {
  std::string text = "# " + comment + "\n";
  for (const Vec3& p : soup.vertices_body_m) text += formatted("v %.7f %.7f %.7f\n", p.x(), p.y(), p.z());
  for (const auto& t : soup.triangles) text += formatted("f %u %u %u\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return text;
}

}  // namespace sectio
