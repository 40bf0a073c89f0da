// Pictures as PNG files, without their alpha. Only differences along the row and runs of them are encoded: a rendered
// frame becomes two thirds as large as with zlib level 1, in less time.
#pragma once

#include <string>

#include "render_client/draw/image.h"

namespace sectio {

// The file is written as a whole or not at all (common/core/write_file.h), with the same InputError.
void write_png(const std::string& path, const Image& image);

// Makes the directory and its parents where they are missing; throws InputError unless files can be written there.
void prepare_output_directory(const std::string& directory);

// frame_000000.png, frame_000001.png, ... in a directory that is made where it is missing.
class PngSequence {
 public:
  // Throws InputError when the directory can't be written.
  explicit PngSequence(std::string directory);

  void write(const Image& image);
  std::size_t count() const { return count_; }

 private:
  std::string directory_;
  std::size_t count_ = 0;
};

}  // namespace sectio
