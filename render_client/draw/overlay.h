// Text on pictures (FreeType stays inside overlay.cpp), and the panels over a frame: its numbers and its legend.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "render_client/draw/image.h"

namespace sectio {

// One typeface at one size. Not for use by two threads at once. Text is UTF-8; unknown characters show as a box.
class Text {
 public:
  // Throws InputError when the font is not installed.
  explicit Text(int size_px);
  ~Text();
  Text(Text&&) noexcept;
  Text& operator=(Text&&) noexcept;

  int line_height_px() const;
  int ascent_px() const;
  int width_px(std::string_view text) const;

  // y_px is the top of the line.
  void draw(Image& image, int x_px, int y_px, std::string_view text, Colour colour) const;

 private:
  struct Face;
  std::unique_ptr<Face> face_;
};

// The rectangle that draw_panel() fills for these lines.
Rect panel_rect(const Text& text, const std::vector<std::string>& lines);
// Lines of text on a dark translucent panel in the top left corner of the picture, or of a part that begins at left_px.
void draw_panel(Image& image, const Text& text, const std::vector<std::string>& lines, int left_px = 0);

struct FieldRange {
  float least = 0, most = 1;
};
// The name of a scalar field and a bar of its colours (colour_map.h) with the ends of its range, on a panel in the
// bottom left corner.
void draw_legend(Image& image, const Text& text, const std::string& name, const FieldRange& range, int left_px = 0);

}  // namespace sectio
