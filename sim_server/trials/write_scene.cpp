#include "sim_server/trials/write_scene.h"

#include <filesystem>

#include "common/core/formatted.h"
#include "common/core/write_file.h"
#include "sim_server/scene/yaml_value.h"
#include "sim_server/session/run_files.h"

namespace sectio {
namespace {

std::string exactly(double x) {
  return formatted("%.17g", x);
}

std::string trace_text(const std::vector<TracePoint>& trace) {
  std::string text = trace_columns() + '\n';
  for (const TracePoint& point : trace) {
    append_trace_point(text, point);
    text += '\n';
  }
  return text;
}

}  // namespace

void write_scene(const Scene& scene, const std::string& directory) {
  make_directory(directory);
  std::vector<std::pair<std::string, std::string>> values{{"duration_s", exactly(scene.duration_s)}};
  const auto absolute = [](const std::string& file) {
    return file.empty() ? file : std::filesystem::absolute(file).string();
  };
  for (std::size_t i = 0; i < scene.gravity_changes.size(); ++i)
    values.emplace_back(formatted("gravity_changes[%zu].at_s", i), exactly(scene.gravity_changes[i].at_s));
  for (const Expectation& e : scene.expect) values.emplace_back("expect." + e.measure->key, e.range.in_words());
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    values.emplace_back(formatted("bodies[%zu].mesh.file", i), absolute(scene.bodies[i].mesh_file));
    values.emplace_back(formatted("bodies[%zu].volume.tets.file", i), absolute(scene.bodies[i].volume.file));
  }
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    const ToolSpec& tool = scene.tools[i];
    if (tool.trace.empty()) continue;
    const std::string file = tool.name + ".csv";
    write_file(directory + "/" + file, trace_text(tool.trace));
    values.emplace_back(formatted("tools[%zu].trace", i), file);
  }
  write_file(directory + "/scene.yaml", yaml_with(scene.file, values));
}

}  // namespace sectio
