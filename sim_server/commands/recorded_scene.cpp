#include "sim_server/commands/recorded_scene.h"

#include <filesystem>

#include "sim_server/engine/standard_engines.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/prepare/choose_model.h"
#include "sim_server/prepare/prepare.h"
#include "sim_server/session/input_log.h"

namespace sectio {

std::string journal_at(const std::string& path) {
  return std::filesystem::is_directory(path) ? input_log_path(path) : path;
}

Scene recorded_scene(const std::string& input_log) {
  const InputLogHeader header = InputLogReader(input_log).header();
  Scene scene = planned(load_scene(header.scene, standard_traits()), standard_engines());
  if (!header.session.empty()) scene.session = header.session;
  if (header.bodies.size() < scene.bodies.size()) keep_bodies(scene, header.bodies, input_log);
  return prepared(std::move(scene));
}

}  // namespace sectio
