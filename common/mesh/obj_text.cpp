#include "common/mesh/obj_text.h"

#include <cstdio>

namespace sectio {

std::string obj_text(const TriangleSoup& soup, const std::string& comment) {
  std::string text = "# " + comment + "\n";
  char line[96];
  for (const Vec3& p : soup.vertices_body_m) {
    std::snprintf(line, sizeof line, "v %.7f %.7f %.7f\n", p.x(), p.y(), p.z());
    text += line;
  }
  for (const auto& t : soup.triangles) {
    std::snprintf(line, sizeof line, "f %u %u %u\n", t[0] + 1, t[1] + 1, t[2] + 1);
    text += line;
  }
  return text;
}

}  // namespace sectio
