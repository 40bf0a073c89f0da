// The engines that a scene can name, as the reader of scenes sees them: plain data. Nothing in this room knows a model
// by its name; whoever calls load_scene() says which there are (standard_traits() for those of the product).
#pragma once

#include <string>
#include <vector>

#include "sim_server/scene/key.h"

namespace sectio {

// One for each name that may stand behind `model:`.
struct ModelTraits {
  std::string name;
  std::string meaning;             // one plain sentence
  bool needs_volume = false;       // its inside is filled with tetrahedra; `volume:`, semi_progressive and snap_ratio
  bool can_cut = true;             // instruments cut it; `cutting:`
  bool accepts_templates = false;  // its surface may be divided where an instrument presses or cuts; `style: templates`
  std::vector<std::string> volume_keys = {};  // keys of `volume:`, which other models refuse unless they name them, too
  std::vector<Key> keys = {};                 // its own, beside `model:`; the values arrive in BodySpec::options
};

// One for each name that may stand behind `kind:` of a process: something that goes on in a body, or between bodies.
struct ProcessTraits {
  std::string kind;
  std::string meaning;  // one plain sentence
  std::size_t fewest_bodies = 1, most_bodies = 1;
  std::vector<Key> keys = {};  // its own; the values arrive in ProcessSpec::options
};

struct EngineTraits {
  std::vector<ModelTraits> models;
  std::vector<ProcessTraits> processes;
};

}  // namespace sectio
