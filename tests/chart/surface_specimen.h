// The surface springs with their bed, of a body that a ball is pressed into; they make no claim on other scenes.
#pragma once

#include "tests/chart/specimen.h"

namespace sectio::chart {

std::unique_ptr<Specimen> surface_specimen(const ChartScene& scene, int across, double step_s);

}  // namespace sectio::chart
