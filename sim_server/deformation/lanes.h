// Vectors whose components each fill a register of R.
#pragma once

#include <cstdint>

namespace sectio {

template <class R>
struct Lanes3 {
  typename R::Reg x, y, z;
};

template <class R>
struct Lanes4 {
  typename R::Reg x, y, z, w;
};

}  // namespace sectio
