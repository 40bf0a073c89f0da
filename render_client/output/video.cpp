#include "render_client/output/video.h"

#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <vector>

#include "common/core/error.h"

extern char** environ;

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

// The encoder is in a process group of its own: Ctrl-C stops the viewer, which then completes the file. Returns 0 or an
// errno.
int spawn_reading_from(int socket, std::vector<std::string> arguments, pid_t& child) {
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, socket, STDIN_FILENO);
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  const int error = posix_spawnp(&child, argv[0], &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return error;
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
  const int error = spawn_reading_from(ends[1], encoder_arguments(path_, width_px, height_px, frames_per_s), encoder_);
  ::close(ends[1]);
  if (error != 0) {
    ::close(ends[0]);
    ::unlink(path_.c_str());
    throw InputError(path_ + ": the program ffmpeg can't be started (Debian package ffmpeg): " + std::strerror(error));
  }
  socket_ = ends[0];
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
  int status = 0;
  pid_t waited = 0;
  do {
    waited = ::waitpid(encoder_, &status, 0);
  } while (waited < 0 && errno == EINTR);
  complete_ = complete_ && waited == encoder_ && WIFEXITED(status) && WEXITSTATUS(status) == 0;
  return complete_;
}

}  // namespace sectio
