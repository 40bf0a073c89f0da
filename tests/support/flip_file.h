// A disk that has gone bad.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>

namespace sectio::test {

// Flips the bits of a mask in one byte of a file; once more brings it back.
inline void flip(const std::string& path, std::uint64_t byte, int mask) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekg(static_cast<std::streamoff>(byte));
  const int flipped = file.get() ^ mask;
  file.seekp(static_cast<std::streamoff>(byte));
  file.put(static_cast<char>(flipped));
}

}  // namespace sectio::test
