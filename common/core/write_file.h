// Files of results: whole, or not at all.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace sectio {

enum class OnDisk { later, now };  // now: the file survives a crash of the machine

// Writes a file beside its place, as PATH.part, and renames it: when that fails, whatever was there before stays, and
// nothing half written is left. A PATH that is no file, as a pipe or /dev/stdout, is written to. Throws InputError
// "PATH: can't be written: why".
void write_file(const std::string& path, std::span<const std::uint8_t> bytes, OnDisk on_disk = OnDisk::later);
void write_file(const std::string& path, std::string_view text);

// Shortens a file to its beginning, which is whole; leaves alone what is no file.
void keep_beginning(const std::string& path, std::uint64_t bytes);

// Throws what write_file() would throw because of where the file is; leaves nothing there.
void check_can_write(const std::string& path);

}  // namespace sectio
