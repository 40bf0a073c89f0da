#include "render_client/output/video.h"

#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <system_error>
#include <vector>

#include "common/core/error.h"

namespace sectio {

namespace {

std::vector<std::string> encoder_arguments(const std::string& path, int width_px, int height_px, double frames_per_s) {
  const std::string size = std::to_string(width_px) + "x" + std::to_string(height_px);
  // yuv420p needs even sides; the colour matrix is named, because players guess it from the size otherwise.
  return {"ffmpeg",
          "-loglevel",
          "error",
          "-y",
          "-f",
          "rawvideo",
          "-pixel_format",
          "rgba",
          "-video_size",
          size,
          "-framerate",
          std::to_string(frames_per_s),
          "-i",
          "pipe:0",
          "-an",
          "-vf",
          "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv",
          "-c:v",
          "libx264",
          "-preset",
          "veryfast",
          "-crf",
          "19",
          "-threads",
          "1",
          "-pix_fmt",
          "yuv420p",
          "-colorspace",
          "bt709",
          "-color_primaries",
          "bt709",
          "-color_trc",
          "bt709",
          "-color_range",
          "tv",
          "-movflags",
          "+faststart",
          "-f",
          "mp4",
          "file:" + path};
}

}  // namespace

VideoWriter::VideoWriter(std::string path, int width_px, int height_px, double frames_per_s)
    : path_(std::move(path)), width_px_(width_px), height_px_(height_px) {
  if (!(frames_per_s > 0)) throw InputError(path_ + ": frames per second: expected > 0");
  std::FILE* file = std::fopen(path_.c_str(), "wb");
  if (!file) throw InputError(path_ + ": can't be written: " + std::strerror(errno));
  std::fclose(file);
  // A socket pair instead of a pipe: send() can be told not to raise SIGPIPE.
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    throw InputError(path_ + ": no connection to an encoder: " + std::strerror(errno));
  }
  socket_ = ends[0];
  // In a group of its own: Ctrl-C stops the viewer, which then completes the file.
  const ChildOptions options{.descriptors = {{ends[1], STDIN_FILENO}}, .is_quiet = false, .has_own_group = true};
  try {
    encoder_ = std::make_unique<ChildProcess>(encoder_arguments(path_, width_px, height_px, frames_per_s), options);
  } catch (const std::system_error& error) {
    ::close(ends[0]);
    ::close(ends[1]);
    ::unlink(path_.c_str());
    throw InputError(path_ +
                     ": the program ffmpeg can't be started (Debian package ffmpeg): " + error.code().message());
  }
  ::close(ends[1]);
}

VideoWriter::~VideoWriter() {
  static_cast<void>(finish());
}

bool VideoWriter::write(const Image& image) {
  if (socket_ < 0 || !complete_) return false;
  if (image.width_px != width_px_ || image.height_px != height_px_) return complete_ = false;
  std::size_t sent = 0;
  while (sent < image.rgba.size()) {
    const ssize_t n = ::send(socket_, image.rgba.data() + sent, image.rgba.size() - sent, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return complete_ = false;
    sent += static_cast<std::size_t>(n);
  }
  return true;
}

bool VideoWriter::finish() {
  if (socket_ < 0) return complete_;
  ::close(socket_);
  socket_ = -1;
  const bool ended_well = encoder_->wait().well;
  return complete_ = complete_ && ended_well;
}

}  // namespace sectio
