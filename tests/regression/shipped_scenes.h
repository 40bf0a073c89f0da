// The scenes of deploy/scenes.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

namespace sectio {

inline const std::filesystem::path kScenes = SECTIO_SOURCE_DIR "/deploy/scenes";

inline std::vector<std::string> scene_names() {
  std::vector<std::string> names;
  for (const std::filesystem::directory_entry& file : std::filesystem::directory_iterator(kScenes))
    if (file.path().extension() == ".yaml") names.push_back(file.path().stem().string());
  std::ranges::sort(names);
  return names;
}

}  // namespace sectio
