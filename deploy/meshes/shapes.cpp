#include "deploy/meshes/shapes.h"

#include <algorithm>
#include <cmath>

namespace sectio {
namespace {

// Approximate distance to an ellipsoid: the gradient of |p / r| has the length |p / r^2| / |p / r|.
double ellipsoid(const Vec3& p, const Vec3& r) {
  const double k0 = p.cwiseQuotient(r).norm(), k1 = p.cwiseQuotient(r.cwiseProduct(r)).norm();
  return k1 > 0 ? k0 * (k0 - 1) / k1 : -r.minCoeff();
}

// Smooth minimum and maximum, rounded off over the length k.
double blend_min(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - h * h * k / 4;
}
double blend_max(double a, double b, double k) {
  return -blend_min(-a, -b, k);
}

}  // namespace

double liver(const Vec3& p) {
  const double right = ellipsoid(p - Vec3(-0.034, 0.002, -0.006), Vec3(0.074, 0.077, 0.045));
  const double left = ellipsoid(p - Vec3(0.044, -0.012, 0.008), Vec3(0.068, 0.060, 0.024));
  const double lobes = blend_min(right, left, 0.050);
  const double stomach = ellipsoid(p - Vec3(0.030, 0.030, -0.080), Vec3(0.150, 0.150, 0.066));
  const double notch = ellipsoid(p - Vec3(0.026, -0.082, -0.004), Vec3(0.013, 0.022, 0.060));
  return blend_max(blend_max(lobes, -stomach, 0.020), -notch, 0.020);
}

double kidney(const Vec3& p) {
  const Vec3 straight(p.x(), p.y() - 0.004 + 3.2 * p.x() * p.x(), p.z());
  const double bean = ellipsoid(straight, Vec3(0.055, 0.033, 0.0225));
  const double hilum = ellipsoid(p - Vec3(0, 0.044, 0), Vec3(0.013, 0.024, 0.009));
  return blend_max(bean, -hilum, 0.012);
}

double skin_pad(const Vec3& p) {
  constexpr double kRim = 0.007;
  const Vec3 q = p.cwiseAbs() - (Vec3(0.060, 0.060, 0.010) - Vec3::Constant(kRim));
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0) - kRim;
}

Vec3 gradient(const ImplicitShape& f, const Vec3& p) {
  constexpr double h = 1e-5;
  Vec3 g;
  for (int i = 0; i < 3; ++i) g[i] = (f(p + h * Vec3::Unit(i)) - f(p - h * Vec3::Unit(i))) / (2 * h);
  return g;
}

Vec3 projected(const ImplicitShape& f, Vec3 p) {
  for (int i = 0; i < 4; ++i) {
    const Vec3 g = gradient(f, p);
    p -= f(p) / std::max(g.squaredNorm(), 1e-6) * g;
  }
  return p;
}

Vec3 first_hit(const ImplicitShape& f, const Vec3& outside, const Vec3& inside) {
  constexpr int kSteps = 400;
  double low = 0, high = 1;
  for (int i = 1; i <= kSteps; ++i) {
    high = double(i) / kSteps;
    if (f(outside + high * (inside - outside)) < 0) break;
    low = high;
  }
  for (int i = 0; i < 50; ++i) {
    const double middle = (low + high) / 2;
    (f(outside + middle * (inside - outside)) < 0 ? high : low) = middle;
  }
  return outside + high * (inside - outside);
}

}  // namespace sectio
