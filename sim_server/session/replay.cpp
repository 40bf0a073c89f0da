#include "sim_server/session/replay.h"

#include <algorithm>
#include <cinttypes>
#include <numeric>
#include <vector>

#include "common/core/formatted.h"
#include "common/core/report_figures.h"
#include "common/core/write_file.h"
#include "common/delta/journal.h"
#include "sim_server/session/run_files.h"

namespace sectio {
namespace {

std::string line_of(const JournalScalars& scalars, const std::string& body) {
  const std::vector<float>& values = scalars.field.values;
  if (values.empty()) return {};
  const auto [least, most] = std::ranges::minmax(values);
  return formatted("%s: %s at step %" PRIu64 ": %.4g to %.4g, mean %.4g\n", body.c_str(), scalars.field.name.c_str(),
                   scalars.step, static_cast<double>(least), static_cast<double>(most),
                   std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size()));
}

std::string csv_of(const ScalarField& field) {
  std::string text = "vertex," + field.name + "\n";
  for (std::size_t v = 0; v < field.values.size(); ++v)
    text += formatted("%zu,%.6g\n", v, static_cast<double>(field.values[v]));
  return text;
}

}  // namespace

std::string replay(const std::string& journal, const std::string& export_directory, std::string& damage) {
  std::string lines;
  if (!export_directory.empty()) make_directory(export_directory);
  const JournalContents contents = salvage_journal(journal);
  damage = contents.damage;
  for (const auto& [step, g] : contents.gravity)
    lines += formatted("gravity turned at step %" PRIu64 " to [%.3g, %.3g, %.3g] m/s2\n", step, g.x(), g.y(), g.z());
  const std::vector<JournalBody>& bodies = contents.bodies;
  for (const JournalBody& body : bodies) {
    lines += body.name + ": revision " + std::to_string(body.mesh.revision()) + ", topology hash " +
             hash_text(body.mesh.hash()) + "\n";
    if (export_directory.empty()) continue;
    std::vector<Vec3f> rest;
    for (const Vec3& x : body.mesh.rest_body_m()) rest.push_back(x.cast<float>());
    write_obj(obj_path(export_directory, body.name), body.mesh, rest);
  }
  for (const JournalScalars& scalars : contents.scalars) {
    const std::string& body = bodies[scalars.body_id].name;
    lines += line_of(scalars, body);
    if (export_directory.empty()) continue;
    write_file(export_directory + "/" + body + "." + scalars.field.name + ".csv", csv_of(scalars.field));
  }
  return lines;
}

}  // namespace sectio
