#include "render_client/stills/still_maker.h"

#include <utility>

#include "common/core/log.h"
#include "common/core/wall_time.h"
#include "render_client/draw/canvas.h"
#include "render_client/draw/draw_frame.h"
#include "render_client/output/jpeg.h"
#include "render_client/page/live_session.h"

namespace sectio {

namespace {

constexpr std::size_t kMostWaiting = 4;  // frames

}  // namespace

StillMaker::StillMaker(int width_px, int height_px)
    : width_px_(width_px), height_px_(height_px), thread_([this] { run(); }) {}

StillMaker::~StillMaker() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void StillMaker::feed(std::vector<std::uint8_t> frame) {
  {
    const std::lock_guard lock(mutex_);
    incoming_.push_back(std::move(frame));
  }
  changed_.notify_all();
}

bool StillMaker::has_room() const {
  const std::lock_guard lock(mutex_);
  return incoming_.size() < kMostWaiting;
}

std::vector<std::uint8_t> StillMaker::take_outgoing() {
  const std::lock_guard lock(mutex_);
  return std::exchange(outgoing_, {});
}

std::uint64_t StillMaker::ask() {
  std::uint64_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    asked_ = number = begun_ + 1;
  }
  changed_.notify_all();
  return number;
}

std::shared_ptr<const Still> StillMaker::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

void StillMaker::run() {
  LiveSession session;
  Frame frame;
  bool known = false;
  std::unique_ptr<Canvas> canvas;
  std::unique_ptr<FramePainter> painter;
  std::unique_lock lock(mutex_);
  while (!stop_) {
    changed_.wait(lock, [&] { return stop_ || !incoming_.empty() || (known && asked_ > begun_); });
    const std::vector<std::vector<std::uint8_t>> frames = std::exchange(incoming_, {});
    const bool draws = known && asked_ > begun_;
    if (draws) ++begun_;
    const std::uint64_t number = begun_;
    lock.unlock();
    for (const auto& each : frames) session.receive(each, steady_now_s());
    known = session.frame(steady_now_s(), frame) || known;
    const std::vector<std::uint8_t> answer = session.take_outgoing();
    std::shared_ptr<const Still> still;
    if (draws) {
      try {
        if (!canvas) canvas = make_osmesa_canvas(width_px_, height_px_, 1);
        if (!painter) painter = std::make_unique<FramePainter>(*canvas);
        still = std::make_shared<Still>(Still{number, to_jpeg(painter->draw_frame(frame))});
      } catch (const std::exception& error) {
        log_limited(LogLevel::warning, "still", std::string("no picture can be drawn: ") + error.what());
      }
    }
    lock.lock();
    outgoing_.insert(outgoing_.end(), answer.begin(), answer.end());
    if (still) newest_ = still;
  }
}

}  // namespace sectio
