#include "sim_server/session/replay.h"

#include <cinttypes>
#include <cstdio>
#include <vector>

#include "common/delta/journal.h"
#include "sim_server/session/report.h"
#include "sim_server/session/run_files.h"

namespace sectio {

std::string replay(const std::string& journal, const std::string& export_directory) {
  std::string lines;
  if (!export_directory.empty()) make_directory(export_directory);
  for (const auto& [step, g] : read_gravity(journal)) {
    char text[128];
    std::snprintf(text, sizeof text, "gravity turned at step %" PRIu64 " to [%.3g, %.3g, %.3g] m/s2\n", step, g.x(),
                  g.y(), g.z());
    lines += text;
  }
  for (const JournalBody& body : read_journal(journal)) {
    lines += body.name + ": revision " + std::to_string(body.mesh.revision()) + ", topology hash " +
             hash_text(body.mesh.hash()) + "\n";
    if (export_directory.empty()) continue;
    std::vector<Vec3f> rest;
    for (const Vec3& x : body.mesh.rest_body_m()) rest.push_back(x.cast<float>());
    write_obj(obj_path(export_directory, body.name), body.mesh, rest);
  }
  return lines;
}

}  // namespace sectio
