#include "tests/support/fine_scene.h"

#include <yaml-cpp/yaml.h>

#include <array>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "common/mesh/obj_text.h"

namespace sectio::test {
namespace {

TriangleSoup read_obj(const std::filesystem::path& path) {
  TriangleSoup soup;
  std::ifstream file(path);
  std::string line, kind;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    if (!(words >> kind)) continue;
    if (kind == "v") {
      Vec3& at = soup.vertices_body_m.emplace_back();
      words >> at.x() >> at.y() >> at.z();
    } else if (kind == "f") {
      auto& corners = soup.triangles.emplace_back();
      for (VertexId& corner : corners) words >> corner, --corner;
    }
    if (kind == "v" || kind == "f")
      if (!words) throw std::runtime_error(path.string() + ": " + line);
  }
  return soup;
}

TriangleSoup divided(const TriangleSoup& coarse) {
  TriangleSoup fine;
  fine.vertices_body_m = coarse.vertices_body_m;
  std::map<std::pair<VertexId, VertexId>, VertexId> middles;
  const auto middle = [&](VertexId a, VertexId b) {
    const auto [at, is_new] = middles.try_emplace(std::minmax(a, b), VertexId(fine.vertices_body_m.size()));
    if (is_new) fine.vertices_body_m.push_back((coarse.vertices_body_m[a] + coarse.vertices_body_m[b]) / 2);
    return at->second;
  };
  for (const auto& [a, b, c] : coarse.triangles) {
    const VertexId ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    fine.triangles.insert(fine.triangles.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  return fine;
}

}  // namespace

std::string fine_scene(const std::string& name, int times, double duration_s, const std::filesystem::path& directory) {
  const std::filesystem::path scenes = SECTIO_SOURCE_DIR "/deploy/scenes", scene = directory / (name + ".yaml");
  YAML::Node root = YAML::LoadFile(scenes / (name + ".yaml"));
  YAML::Node mesh = root["bodies"][0]["mesh"]["file"];
  TriangleSoup soup = read_obj(scenes / mesh.as<std::string>());
  for (int n = 0; n < times; ++n) soup = divided(soup);
  const std::filesystem::path finer = directory / "fine.obj";
  std::ofstream(finer) << obj_text(soup, name + ", finer; unit: m");
  mesh = finer.string();
  for (YAML::Node tool : root["tools"]) tool["trace"] = (scenes / tool["trace"].as<std::string>()).string();
  root["duration_s"] = duration_s;
  root.remove("expect");
  std::ofstream(scene) << root;
  return scene;
}

}  // namespace sectio::test
