#include <algorithm>
#include <cstdio>

#include "sim_server/commands/commands.h"
#include "sim_server/engine/standard_traits.h"
#include "sim_server/scene/scene.h"

namespace sectio {

// One line a server: its name, a tab, and the bodies that the scene gives it. In the order of the bodies.
Arguments::Action servers_command(Arguments& arguments) {
  const auto file = std::make_shared<std::string>();
  arguments.option("SCENE", *file, "scene file (YAML)", Need::required);
  return [file] {
    std::vector<std::pair<std::string, std::string>> servers;
    for (const BodySpec& body : load_scene(*file, standard_traits()).bodies) {
      const auto known = std::ranges::find(servers, body.server, &std::pair<std::string, std::string>::first);
      if (known == servers.end())
        servers.emplace_back(body.server, body.name);
      else
        known->second += "," + body.name;
    }
    for (const auto& [server, bodies] : servers) std::printf("%s\t%s\n", server.c_str(), bodies.c_str());
    return 0;
  };
}

}  // namespace sectio
