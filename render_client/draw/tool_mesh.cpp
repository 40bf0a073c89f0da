#include "render_client/draw/tool_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "render_client/draw/body_mesh.h"

namespace sectio {

namespace {

constexpr double kHandleLength_m = 0.125;
constexpr double kShaftLength_m = 0.22;

// The axes of a tool: up along the shaft, forward in the blade's plane towards the edge, aside across the blade.
struct Axes {
  Vec3 up, forward, aside;
};

Axes axes_of(const std::array<Vec3, 4>& abcd) {
  const auto unit_or = [](const Vec3& v, const Vec3& otherwise) {
    return v.norm() > 1e-9 ? Vec3(v.normalized()) : otherwise;
  };
  Axes axes;
  axes.up = unit_or(abcd[1] - abcd[0], Vec3::UnitZ());
  const Vec3 out = abcd[2] - abcd[0];
  axes.forward = unit_or(out - out.dot(axes.up) * axes.up, axes.up.unitOrthogonal());
  axes.aside = axes.up.cross(axes.forward);
  return axes;
}

// A cross-section |x/a|^e + |y/b|^e = 1: an ellipse for e = 2, a rounded bar for more.
struct Section {
  Vec3 centre_m;
  Vec3 x_axis, y_axis;
  double x_m, y_m;
  double exponent = 2;
};

class Builder {
 public:
  // A flat polygon, counter-clockwise as seen from outside. Its vertices are its own, so that its edges are hard.
  void facet(std::initializer_list<Vec3> corners) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const Vec3& corner : corners) add(corner);
    for (std::uint32_t i = 2; i < corners.size(); ++i) triangle(first, first + i - 1, first + i);
  }

  // A skin over the sections, closed at both ends. x_axis, y_axis and the way along must be right-handed.
  void loft(std::span<const Section> sections) {
    constexpr std::uint32_t kAround = 24;
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const Section& section : sections) ring(section, kAround);
    for (std::uint32_t s = 0; s + 1 < sections.size(); ++s) {
      for (std::uint32_t i = 0; i < kAround; ++i) {
        const std::uint32_t a = first + s * kAround + i, b = first + s * kAround + (i + 1) % kAround;
        triangle(a, b, b + kAround);
        triangle(a, b + kAround, a + kAround);
      }
    }
    const std::uint32_t begin_cap = ring(sections.front(), kAround), end_cap = ring(sections.back(), kAround);
    for (std::uint32_t i = 2; i < kAround; ++i) {
      triangle(begin_cap, begin_cap + i, begin_cap + i - 1);
      triangle(end_cap, end_cap + i - 1, end_cap + i);
    }
  }

  void end_part(const Material& material) {
    const auto count = static_cast<std::uint32_t>(mesh.indices.size());
    mesh.parts.push_back({{part_begin_, count - part_begin_}, material});
    part_begin_ = count;
  }

  ToolMesh mesh;

 private:
  void add(const Vec3& p) {
    CanvasVertex vertex;
    vertex.position_m = vertex.rest_m = p.cast<float>();
    mesh.vertices.push_back(vertex);
  }
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh.indices.insert(mesh.indices.end(), {a, b, c});
  }

  std::uint32_t ring(const Section& s, std::uint32_t count) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (std::uint32_t i = 0; i < count; ++i) {
      const double angle = 2 * std::numbers::pi * i / count;
      const auto bulge = [&](double c) { return std::copysign(std::pow(std::abs(c), 2 / s.exponent), c); };
      add(s.centre_m + s.x_m * bulge(std::cos(angle)) * s.x_axis + s.y_m * bulge(std::sin(angle)) * s.y_axis);
    }
    return first;
  }

  std::uint32_t part_begin_ = 0;
};

//    B-----D      `aside` points at the reader. The strip between AC and A'C' is ground down from the blade's
//    |     |      thickness to nothing: the sharp edge.
//    |    C'
//    A'  / C
//    | ./ /
//    |/ /
//    A
void add_blade(Builder& builder, const std::array<Vec3, 4>& abcd, const Axes& axes) {
  constexpr double kHalfThickness_m = 0.0002;
  constexpr double kBevel_m = 0.0011;
  const auto& [a, b, c, d] = abcd;
  const auto towards = [](const Vec3& from, const Vec3& to, double distance_m) -> Vec3 {
    const double length = (to - from).norm();
    return length > 1e-9 ? Vec3(from + std::min(0.5, distance_m / length) * (to - from)) : from;
  };
  const Vec3 edge = (c - a).norm() > 1e-9 ? Vec3((c - a).normalized()) : axes.forward;
  // Distances along AB and CD that put A' and C' kBevel_m away from the line AC.
  const double sine = std::max(0.2, std::abs(edge.cross(axes.up).norm()));
  const Vec3 a1 = towards(a, b, kBevel_m / sine), c1 = towards(c, d, kBevel_m / sine);
  const Vec3 up = kHalfThickness_m * axes.aside;
  builder.facet({a, a1 + up, c1 + up, c});
  builder.facet({a, c, c1 - up, a1 - up});
  builder.facet({a1 + up, b + up, d + up, c1 + up});
  builder.facet({a1 - up, c1 - up, d - up, b - up});
  builder.facet({a, a1 - up, a1 + up});
  builder.facet({a1 - up, b - up, b + up, a1 + up});
  builder.facet({c, c1 + up, c1 - up});
  builder.facet({c1 + up, d + up, d - up, c1 - up});
  builder.facet({b + up, b - up, d - up, d + up});
}

void add_handle(Builder& builder, const std::array<Vec3, 4>& abcd, const Axes& axes) {
  const Vec3 start = 0.5 * (abcd[1] + abcd[3]);
  const double blade_m = std::clamp(0.5 * (abcd[3] - abcd[1]).norm(), 0.001, 0.006);
  const auto section = [&](double along_m, double half_width_m, double half_thickness_m) {
    return Section{start + along_m * axes.up, axes.forward, -axes.aside, half_width_m, half_thickness_m, 4};
  };
  // A mount that overlaps the blade, a neck, a grip with cross-grooves, a plain end.
  std::vector<Section> sections{section(-0.007, 0.55 * blade_m, 0.0003), section(-0.006, 0.62 * blade_m, 0.0007),
                                section(0.000, 0.80 * blade_m, 0.0010),  section(0.006, 0.0026, 0.0015),
                                section(0.016, 0.0027, 0.0017),          section(0.026, 0.0039, 0.0019)};
  constexpr int kGrooves = 14;
  for (int i = 0; i <= 4 * kGrooves; ++i) {
    const double groove = 0.00016 * std::cos(0.5 * std::numbers::pi * i);
    sections.push_back(section(0.030 + 0.0005 * i, 0.0043 + groove, 0.0020 + groove));
  }
  sections.push_back(section(kHandleLength_m - 0.012, 0.0046, 0.0019));
  sections.push_back(section(kHandleLength_m - 0.002, 0.0040, 0.0017));
  sections.push_back(section(kHandleLength_m, 0.0030, 0.0011));
  // forward, -aside, up are right-handed: aside = up x forward.
  builder.loft(sections);
}

// A round tube through points on a curve that stays in the plane of up and forward.
void add_tube(Builder& builder, std::span<const Vec3> points, const Axes& axes, double radius_m, double end_radius_m) {
  std::vector<Section> sections;
  for (std::size_t i = 0; i < points.size(); ++i) {
    Vec3 along = points[std::min(i + 1, points.size() - 1)] - points[i == 0 ? 0 : i - 1];
    along = along.norm() > 1e-12 ? Vec3(along.normalized()) : axes.up;
    Vec3 x = axes.aside - axes.aside.dot(along) * along;
    x = x.norm() > 1e-6 ? Vec3(x.normalized()) : Vec3(along.unitOrthogonal());
    const double s = static_cast<double>(i) / static_cast<double>(points.size() - 1);
    const double radius = radius_m + s * (end_radius_m - radius_m);
    sections.push_back({points[i], x, along.cross(x), radius, radius});
  }
  builder.loft(sections);
}

ToolMesh make_scalpel(const std::array<Vec3, 4>& abcd, const Axes& axes) {
  Builder builder;
  add_blade(builder, abcd, axes);
  builder.end_part({Shading::metal, Vec3f(0.80f, 0.82f, 0.84f)});
  add_handle(builder, abcd, axes);
  builder.end_part({Shading::metal, Vec3f(0.66f, 0.67f, 0.69f)});
  const Vec3 end = 0.5 * (abcd[1] + abcd[3]) + kHandleLength_m * axes.up;
  builder.mesh.shadow = {abcd[0].cast<float>(), end.cast<float>(), 0.0003f, 0.0045f};
  return std::move(builder.mesh);
}

ToolMesh make_cautery_hook(const std::array<Vec3, 4>& abcd, const Axes& axes) {
  constexpr double kWire_m = 0.0007;
  const auto& [a, b, c, d] = abcd;
  const double shaft_m = (b - a).norm();
  const double bend_m = std::min({0.003, 0.5 * shaft_m, 0.6 * (c - a).norm()});
  const Vec3 to_tip = (c - a).norm() > 1e-9 ? Vec3((c - a).normalized()) : axes.forward;
  Builder builder;
  const Vec3 sleeve = a + std::min(0.007, 0.6 * shaft_m) * axes.up;
  const std::array shaft{Vec3(a + (shaft_m + kShaftLength_m) * axes.up), Vec3(sleeve + 0.001 * axes.up), sleeve};
  add_tube(builder, shaft, axes, 0.0024, 0.0021);
  builder.end_part({Shading::polymer, Vec3f(0.20f, 0.21f, 0.23f)});
  // Down the shaft's axis, round the bend (a quadratic Bezier curve with its middle point at A), out to C.
  std::vector<Vec3> wire{sleeve + 0.002 * axes.up};
  const Vec3 in = a + bend_m * axes.up, out = a + bend_m * to_tip;
  for (int i = 0; i <= 8; ++i) {
    const double t = i / 8.0;
    wire.push_back((1 - t) * (1 - t) * in + 2 * t * (1 - t) * a + t * t * out);
  }
  const Vec3 hot = c + std::min(0.3 * (c - a).norm(), 0.002) * -to_tip;
  wire.push_back(hot);
  add_tube(builder, wire, axes, kWire_m, kWire_m);
  builder.end_part({Shading::metal, Vec3f(0.74f, 0.72f, 0.69f)});
  const std::array tip{hot, c};
  add_tube(builder, tip, axes, 1.02 * kWire_m, 0.8 * kWire_m);
  const std::array spark{c, Vec3(0.5 * (c + d)), d};
  if ((d - c).norm() > 1e-6) add_tube(builder, spark, axes, 0.5 * kWire_m, 0.05 * kWire_m);
  builder.end_part({Shading::glow, Vec3f(1.0f, 0.45f, 0.16f)});
  builder.mesh.shadow = {a.cast<float>(), shaft[0].cast<float>(), 0.0012f, 0.0024f};
  return std::move(builder.mesh);
}

ToolMesh make_rod(const std::array<Vec3, 4>& abcd, const Axes& axes) {
  Builder builder;
  const std::array rod{Vec3(abcd[1] + 0.1 * axes.up), abcd[0]};
  add_tube(builder, rod, axes, 0.002, 0.001);
  builder.end_part({Shading::metal, Vec3f(0.72f, 0.73f, 0.75f)});
  builder.mesh.shadow = {abcd[0].cast<float>(), rod[0].cast<float>(), 0.001f, 0.002f};
  return std::move(builder.mesh);
}

ToolMesh make_probe(const std::array<Vec3, 4>& abcd, const Axes& axes) {
  const Vec3 out = abcd[2] - abcd[0];
  const double radius_m = std::clamp(1.2 * (out - out.dot(axes.up) * axes.up).norm(), 0.0002, 0.02);
  Builder builder;
  std::vector<Section> sections;
  constexpr int kRings = 10;
  for (int i = 1; i <= kRings; ++i) {
    const double angle = std::numbers::pi * (0.5 * i / kRings - 0.5);
    const double ring_m = radius_m * std::max(0.02, std::cos(angle));
    sections.push_back(
        {abcd[0] + radius_m * (1 + std::sin(angle)) * axes.up, axes.forward, -axes.aside, ring_m, ring_m});
  }
  sections.push_back({abcd[1] + 0.1 * axes.up, axes.forward, -axes.aside, 1.3 * radius_m, 1.3 * radius_m});
  builder.loft(sections);
  builder.end_part({Shading::metal, Vec3f(0.72f, 0.73f, 0.75f)});
  builder.mesh.shadow = {abcd[0].cast<float>(), sections.back().centre_m.cast<float>(), 0.0015f, 0.002f};
  return std::move(builder.mesh);
}

// A blade of scissors, from the pivot to its tip. `out` points from the edge to the back; the other blade lies beside.
void add_scissor_blade(Builder& builder, const Vec3& pivot, const Vec3& along, const Vec3& out, double blade_m,
                       double height_m) {
  constexpr double kHalfThickness_m = 0.0005;
  const double offset_m = 0.05 * blade_m;  // the edge passes the pivot on the other side
  const Vec3 y = along.cross(out);
  std::vector<Section> sections;
  for (const auto& [s, h] : {std::pair(-0.12, 0.9), {0.0, 1.0}, {0.5, 0.85}, {0.9, 0.5}, {0.985, 0.3}, {1.0, 0.1}}) {
    const double half_m = 0.5 * h * height_m;
    const Vec3 centre = pivot + s * blade_m * along + (half_m - offset_m) * out + kHalfThickness_m * y;
    sections.push_back({centre, out, y, half_m, kHalfThickness_m, 3});
  }
  builder.loft(sections);
}

// A blunt jaw of forceps, from the pivot to its tip. Its flat side, with grooves across, meets that of the other jaw.
void add_jaw(Builder& builder, const Vec3& pivot, const Vec3& along, const Vec3& out, double jaw_m) {
  const Vec3 y = along.cross(out);
  std::vector<Section> sections;
  const auto section = [&](double s, double half_m, double half_thickness_m) {
    sections.push_back({pivot + s * jaw_m * along + half_m * out, out, y, half_m, half_thickness_m, 3});
  };
  section(-0.08, 0.0022, 0.0014);
  section(0.0, 0.0026, 0.0016);
  section(0.35, 0.0018, 0.0014);
  for (int i = 0; i <= 24; ++i) section(0.6 + 0.37 * i / 24, 0.0014 - 0.00002 * i + (i % 2 == 0 ? 0.00012 : 0), 0.0012);
  section(0.99, 0.0007, 0.0009);
  section(1.0, 0.0003, 0.0005);
  builder.loft(sections);
}

// A shank behind the pivot, on the other side of the blade's back, that ends in a ring.
void add_shank(Builder& builder, const Vec3& pivot, const Vec3& along, const Vec3& out, double shank_m) {
  constexpr double kRing_m = 0.011, kThick_m = 0.0018;
  const Vec3 y = along.cross(out), centre = pivot - shank_m * along - kRing_m * out;
  std::vector<Vec3> shank{pivot + 0.0005 * y, pivot - 0.5 * (shank_m - kRing_m) * along};
  for (int i = 0; i <= 32; ++i) {
    const double angle = 2 * std::numbers::pi * i / 32;
    shank.push_back(centre + kRing_m * (std::cos(angle) * along - std::sin(angle) * out));
  }
  add_tube(builder, shank, {-along, out, y}, kThick_m, kThick_m);
}

ToolMesh make_scissors(const ToolFrame& tool, const std::array<Vec3, 4>& abcd) {
  const auto& [a, b, c, d] = abcd;
  const double blade_m = (a - c).norm(), shank_m = std::max(0.03, (b - c).norm());
  const Vec3 forward = blade_m > 1e-9 ? Vec3((a - c) / blade_m) : Vec3::UnitX();
  const Vec3 back = (d - a) - (d - a).dot(forward) * forward;
  const double height_m = std::max(0.001, back.norm());
  const Vec3 down = back.norm() > 1e-9 ? Vec3(back.normalized()) : Vec3(forward.unitOrthogonal());
  const Vec3 aside = forward.cross(down);
  const double half_rad = 0.5 * tool.pose_world.opening_rad;
  Builder builder;
  const double gauge_m = tool.kind == "medical_scissors" ? tool.gauge_m : 0;
  for (const double half : {1.0, -1.0}) {  // the lower blade, the upper one
    const Vec3 along = std::cos(half_rad) * forward + half * std::sin(half_rad) * down;
    const Vec3 out = half * (std::cos(half_rad) * down - half * std::sin(half_rad) * forward);
    if (tool.kind == "forceps")
      add_jaw(builder, c, along, out, blade_m);
    else
      for (const double side : gauge_m > 0 ? std::vector{-0.5, 0.5} : std::vector{0.0})
        add_scissor_blade(builder, c + side * gauge_m * aside, along, out, blade_m, height_m);
    add_shank(builder, c, along, out, shank_m);
  }
  const std::array rivet{Vec3(c - (0.5 * gauge_m + 0.0016) * aside), Vec3(c + (0.5 * gauge_m + 0.0016) * aside)};
  add_tube(builder, rivet, {aside, forward, down}, 0.002, 0.002);
  builder.end_part({Shading::metal, Vec3f(0.76f, 0.77f, 0.79f)});
  builder.mesh.shadow = {a.cast<float>(), Vec3(c - shank_m * forward).cast<float>(), 0.001f, 0.006f};
  return std::move(builder.mesh);
}

}  // namespace

bool has_jaws(std::string_view kind) {
  return kind == "scissors" || kind == "medical_scissors" || kind == "forceps";
}

ToolMesh make_tool_mesh(const ToolFrame& tool) {
  std::array<Vec3, 4> abcd = tool.abcd_tool_m;
  for (Vec3& point : abcd) {
    if (!point.allFinite()) point.setZero();
  }
  const Axes axes = axes_of(abcd);
  const bool is_blade = tool.kind == "scalpel" || tool.kind == "knife";
  ToolMesh mesh = is_blade                      ? make_scalpel(abcd, axes)
                  : tool.kind == "cautery_hook" ? make_cautery_hook(abcd, axes)
                  : tool.kind == "probe"        ? make_probe(abcd, axes)
                  : has_jaws(tool.kind)         ? make_scissors(tool, abcd)
                                                : make_rod(abcd, axes);
  compute_normals(mesh.vertices, mesh.indices);
  return mesh;
}

}  // namespace sectio
