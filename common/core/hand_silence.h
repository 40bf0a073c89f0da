// Without a word of whoever wishes an instrument somewhere, a page or a tracker, for so long nobody holds it.
#pragma once

namespace sectio {

constexpr double kWishSilence_s = 1;

}  // namespace sectio
