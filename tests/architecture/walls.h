// The walls between the rooms as one table, and what a source file may not hold. Pure functions of a path and a text.
#pragma once

#include <algorithm>
#include <cctype>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace sectio {

struct Room {
  std::string_view path;                    // its files: the longest row that a file's path begins with is its own
  std::string_view holds;                   // for the table in docs/architecture.md; empty: a part of a room
  std::vector<std::string_view> project;    // beginnings of the headers of ours that it may include
  std::vector<std::string_view> libraries;  // it may see beside the standard library and the system's headers
};

inline const std::vector<Room>& rooms() {
  static const std::vector<Room> table = {
      {"common/core/",
       "errors, arguments of programs, log, the slot for the latest value, waking from sleep",
       {"common/core/"},
       {"Eigen/"}},
      {"common/core/log.cpp", "", {"common/core/"}, {"spdlog/"}},
      {"common/core/arguments.cpp", "", {"common/core/"}, {"CLI/"}},
      {"common/math/",
       "vectors and poses, exact predicates, intersections, traces, hash, the local contact model, states as bytes",
       {"common/core/", "common/math/"},
       {"Eigen/"}},
      {"common/mesh/",
       "triangle mesh with slots and an incremental hash, tetrahedra, the check of invariants",
       {"common/core/", "common/math/", "common/mesh/"},
       {"Eigen/"}},
      {"common/delta/",
       "topology delta, apply, inverse, keyframe, journal",
       {"common/core/", "common/math/", "common/mesh/", "common/delta/"},
       {"Eigen/"}},
      {"common/mcap/",
       "records of sessions as MCAP files, which tools of others read: writer and reader, zstd",
       {"common/core/", "common/delta/bytes.h", "common/mcap/"},
       {}},
      {"common/material/",
       "the inside of a body: elastic constants, regions as functions of the rest point, their volumes",
       {"common/core/", "common/math/", "common/mesh/", "common/material/"},
       {"Eigen/"}},
      {"common/messages/",
       "messages as plain values; their fields once each, from which encoding, validation and text come",
       {"common/core/", "common/math/", "common/mesh/", "common/material/", "common/delta/", "common/messages/"},
       {"Eigen/"}},
      {"common/dds/",
       "Fast DDS: participants, endpoints, quality of service, keys",
       {"common/"},
       {"Eigen/", "fastdds/", "fastrtps/"}},
      {"common/dds/keys.cpp", "", {"common/"}, {"openssl/"}},

      {"common/record/",
       "the record of a session as messages with schemas",
       {"common/core/", "common/mesh/", "common/delta/", "common/messages/", "common/mcap/", "common/dds/qos.h",
        "common/record/"},
       {"Eigen/"}},

      {"sim_server/instruments/",
       "a file for each kind of instrument: where its edges are, and which of them cut when",
       {"common/core/", "common/math/", "sim_server/instruments/"},
       {"Eigen/"}},
      {"sim_server/scene/key.", "", {"common/core/formatted.h", "common/math/", "sim_server/scene/key.h"}, {"Eigen/"}},
      {"sim_server/scene/engine_traits.h", "", {"sim_server/scene/key.h"}, {}},
      {"sim_server/scene/scene_outcome.",
       "",
       {"common/core/formatted.h", "common/math/", "sim_server/scene/key.h", "sim_server/scene/scene_outcome.h"},
       {"Eigen/"}},
      {"sim_server/scene/scene.h",
       "",
       {"common/core/", "common/math/", "common/mesh/", "common/material/", "sim_server/instruments/instrument.h",
        "sim_server/scene/engine_traits.h", "sim_server/scene/scene_outcome.h"},
       {"Eigen/"}},
      {"sim_server/scene/yaml_value.",
       "",
       {"common/core/", "common/math/", "sim_server/scene/key.h", "sim_server/scene/yaml_value.h"},
       {"Eigen/", "yaml-cpp/"}},
      {"sim_server/mesh_reader/",
       "the program that reads files of meshes and of labels, so that a damaged one harms nobody else",
       {"common/core/", "common/math/", "common/mesh/", "sim_server/mesh_reader/", "sim_server/scene/mesh_process.h"},
       {"Eigen/", "assimp/", "nifti1_io.h", "zlib.h"}},
      {"sim_server/scene/",
       "a scene as plain values, read from YAML; meshes, read in a child process and mended",
       {"common/core/", "common/math/", "common/mesh/", "common/material/", "sim_server/scene/",
        "sim_server/instruments/instrument.h", "sim_server/wrap/wrap.h"},
       {"Eigen/", "nlohmann/"}},
      {"sim_server/wrap/",
       "a watertight body around triangles as they come: winding number, grid, even triangles",
       {"common/core/", "common/math/", "common/mesh/", "sim_server/wrap/"},
       {"Eigen/"}},
      {"sim_server/meshing/",
       "tetrahedra from a surface: the lattice mesher, TetGen as a program, files of other meshers",
       {"common/core/", "common/math/", "common/mesh/", "common/material/elastic_material.h", "sim_server/meshing/"},
       {"Eigen/"}},
      {"sim_server/planning/",
       "the choice of a model: loads, error laws fitted to the chart, cost",
       {"common/core/", "common/math/", "common/mesh/", "common/material/elastic_material.h", "sim_server/planning/"},
       {"Eigen/"}},
      // Engines: what each keeps beside the topology and the state of the particles is its own.
      {"sim_server/engine/engine.h",
       "",
       {"common/core/", "common/math/", "common/mesh/", "common/delta/", "sim_server/bodies/particle_state.h"},
       {"Eigen/"}},
      {"sim_server/engine/world_engine.h",
       "",
       {"sim_server/engine/engine.h", "sim_server/deformation/point_constraint.h"},
       {}},
      {"sim_server/engine/engine_table.",
       "",
       {"common/core/", "common/math/", "sim_server/engine/engine", "sim_server/engine/world_engine.h",
        "sim_server/scene/scene.h", "sim_server/collision/collision_engine.h",
        "sim_server/surface/cutting/cutting_engine.h", "sim_server/surface/cutting/cut_plan.h",
        "sim_server/deformation/deformation_engine.h", "sim_server/components/splitting_engine.h",
        "sim_server/planning/method.h"},
       {"Eigen/"}},
      {"sim_server/engine/",
       "the interface of engines, the table of engines by the model that a scene names",
       {"common/core/", "sim_server/engine/", "sim_server/scene/engine_traits.h", "sim_server/planning/error_law.h",
        "sim_server/deformation/surface_springs.h", "sim_server/surface/surface_engines.h",
        "sim_server/volume/volume_engines.h"},
       {"Eigen/"}},
      {"sim_server/bodies/",
       "state of particles, the vertices that a step has touched, stillness",
       {"common/core/", "common/math/", "common/mesh/", "common/delta/", "sim_server/bodies/"},
       {"Eigen/"}},
      {"sim_server/collision/",
       "FCL's tree for the first hit, then a walk over the neighbours of the front",
       {"common/core/", "common/math/", "common/mesh/", "sim_server/collision/", "sim_server/engine/engine.h"},
       {"Eigen/", "fcl/"}},
      {"sim_server/deformation/",
       "springs of surfaces; springs and neo-Hookean solids of tetrahedra (tetra) and lattices (hexa); drivers",
       {"common/core/", "common/math/", "common/mesh/", "common/material/elastic_material.h", "sim_server/deformation/",
        "sim_server/engine/engine.h"},
       {"Eigen/"}},
      {"sim_server/components/",
       "triangles that hang together, and how a part leaves its body",
       {"common/core/", "common/math/", "common/mesh/", "common/delta/", "sim_server/components/",
        "sim_server/engine/engine.h"},
       {"Eigen/"}},
      {"sim_server/body_contact/",
       "contact between bodies, floor and lips; rigid motion; one solver for all",
       {"common/core/", "common/math/", "common/mesh/", "sim_server/body_contact/", "sim_server/engine/engine.h",
        "sim_server/collision/collision_engine.h", "sim_server/deformation/deformation_engine.h"},
       {"Eigen/"}},
      {"sim_server/haptics/",
       "from contacts to the local contact model for the hand",
       {"common/core/", "common/math/", "sim_server/haptics/"},
       {"Eigen/"}},
      {"sim_server/surface/cutting/",
       "cuts of a surface as deltas: progressive strokes, templates, grooves, joining, islands",
       {"common/core/", "common/math/", "common/mesh/", "common/delta/", "sim_server/surface/cutting/",
        "sim_server/engine/engine.h", "sim_server/bodies/particle_state.h"},
       {"Eigen/"}},
      {"sim_server/surface/indentation/",
       "temporary elements under an instrument that presses",
       {"common/core/", "common/math/", "common/mesh/", "common/delta/", "sim_server/surface/",
        "sim_server/engine/engine.h", "sim_server/bodies/particle_state.h"},
       {"Eigen/"}},
      {"sim_server/surface/",
       "the engines of a body that is a surface",
       {"common/core/", "common/math/", "common/mesh/", "common/material/", "sim_server/surface/", "sim_server/engine/",
        "sim_server/scene/scene.h", "sim_server/collision/", "sim_server/deformation/", "sim_server/components/"},
       {"Eigen/"}},
      {"sim_server/volume/tets/",
       "cuts of tetrahedra by splitting edges, collapse of short edges, undo",
       {"common/core/", "common/math/", "common/mesh/", "sim_server/volume/tets/"},
       {"Eigen/"}},
      {"sim_server/volume/",
       "the engines of a body that is a volume: cutting, front, surface of the volume, parts",
       {"common/core/", "common/math/", "common/mesh/", "common/material/", "common/delta/", "sim_server/volume/",
        "sim_server/surface/", "sim_server/engine/", "sim_server/scene/scene.h", "sim_server/collision/",
        "sim_server/deformation/", "sim_server/components/"},
       {"Eigen/"}},

      // The centre: the world that a step changes, the stages of a step, and their list.
      {"sim_server/world/step_io.",
       "",
       {"sim_server/world/step_io.h", "common/core/", "common/math/", "common/delta/", "common/messages/"},
       {"Eigen/"}},
      {"sim_server/world/",
       "the state that a step changes: bodies, instruments at bodies, grasps, gravity; input and output of a step",
       {"common/core/", "common/math/", "common/mesh/", "common/material/", "common/delta/", "common/messages/",
        "sim_server/world/", "sim_server/engine/", "sim_server/scene/scene.h", "sim_server/bodies/",
        "sim_server/deformation/", "sim_server/collision/", "sim_server/surface/", "sim_server/components/",
        "sim_server/body_contact/", "sim_server/haptics/", "sim_server/instruments/instrument.h"},
       {"Eigen/"}},
      {"sim_server/step/",
       "the stages of a step",
       {"common/core/", "common/math/", "common/mesh/", "common/material/", "common/delta/", "common/messages/",
        "sim_server/step/", "sim_server/world/", "sim_server/engine/", "sim_server/scene/scene.h", "sim_server/bodies/",
        "sim_server/deformation/", "sim_server/collision/", "sim_server/surface/", "sim_server/components/",
        "sim_server/body_contact/", "sim_server/haptics/", "sim_server/instruments/instrument.h"},
       {"Eigen/"}},
      {"sim_server/simulation.",
       "",
       {"common/core/", "common/math/", "common/mesh/", "common/material/", "common/delta/", "sim_server/simulation.h",
        "sim_server/step/", "sim_server/world/", "sim_server/engine/", "sim_server/scene/scene.h"},
       {"Eigen/"}},
      {"sim_server/prepare/",
       "makes a scene ready before a simulation: fills volumes, chooses models, measures the machine",
       {"common/core/", "common/math/", "common/mesh/", "common/material/", "sim_server/prepare/",
        "sim_server/simulation.h", "sim_server/world/body.h", "sim_server/engine/", "sim_server/scene/scene.h",
        "sim_server/deformation/", "sim_server/surface/surface_engines.h", "sim_server/volume/", "sim_server/meshing/",
        "sim_server/planning/"},
       {"Eigen/", "nlohmann/"}},

      {"sim_server/session/",
       "runs without a network, recorder, journal of inputs, checkpoints, report, score of an exercise, replay",
       {"common/core/", "common/math/", "common/mesh/", "common/material/", "common/delta/", "common/messages/",
        "common/mcap/", "sim_server/session/", "sim_server/simulation.h", "sim_server/scene/scene",
        "sim_server/world/step_io.h", "sim_server/instruments/instrument.h"},
       {"Eigen/", "nlohmann/"}},
      {"sim_server/trials/",
       "a scene played many times by hands that differ from its traces, and the rate at which it succeeds",
       {"common/core/", "common/math/", "common/mesh/", "sim_server/trials/", "sim_server/session/",
        "sim_server/scene/scene", "sim_server/scene/yaml_value.h", "sim_server/instruments/instrument.h"},
       {"Eigen/"}},
      {"sim_server/commands/",
       "the commands of sim_server, a file each",
       {"common/core/", "common/math/", "common/mesh/", "common/material/", "common/dds/network_arguments.h",
        "sim_server/commands/", "sim_server/engine/standard_engines.h", "sim_server/engine/standard_traits.h",
        "sim_server/meshing/", "sim_server/net/", "sim_server/prepare/", "sim_server/scene/", "sim_server/session/",
        "sim_server/trials/", "sim_server/volume/tets/", "sim_server/wrap/fit_ellipsoids.h"},
       {"Eigen/"}},
      {"sim_server/net/",
       "the server's end of the wire, pace of a session, several servers",
       {"common/", "sim_server/net/", "sim_server/scene/scene", "sim_server/world/step_io.h", "sim_server/simulation.h",
        "sim_server/session/"},
       {"Eigen/"}},
      {"sim_server/main.cpp", "", {"sim_server/commands/"}, {}},

      {"render_client/replica/",
       "the copy of the bodies, fed with whatever arrives; knows neither DDS nor GL",
       {"common/core/", "common/math/", "common/mesh/", "common/material/", "common/delta/", "common/messages/",
        "render_client/replica/"},
       {"Eigen/"}},
      {"render_client/draw/",
       "frames to pictures: meshes, tissue, instruments, numbers; OSMesa behind one header",
       {"common/core/", "common/math/", "common/mesh/", "common/material/", "render_client/draw/",
        "render_client/replica/frame.h"},
       {"Eigen/", "ft2build.h"}},
      {"render_client/draw/osmesa_canvas.cpp",
       "",
       {"common/core/", "common/math/", "common/material/", "render_client/draw/"},
       {"Eigen/", "GL/"}},
      {"render_client/draw/egl_canvas.cpp", "", {"common/core/", "render_client/draw/"}, {"Eigen/", "GL/", "EGL/"}},
      {"render_client/draw/gl_",
       "",
       {"common/core/", "common/math/", "common/material/", "render_client/draw/"},
       {"Eigen/", "GL/", "GLES3/"}},
      {"render_client/output/",
       "PNG, video, contact sheet, charts",
       {"common/core/", "render_client/draw/image.h", "render_client/draw/overlay.h", "render_client/output/"},
       {"Eigen/"}},
      {"render_client/output/png.cpp",
       "",
       {"common/core/", "render_client/draw/image.h", "render_client/output/"},
       {"png.h"}},
      {"render_client/net/",
       "the viewer's end of the wire",
       {"common/", "render_client/net/", "render_client/replica/"},
       {"Eigen/"}},
      {"render_client/gateway/main.cpp",
       "",
       {"common/", "render_client/gateway/", "render_client/stills/still_maker.h"},
       {"Eigen/"}},
      {"render_client/stills/",
       "pictures of a session as JPEG, for browsers that can't draw",
       {"common/core/", "common/messages/", "render_client/draw/", "render_client/output/jpeg.h",
        "render_client/page/live_session.h", "render_client/stills/"},
       {"Eigen/"}},
      {"render_client/gateway/",
       "lets browsers take part: who holds what, what waits for whom, WebSocket and DDS",
       {"common/", "render_client/gateway/", "render_client/replica/"},
       {"Eigen/"}},
      {"render_client/window/",
       "a window on a desktop, its panel, and the view of the person at it; SDL and Dear ImGui behind headers",
       {"common/core/", "common/math/", "render_client/draw/", "render_client/replica/frame.h",
        "render_client/window/"},
       {"Eigen/"}},
      {"render_client/window/window.cpp",
       "",
       {"common/core/", "render_client/window/"},
       {"Eigen/", "SDL2/", "imgui.h", "backends/"}},
      {"render_client/window/panel.cpp",
       "",
       {"render_client/draw/colour_map.h", "render_client/window/"},
       {"Eigen/", "imgui.h"}},
      {"render_client/window/software_presenter.cpp",
       "",
       {"common/core/", "render_client/window/"},
       {"Eigen/", "SDL2/", "imgui.h"}},
      {"render_client/window/opengl_presenter.cpp",
       "",
       {"common/core/", "render_client/draw/", "render_client/window/"},
       {"Eigen/", "SDL2/", "imgui.h", "backends/"}},
      {"render_client/page/",
       "a page in a browser, without the browser: session, camera, a mouse as a hand",
       {"common/core/", "common/math/", "common/mesh/", "common/material/", "common/delta/", "common/messages/",
        "render_client/page/", "render_client/replica/", "render_client/draw/"},
       {"Eigen/"}},
      {"render_client/page/browser/",
       "what only a browser compiles, as WebAssembly: its canvas, its calls, HTML and script",
       {"common/math/", "render_client/page/", "render_client/draw/"},
       {"Eigen/", "GLES3/", "emscripten/"}},
      {"render_client/",
       "the viewer's program, and the programs that draw charts",
       {"common/", "render_client/"},
       {"Eigen/", "nlohmann/"}},

      {"device_bridge/device/",
       "a file for each kind of hand: scripted, virtual, somebody's wish, a handle, something to steer with",
       {"common/core/", "common/math/", "device_bridge/device/"},
       {"Eigen/"}},
      {"device_bridge/drivers/",
       "a file for each real device, and its library behind it; the table of devices",
       {"common/core/", "common/math/", "device_bridge/device/", "device_bridge/drivers/"},
       {"Eigen/"}},
      {"device_bridge/drivers/haply.cpp",
       "",
       {"common/core/", "common/math/", "device_bridge/device/", "device_bridge/drivers/haply.h"},
       {"Eigen/", "nlohmann/"}},
      {"device_bridge/drivers/gamepad.cpp",
       "",
       {"common/core/", "device_bridge/device/", "device_bridge/drivers/gamepad.h"},
       {"Eigen/", "SDL2/"}},
      {"device_bridge/drivers/mouse.cpp",
       "",
       {"common/core/", "device_bridge/device/", "device_bridge/drivers/mouse.h"},
       {"Eigen/", "SDL2/"}},
      {"device_bridge/servo/",
       "the 1 kHz loop, its watchdog, the log",
       {"common/core/", "common/math/", "device_bridge/device/", "device_bridge/servo/"},
       {"Eigen/"}},
      {"device_bridge/net/",
       "the bridge's end of the wire",
       {"common/", "device_bridge/net/", "device_bridge/servo/"},
       {"Eigen/"}},
      {"device_bridge/", "the bridge's program", {"common/", "device_bridge/"}, {"Eigen/"}},

      {"deploy/",
       "setup, test and demo; scenes, meshes and traces with the programs that made them",
       {"common/", "deploy/"},
       {"Eigen/"}},
      {"deploy/pictures/",
       "the pictures of the documents",
       {"common/", "deploy/pictures/", "render_client/", "sim_server/session/", "sim_server/prepare/",
        "sim_server/simulation.h", "sim_server/engine/standard_traits.h"},
       {"Eigen/"}},
      // Tests look into every room; they stay out of the libraries that a room hides.
      {"tests/",
       "support, units, rows of the papers, random strokes, accuracy, stability, regression, system, benchmarks, chart",
       {"common/", "sim_server/", "render_client/", "device_bridge/", "deploy/pictures/", "tests/"},
       {"Eigen/", "gtest/", "benchmark/", "nlohmann/"}},
      {"tests/unit/dds/",
       "participants, addresses, and the types of the wire",
       {"common/", "idl/", "tests/"},
       {"Eigen/", "gtest/", "fastcdr/"}},
      {"tests/support/fine_scene.cpp", "", {"common/", "tests/"}, {"Eigen/", "yaml-cpp/"}},
      {"tests/unit/scene/schema_test.cpp",
       "",
       {"sim_server/", "tests/"},
       {"Eigen/", "gtest/", "nlohmann/", "yaml-cpp/"}},
      {"tests/devices/",
       "drivers against fakes of their devices and services",
       {"common/", "device_bridge/", "tests/"},
       {"Eigen/", "gtest/", "nlohmann/", "SDL2/"}},
      {"tests/unit/window/",
       "views of a person at a window, and the panel without a screen",
       {"common/", "render_client/", "tests/"},
       {"Eigen/", "gtest/", "imgui.h"}},
      {"tests/unit/output/",
       "pictures and videos as files",
       {"common/", "render_client/", "tests/"},
       {"Eigen/", "gtest/", "png.h"}},
  };
  return table;
}

inline const Room* room_of(std::string_view path) {
  const Room* found = nullptr;
  for (const Room& room : rooms())
    if (path.starts_with(room.path) && (!found || room.path.size() > found->path.size())) found = &room;
  return found;
}

// Headers of the language and of the system: a single word, or below one of these folders.
inline bool is_system_header(std::string_view header) {
  for (const std::string_view folder : {"sys/", "arpa/", "netinet/", "linux/", "net/"})
    if (header.starts_with(folder)) return true;
  return header.find('/') == std::string_view::npos && header != "png.h" && header != "ft2build.h";
}

inline bool begins_with_one_of(std::string_view text, const std::vector<std::string_view>& beginnings) {
  return std::any_of(beginnings.begin(), beginnings.end(), [&](std::string_view b) { return text.starts_with(b); });
}

// "png.h" of #include <png.h>; empty when the line includes nothing by name.
inline std::string_view included(std::string_view line) {
  const auto skip_blanks = [&] { line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size())); };
  skip_blanks();
  if (!line.starts_with('#')) return {};
  line.remove_prefix(1);
  skip_blanks();
  if (!line.starts_with("include")) return {};
  line.remove_prefix(7);
  skip_blanks();
  if (line.empty() || (line[0] != '<' && line[0] != '"')) return {};
  const char closing = line[0] == '<' ? '>' : '"';
  line.remove_prefix(1);
  return line.substr(0, line.find(closing));
}

// "FILE:LINE: what is wrong" for each include that goes through a wall.
inline std::vector<std::string> walls_broken(std::string_view path, const std::string& text) {
  const Room* room = room_of(path);
  if (!room) return {std::string(path) + ": belongs to no room of the table"};
  std::vector<std::string> broken;
  std::istringstream lines(text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const std::string_view header = included(line);
    if (header.empty()) continue;
    const bool is_ours = line.find('"') != std::string::npos;
    const bool allowed = is_ours ? begins_with_one_of(header, room->project)
                                 : is_system_header(header) || begins_with_one_of(header, room->libraries);
    if (allowed) continue;
    broken.push_back(std::string(path) + ":" + std::to_string(number) + ": " + std::string(room->path) +
                     " may not include " + std::string(header));
  }
  return broken;
}

// "Outer" for each line `Type Outer::Inner::function(` with which a source defines a member outside of its class.
inline std::set<std::string> classes_implemented(const std::string& text) {
  static const std::regex member(R"((?:.*[ *&>])?([A-Z]\w*)(?:::\w+)*::~?\w+\(.*)");
  std::set<std::string> classes;
  std::istringstream lines(text);
  std::smatch found;
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || std::isalpha(static_cast<unsigned char>(line[0])) == 0) continue;
    const std::string head = line.substr(0, line.find('(') + 1);
    if (std::regex_match(head, found, member)) classes.insert(found[1]);
  }
  return classes;
}

constexpr std::size_t kMaxLines = 500;

// No file of ours may hold work left undone, paths of one machine, or more lines than a reader can keep in mind.
inline std::vector<std::string> untidy(std::string_view path, const std::string& text) {
  static const std::vector<std::string> forbidden = {
      "TO"
      "DO",
      "FIX"
      "ME",
      "/wo"
      "rk/",
      "/tm"
      "p/",
      "/ho"
      "me/"};
  std::vector<std::string> found;
  std::istringstream lines(text);
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    for (const std::string& word : forbidden)
      if (line.find(word) != std::string::npos)
        found.push_back(std::string(path) + ":" + std::to_string(number) + ": holds " + word);
  }
  if (number > kMaxLines) found.push_back(std::string(path) + ": has " + std::to_string(number) + " lines");
  return found;
}

}  // namespace sectio
