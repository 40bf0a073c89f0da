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
[[gnu::always_inline]] inline Lanes3<R> cross(const Lanes3<R>& a, const Lanes3<R>& b) {
  return {R::minus_fma(a.z, b.y, R::mul(a.y, b.z)), R::minus_fma(a.x, b.z, R::mul(a.z, b.x)),
          R::minus_fma(a.y, b.x, R::mul(a.x, b.y))};
}

template <class R>
struct Lanes4 {
  typename R::Reg x, y, z, w;
};

}  // namespace sectio
