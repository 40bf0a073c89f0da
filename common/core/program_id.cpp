#include "common/core/program_id.h"

#include <elf.h>
#include <link.h>

#include <cstdio>
#include <cstring>

namespace sectio {
namespace {

constexpr std::size_t padded(std::size_t size) {
  return (size + 3) & ~std::size_t{3};
}

std::string id_among(const char* notes, std::size_t size) {
  while (size > sizeof(ElfW(Nhdr))) {
    ElfW(Nhdr) note;
    std::memcpy(&note, notes, sizeof note);
    const std::size_t content = sizeof note + padded(note.n_namesz), end = content + padded(note.n_descsz);
    if (end > size) return {};
    if (note.n_type == NT_GNU_BUILD_ID && note.n_namesz == 4 && std::memcmp(notes + sizeof note, "GNU", 4) == 0) {
      std::string id;
      for (std::size_t i = 0; i < note.n_descsz; ++i) {
        char digits[3];
        std::snprintf(digits, sizeof digits, "%02x", static_cast<unsigned char>(notes[content + i]));
        id += digits;
      }
      return id;
    }
    notes += end;
    size -= end;
  }
  return {};
}

// The first object is the program.
int read_id(dl_phdr_info* object, std::size_t, void* id) {
  for (int i = 0; i < object->dlpi_phnum; ++i) {
    const ElfW(Phdr)& segment = object->dlpi_phdr[i];
    if (segment.p_type != PT_NOTE) continue;
    // NOLINTNEXTLINE(performance-no-int-to-ptr): an address in the loaded program
    const auto* const notes = reinterpret_cast<const char*>(object->dlpi_addr + segment.p_vaddr);
    auto& found = *static_cast<std::string*>(id);
    if (found = id_among(notes, segment.p_memsz); !found.empty()) break;
  }
  return 1;
}

}  // namespace

const std::string& program_id() {
  static const std::string id = [] {
    std::string found;
    dl_iterate_phdr(read_id, &found);
    return found;
  }();
  return id;
}

}  // namespace sectio
