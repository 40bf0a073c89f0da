// The files of the repository, as text.
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace sectio::test {

inline const std::vector<std::string> kSourceFolders = {"common",        "idl",   "sim_server", "render_client",
                                                        "device_bridge", "tests", "deploy",     ".ci"};

// `path` from the root of the sources.
inline std::string read_source(const std::filesystem::path& path) {
  std::ifstream in(std::filesystem::path(SECTIO_SOURCE_DIR) / path);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Path from the root of the sources -> text, for all files below `folders` with one of these endings. Scripts have no
// ending.
inline std::map<std::string, std::string> source_files(const std::vector<std::string>& folders,
                                                       const std::set<std::string>& endings) {
  namespace fs = std::filesystem;
  std::map<std::string, std::string> texts;
  const fs::path root = SECTIO_SOURCE_DIR;
  for (const std::string& top : folders) {
    if (!fs::exists(root / top)) continue;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / top)) {
      if (!entry.is_regular_file() || !endings.contains(entry.path().extension().string())) continue;
      const fs::path path = fs::relative(entry.path(), root);
      texts[path.generic_string()] = read_source(path);
    }
  }
  return texts;
}

}  // namespace sectio::test
