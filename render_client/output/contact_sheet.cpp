#include "render_client/output/contact_sheet.h"

#include <algorithm>

#include "common/core/formatted.h"
#include "render_client/draw/overlay.h"

namespace sectio {

Image contact_sheet(std::span<const Shot> shots, int columns, int tile_width_px) {
  constexpr int kGap_px = 6;
  if (shots.empty() || shots[0].image.width_px == 0) return Image(1, 1);
  const Text text(std::clamp(tile_width_px / 22, 10, 28));
  columns = std::clamp(columns, 1, static_cast<int>(shots.size()));
  const int rows = (static_cast<int>(shots.size()) + columns - 1) / columns;
  const int tile_height_px = tile_width_px * shots[0].image.height_px / shots[0].image.width_px;
  const int caption_px = text.line_height_px();
  Image sheet(columns * (tile_width_px + kGap_px) + kGap_px, rows * (tile_height_px + caption_px + kGap_px) + kGap_px,
              {18, 20, 24, 255});
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const int column = static_cast<int>(i) % columns, row = static_cast<int>(i) / columns;
    const int x = kGap_px + column * (tile_width_px + kGap_px);
    const int y = kGap_px + row * (tile_height_px + caption_px + kGap_px);
    paste(sheet, downscale(shots[i].image, tile_width_px), x, y);
    text.draw(sheet, x + 2, y + tile_height_px, formatted("t = %.2f s", shots[i].sim_time_s), {215, 220, 226, 255});
  }
  return sheet;
}

void EvenShots::offer(const Image& image, double sim_time_s) {
  if (offered_++ % stride_ != 0 || wanted_ == 0) return;
  kept_.push_back({downscale(image, keep_width_px_), sim_time_s});
  // At four times the wanted number every second shot is dropped, and from now on only every second one is kept.
  if (kept_.size() < 4 * wanted_) return;
  for (std::size_t i = 0; 2 * i < kept_.size(); ++i) {
    if (i > 0) kept_[i] = std::move(kept_[2 * i]);
  }
  kept_.resize(kept_.size() / 2);
  stride_ *= 2;
}

std::vector<Shot> EvenShots::shots() const {
  if (kept_.size() <= wanted_) return kept_;
  std::vector<Shot> even;
  for (std::size_t i = 0; i < wanted_; ++i) {
    even.push_back(kept_[wanted_ == 1 ? 0 : i * (kept_.size() - 1) / (wanted_ - 1)]);
  }
  return even;
}

}  // namespace sectio
