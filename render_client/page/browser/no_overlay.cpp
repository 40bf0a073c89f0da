// The numbers of a page are HTML, so its pictures carry none: FreeType stays out of the browser.
#include "render_client/draw/overlay.h"

namespace sectio {

struct Text::Face {};

Text::Text(int) {}
Text::~Text() = default;
void draw_panel(Image&, const Text&, const std::vector<std::string>&, int) {}
void draw_legend(Image&, const Text&, const std::string&, const FieldRange&, int) {}

}  // namespace sectio
