#include "render_client/output/jpeg.h"

#include <turbojpeg.h>

#include <memory>
#include <stdexcept>

namespace sectio {

std::string to_jpeg(const Image& image, int quality) {
  const std::unique_ptr<void, int (*)(void*)> coder(tjInitCompress(), tjDestroy);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const int failed = !coder || tjCompress2(coder.get(), image.rgba.data(), image.width_px, 0, image.height_px,
                                           TJPF_RGBA, &bytes, &size, TJSAMP_420, quality, TJFLAG_FASTDCT);
  const std::unique_ptr<unsigned char, void (*)(unsigned char*)> owner(bytes, tjFree);
  if (failed) throw std::runtime_error("JPEG: " + std::string(tjGetErrorStr2(coder.get())));
  return {reinterpret_cast<const char*>(bytes), size};
}

}  // namespace sectio
