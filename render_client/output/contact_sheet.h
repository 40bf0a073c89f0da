// A few pictures of a run side by side, each with its simulated time.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "render_client/draw/image.h"

namespace sectio {

struct Shot {
  Image image;
  double sim_time_s = 0;
};

// Tiles in reading order, `columns` in a row, each tile_width_px wide, with thin gaps between them and the time below
// each. Shots may be of any size; all tiles have the aspect of the first one.
Image contact_sheet(std::span<const Shot> shots, int columns, int tile_width_px);

// Keeps evenly spaced shots of a run of unknown length in bounded memory.
class EvenShots {
 public:
  // Shots are kept at keep_width_px.
  EvenShots(std::size_t wanted, int keep_width_px) : wanted_(wanted), keep_width_px_(keep_width_px) {}

  void offer(const Image& image, double sim_time_s);
  // At most `wanted` of them, evenly spaced from the first to the last one that is kept.
  std::vector<Shot> shots() const;

 private:
  std::size_t wanted_;
  int keep_width_px_;
  std::size_t stride_ = 1, offered_ = 0;
  std::vector<Shot> kept_;
};

}  // namespace sectio
