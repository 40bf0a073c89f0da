#include "sim_server/instruments/instrument.h"

#include <algorithm>
#include <array>

#include "common/core/error.h"
#include "sim_server/instruments/cautery_hook.h"
#include "sim_server/instruments/forceps.h"
#include "sim_server/instruments/knife.h"
#include "sim_server/instruments/medical_scissors.h"
#include "sim_server/instruments/probe.h"
#include "sim_server/instruments/scalpel.h"
#include "sim_server/instruments/scissors.h"

namespace sectio {
namespace {

const auto& instruments() {
  static const std::array table{scalpel(), cautery_hook(), knife(), scissors(), medical_scissors(), probe(), forceps()};
  return table;
}

}  // namespace

const InstrumentKind& instrument_of(std::string_view kind) {
  const auto found = std::ranges::find(instruments(), kind, &InstrumentKind::name);
  if (found == instruments().end()) throw InputError("no instrument is called " + std::string(kind));
  return *found;
}

std::vector<std::string> instrument_kinds() {
  std::vector<std::string> kinds;
  for (const InstrumentKind& instrument : instruments()) kinds.emplace_back(instrument.name);
  return kinds;
}

}  // namespace sectio
