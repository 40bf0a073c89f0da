// Vectors whose components each fill a register of R.
#pragma once

#include <cstdint>

namespace sectio {

template <class R>
struct Lanes3 {
  typename R::Reg x, y, z;
};

template <class R>
[[gnu::always_inline]] inline typename R::Reg dot(const Lanes3<R>& a, const Lanes3<R>& b) {
  return R::fma(a.x, b.x, R::fma(a.y, b.y, R::mul(a.z, b.z)));
}

template <class R>
struct Lanes4 {
  typename R::Reg x, y, z, w;
};

}  // namespace sectio
