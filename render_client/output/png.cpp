#include "render_client/output/png.h"

#include <png.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <vector>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/write_file.h"

namespace sectio {

namespace {

// libpng calls back on an error and must not return; an exception unwinds through it as Debian's libpng is built
// with unwind tables.
[[noreturn]] void fail(png_structp png, png_const_charp message) {
  throw InputError(*static_cast<const std::string*>(png_get_error_ptr(png)) + ": " + message);
}

void ignore_warning(png_structp, png_const_charp) {}

void append(png_structp png, png_bytep bytes, png_size_t size) {
  auto& all = *static_cast<std::vector<std::uint8_t>*>(png_get_io_ptr(png));
  all.insert(all.end(), bytes, bytes + size);
}

struct Writer {
  png_structp png = nullptr;
  png_infop info = nullptr;
  ~Writer() { png_destroy_write_struct(&png, &info); }
};

}  // namespace

void write_png(const std::string& path, const Image& image) {
  std::vector<std::uint8_t> bytes;
  std::string place = path;
  Writer writer;
  writer.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &place, fail, ignore_warning);
  if (!writer.png) throw InputError(path + ": libpng can't start");
  writer.info = png_create_info_struct(writer.png);
  png_set_write_fn(writer.png, &bytes, append, nullptr);
  png_set_compression_strategy(writer.png, Z_RLE);
  png_set_filter(writer.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_set_IHDR(writer.png, writer.info, static_cast<png_uint_32>(image.width_px),
               static_cast<png_uint_32>(image.height_px), 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(writer.png, writer.info);
  png_set_filler(writer.png, 0, PNG_FILLER_AFTER);
  for (int y = 0; y < image.height_px; ++y) png_write_row(writer.png, image.pixel(0, y));
  png_write_end(writer.png, nullptr);
  write_file(path, bytes);
}

void prepare_output_directory(const std::string& directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (!std::filesystem::is_directory(directory)) {
    throw InputError(directory + ": can't be made a directory" + (error ? ": " + error.message() : ""));
  }
  if (::access(directory.c_str(), W_OK | X_OK) != 0) {
    throw InputError(directory + ": can't be written: " + std::strerror(errno));
  }
}

PngSequence::PngSequence(std::string directory) : directory_(std::move(directory)) {
  prepare_output_directory(directory_);
}

void PngSequence::write(const Image& image) {
  write_png(directory_ + formatted("/frame_%06zu.png", count_), image);
  ++count_;
}

}  // namespace sectio
