// A block, 60 x 60 x 40 mm, on a floor, whose middle is at x = y = 0: what tests of models begin with.
#pragma once

#include "sim_server/scene/scene.h"

namespace sectio::test {

constexpr double kBlockTop_m = 0.04;

Scene block_scene(const std::string& model);

}  // namespace sectio::test
