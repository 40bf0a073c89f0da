// The other entry of libFuzzer (deploy/fuzz): files as a person may bring them, through the real readers. The first
// letter of an input says which of them reads the rest.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "common/core/error.h"
#include "common/core/log.h"
#include "common/delta/journal.h"
#include "common/math/archive.h"
#include "common/math/trace.h"
#include "sim_server/net/played_record.h"
#include "sim_server/scene/scene.h"
#include "sim_server/session/checkpoint.h"
#include "sim_server/session/input_log.h"

namespace sectio {
namespace {

// Models and processes as the product has them, in the ways in which the reader of scenes tells them apart.
const EngineTraits& traits() {
  static const EngineTraits all = [] {
    const Key number{.name = "damping_1", .meaning = "A number."};
    return EngineTraits{
        {{.name = "surface_springs", .meaning = "Springs.", .accepts_templates = true, .keys = {number}},
         {.name = "tetra", .meaning = "Volume.", .needs_volume = true},
         {.name = "rigid", .meaning = "Rigid.", .can_cut = false}},
        {{.kind = "bleeding", .meaning = "Blood.", .most_bodies = 2, .keys = {number}}}};
  }();
  return all;
}

void read_record(const std::string& path) {
  PlayedRecord record(path);
  for (const double time_s : {0.0, 0.5 * record.end_s(), record.end_s()}) {
    record.seek(time_s);
    if (!record.world().can_be_shown()) std::abort();
    if (record.world().view().bodies.size() != record.world().meshes().size()) std::abort();
    for (std::uint32_t b = 0; b < record.world().meshes().size(); ++b) record.world().view().scalars(b);
  }
  record.world().differs_from_end();
}

void read_inputs(const std::string& path) {
  InputLogReader reader(path);
  while (reader.next()) {
  }
  reader.damage();
}

// With its checksum, which a fuzzer can't guess, and what is behind that.
void read_checkpoint(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
  std::string why;
  if (!checkpoint_from(bytes, why) && why.empty()) std::abort();
  Archive archive(bytes);
  Checkpoint checkpoint;
  archive(checkpoint);
}

void read(char kind, const std::string& path) {
  try {
    switch (kind) {
      case 'r':
        return read_record(path);
      case 'i':
        return read_inputs(path);
      case 'j':
        salvage_journal(path);
        return;
      case 'c':
        return read_checkpoint(path);
      case 's':
        load_scene(path, traits());
        return;
      case 't':
        load_trace(path);
        return;
      default:
        return;
    }
  } catch (const InputError& error) {  // nothing else may come out of a reader
    if (std::string(error.what()).empty()) std::abort();
  }
}

}  // namespace
}  // namespace sectio

extern "C" int fuzz_file(const std::uint8_t* data, std::size_t size) {
  static const int file = memfd_create("fuzz", 0);
  static const std::string path = "/proc/self/fd/" + std::to_string(file);
  sectio::set_log_level(sectio::LogLevel::error);
  if (size == 0) return 0;
  if (ftruncate(file, 0) != 0) std::abort();
  if (pwrite(file, data + 1, size - 1, 0) != static_cast<ssize_t>(size - 1)) std::abort();
  sectio::read(static_cast<char>(data[0]), path);
  return 0;
}
