// Measures the processor's time that cuts take on this machine.
#pragma once

#include "sim_server/engine/engine_table.h"
#include "sim_server/planning/plan.h"

namespace sectio {

// Leads blades through blocks of a method's model, shallow and deep, coarse and fine.
class CutSpeed {
 public:
  explicit CutSpeed(const EngineTable& engines);
  planning::CutRate of(const planning::Method& method, const planning::Rate& rate) const;

 private:
  const EngineTable& engines_;
  Scene coarse_, fine_;
};

}  // namespace sectio
