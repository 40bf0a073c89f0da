#include "render_client/draw/overlay.h"

#include <algorithm>
#include <map>

#include <ft2build.h>
#include FT_FREETYPE_H

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "render_client/draw/colour_map.h"

namespace sectio {

namespace {

constexpr const char* kFontFile = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
constexpr int kPanelMargin = 12;
constexpr int kPanelPadding = 8;
constexpr Colour kPanelColour{8, 10, 14, 130};
constexpr Colour kTextColour{225, 230, 235, 255};

// Decodes one character and moves on; a malformed byte stands for itself.
char32_t next_character(std::string_view& text) {
  const auto lead = static_cast<unsigned char>(text.front());
  const std::size_t length = lead < 0xC0 ? 1 : lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : 4;
  if (length == 1 || length > text.size()) {
    text.remove_prefix(1);
    return lead;
  }
  char32_t code = lead & (0x7Fu >> length);
  for (std::size_t i = 1; i < length; ++i) code = (code << 6) | (static_cast<unsigned char>(text[i]) & 0x3Fu);
  text.remove_prefix(length);
  return code;
}

struct Glyph {
  int left_px = 0, top_px = 0, width_px = 0, height_px = 0, advance_px = 0;
  std::vector<std::uint8_t> coverage;
};

}  // namespace

struct Text::Face {
  FT_Library library = nullptr;
  FT_Face face = nullptr;
  std::map<char32_t, Glyph> glyphs;

  ~Face() {
    if (face) FT_Done_Face(face);
    if (library) FT_Done_FreeType(library);
  }

  const Glyph& glyph(char32_t code) {
    const auto [entry, is_new] = glyphs.try_emplace(code);
    Glyph& g = entry->second;
    if (!is_new || FT_Load_Char(face, code, FT_LOAD_RENDER) != 0) return g;
    const FT_GlyphSlot slot = face->glyph;
    g.left_px = slot->bitmap_left;
    g.top_px = slot->bitmap_top;
    g.width_px = static_cast<int>(slot->bitmap.width);
    g.height_px = static_cast<int>(slot->bitmap.rows);
    g.advance_px = static_cast<int>(slot->advance.x >> 6);
    for (int y = 0; y < g.height_px; ++y) {
      const unsigned char* row = slot->bitmap.buffer + y * slot->bitmap.pitch;
      g.coverage.insert(g.coverage.end(), row, row + g.width_px);
    }
    return g;
  }
};

Text::Text(int size_px) : face_(std::make_unique<Face>()) {
  if (FT_Init_FreeType(&face_->library) != 0) throw InputError("FreeType can't be initialised");
  if (FT_New_Face(face_->library, kFontFile, 0, &face_->face) != 0) {
    throw InputError(std::string(kFontFile) + ": can't be read as a font (Debian package fonts-dejavu-core)");
  }
  FT_Set_Pixel_Sizes(face_->face, 0, static_cast<FT_UInt>(std::max(size_px, 4)));
}

Text::~Text() = default;
Text::Text(Text&&) noexcept = default;
Text& Text::operator=(Text&&) noexcept = default;

int Text::line_height_px() const {
  return static_cast<int>(face_->face->size->metrics.height >> 6);
}
int Text::ascent_px() const {
  return static_cast<int>(face_->face->size->metrics.ascender >> 6);
}

int Text::width_px(std::string_view text) const {
  int width = 0;
  while (!text.empty()) width += face_->glyph(next_character(text)).advance_px;
  return width;
}

void Text::draw(Image& image, int x_px, int y_px, std::string_view text, Colour colour) const {
  const int baseline = y_px + ascent_px();
  while (!text.empty()) {
    const Glyph& g = face_->glyph(next_character(text));
    for (int y = 0; y < g.height_px; ++y) {
      for (int x = 0; x < g.width_px; ++x) {
        const std::uint8_t coverage = g.coverage[static_cast<std::size_t>(y) * static_cast<std::size_t>(g.width_px) +
                                                 static_cast<std::size_t>(x)];
        if (coverage == 0) continue;
        blend(image, x_px + g.left_px + x, baseline - g.top_px + y, colour, static_cast<float>(coverage) / 255.0f);
      }
    }
    x_px += g.advance_px;
  }
}

Rect panel_rect(const Text& text, const std::vector<std::string>& lines) {
  int width = 0;
  for (const std::string& line : lines) width = std::max(width, text.width_px(line));
  return {kPanelMargin, kPanelMargin, width + 2 * kPanelPadding,
          static_cast<int>(lines.size()) * text.line_height_px() + 2 * kPanelPadding};
}

void draw_panel(Image& image, const Text& text, const std::vector<std::string>& lines, int left_px) {
  if (lines.empty()) return;
  Rect rect = panel_rect(text, lines);
  rect.x_px += left_px;
  fill(image, rect, kPanelColour);
  int y = rect.y_px + kPanelPadding;
  for (const std::string& line : lines) {
    text.draw(image, rect.x_px + kPanelPadding, y, line, kTextColour);
    y += text.line_height_px();
  }
}

void draw_legend(Image& image, const Text& text, const std::string& name, const FieldRange& range, int left_px) {
  const std::string before = name + formatted("   %.4g ", static_cast<double>(range.least));
  const std::string after = formatted(" %.4g", static_cast<double>(range.most));
  const int line_px = text.line_height_px(), bar_px = 8 * line_px, before_px = text.width_px(before);
  const Rect panel{left_px + kPanelMargin, image.height_px - kPanelMargin - line_px - 2 * kPanelPadding,
                   before_px + bar_px + text.width_px(after) + 2 * kPanelPadding, line_px + 2 * kPanelPadding};
  fill(image, panel, kPanelColour);
  const int x = panel.x_px + kPanelPadding, y = panel.y_px + kPanelPadding;
  text.draw(image, x, y, before, kTextColour);
  for (int i = 0; i < bar_px; ++i) {
    const float share = static_cast<float>(i) / static_cast<float>(bar_px - 1);
    fill(image, {x + before_px + i, y + line_px / 4, 1, line_px / 2}, map_colour(share));
  }
  text.draw(image, x + before_px + bar_px, y, after, kTextColour);
}

}  // namespace sectio
