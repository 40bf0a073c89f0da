#include "common/math/orientation.h"

#include <array>
#include <cmath>

#include "common/core/error.h"

namespace sectio {
namespace {

// An exact number: a sum of doubles that do not overlap, ascending in magnitude, without zeros.
class Expansion {
 public:
  static Expansion difference(double x, double y) {
    Expansion e;
    e.add(x);
    e.add(-y);
    return e;
  }

  // Shewchuk's Grow-Expansion with elimination of zeros.
  void add(double b) {
    std::size_t n = 0;
    double sum = b;
    for (std::size_t i = 0; i < size_; ++i) {
      const double x = sum, y = terms_[i];
      sum = x + y;
      const double virtual_y = sum - x;
      const double tail = (x - (sum - virtual_y)) + (y - virtual_y);
      if (tail != 0) terms_[n++] = tail;
    }
    SECTIO_ASSERT(n < terms_.size(), "capacity");
    if (sum != 0) terms_[n++] = sum;
    size_ = n;
  }

  void add(const Expansion& other) {
    for (std::size_t i = 0; i < other.size_; ++i) add(other.terms_[i]);
  }

  Expansion times(const Expansion& other, double factor = 1) const {  // factor is 1 or -1
    Expansion product;
    for (std::size_t i = 0; i < size_; ++i)
      for (std::size_t j = 0; j < other.size_; ++j) {
        const double x = factor * terms_[i], high = x * other.terms_[j];
        product.add(std::fma(x, other.terms_[j], -high));
        product.add(high);
      }
    return product;
  }

  int sign() const { return size_ == 0 ? 0 : terms_[size_ - 1] > 0 ? 1 : -1; }

 private:
  std::array<double, 200> terms_{};  // a determinant of three differences needs 192
  std::size_t size_ = 0;
};

using Expansion3 = std::array<Expansion, 3>;

Expansion3 exact_difference(const Vec3& a, const Vec3& b) {
  return {Expansion::difference(a.x(), b.x()), Expansion::difference(a.y(), b.y()),
          Expansion::difference(a.z(), b.z())};
}

Expansion exact_minor(const Expansion3& u, const Expansion3& v, std::size_t i) {
  const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
  Expansion m = u[j].times(v[k]);
  m.add(u[k].times(v[j], -1));
  return m;
}

int exact_orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Expansion3 u = exact_difference(b, a), v = exact_difference(c, a), w = exact_difference(d, a);
  Expansion det;
  for (std::size_t i = 0; i < 3; ++i) det.add(exact_minor(u, v, i).times(w[i]));
  return det.sign();
}

constexpr double kRoundoff = 0x1p-53;

}  // namespace

Orientation orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 u = b - a, v = c - a, w = d - a;
  const double yz = u.y() * v.z(), zy = u.z() * v.y();
  const double zx = u.z() * v.x(), xz = u.x() * v.z();
  const double xy = u.x() * v.y(), yx = u.y() * v.x();
  const double det = (yz - zy) * w.x() + (zx - xz) * w.y() + (xy - yx) * w.z();
  const double permanent = (std::abs(yz) + std::abs(zy)) * std::abs(w.x()) +
                           (std::abs(zx) + std::abs(xz)) * std::abs(w.y()) +
                           (std::abs(xy) + std::abs(yx)) * std::abs(w.z());
  // Shewchuk's static bound is (7 + 56 u) u; 8 u leaves room for the rounding of the permanent.
  const double bound = 8 * kRoundoff * permanent;
  if (det > bound) return {det, 1};
  if (det < -bound) return {det, -1};
  return {det, exact_orientation(a, b, c, d)};
}

int leading_sign_of_cross(const Vec3& a0, const Vec3& a1, const Vec3& b0, const Vec3& b1) {
  const Expansion3 u = exact_difference(a1, a0), v = exact_difference(b1, b0);
  for (std::size_t i = 0; i < 3; ++i)
    if (const int sign = exact_minor(u, v, i).sign()) return sign;
  return 0;
}

}  // namespace sectio
