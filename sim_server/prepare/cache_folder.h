// The user's cache, for what is measured or planned once on a machine.
#pragma once

#include <filesystem>
#include <string>

namespace sectio {

// $XDG_CACHE_HOME/sectio, else ~/.cache/sectio; empty if there is neither.
std::filesystem::path cache_folder();

// Beside, and renamed, because other programs may read the file meanwhile. A file that can't be written is no error.
void write_to_cache(const std::filesystem::path& file, const std::string& text);

}  // namespace sectio
