// A video that a browser plays. Raw pictures go to the program `ffmpeg`, which isn't linked; it writes H.264 (yuv420p)
// in an MP4 file with its index in front.
#pragma once

#include <memory>
#include <string>

#include "common/core/child_process.h"
#include "render_client/draw/image.h"

namespace sectio {

// One thread at a time. write() blocks while the encoder is behind (about 10 ms a frame at 1280 x 720 on one core).
class VideoWriter {
 public:
  // Throws InputError when ffmpeg is not installed or the file can't be written.
  VideoWriter(std::string path, int width_px, int height_px, double frames_per_s);
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  // False once the encoder has died; the caller then carries on without video. No signal is raised.
  [[nodiscard]] bool write(const Image& image);

  // Waits for the encoder to complete the file. False unless the file holds all frames written. Idempotent.
  [[nodiscard]] bool finish();

 private:
  std::string path_;
  int width_px_, height_px_;
  int socket_ = -1;
  std::unique_ptr<ChildProcess> encoder_;
  bool complete_ = true;
};

}  // namespace sectio
