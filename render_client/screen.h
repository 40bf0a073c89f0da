// Draws frames, shows them in a window and writes them to files, whichever was asked for.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "render_client/draw/canvas.h"
#include "render_client/draw/draw_frame.h"
#include "render_client/output/contact_sheet.h"
#include "render_client/output/png.h"
#include "render_client/output/video.h"
#include "render_client/viewer_options.h"
#include "render_client/window/window.h"

namespace sectio {

// A full disk costs a viewer its files, and not the session. False: the disk is full.
bool try_to_write(const std::function<void()>& write);

class Screen {
 public:
  // With --no-pictures it does nothing. The options outlive it.
  explicit Screen(const ViewerOptions& options);

  // The person at the window, if there is one. False: they have closed it.
  bool listen();
  // All that they did, as listen() last heard it.
  const WindowInput& heard() const { return heard_; }
  bool halted() const { return viewpoint_.halted(); }
  // The session's part of the panel over the next picture; the view's part is added.
  void set_panel(PanelView panel) { panel_ = std::move(panel); }
  // `missed`: the number of pictures before this one that came too late; a video shows this one in their place.
  void show(Frame& frame, int missed, double frames_per_s);
  // False when something that was asked for is not there.
  bool finish();

 private:
  bool try_to_write(const std::function<void()>& write);
  void open_window();
  bool wants_pixels() const;
  DrawOptions draw_options(double frames_per_s) const;
  void show_in_window(const Image& image);
  void write(const Image& image, double sim_time_s, int missed);

  const ViewerOptions& options_;
  std::unique_ptr<Window> window_;
  Viewpoint viewpoint_;
  WindowInput heard_;
  PanelView panel_;
  bool keeps_picture_ = false, is_whole_ = true, has_missed_field_ = false;
  std::optional<SectionPlane> section_;  // without a window
  std::unique_ptr<Canvas> canvas_;       // but for the window's own
  std::unique_ptr<FramePainter> painter_;
  std::unique_ptr<PngSequence> pngs_;
  std::unique_ptr<VideoWriter> video_;
  EvenShots shots_;
};

}  // namespace sectio
