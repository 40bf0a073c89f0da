// Shader programs of the canvas, compiled from the one source in shaders.h. A variant leaves out what a
// draw doesn't need: llvmpipe runs every branch of a shader for every pixel.
#pragma once

#include <array>
#include <compare>
#include <initializer_list>
#include <span>

#include "render_client/draw/canvas.h"

namespace sectio {

struct GlFunctions;

// OpenGL ES, which browsers have, knows neither geometry shaders nor interpolation on the screen: wireframes are lines.
#ifdef __EMSCRIPTEN__
constexpr bool kWireframesAreLines = true;
#else
constexpr bool kWireframesAreLines = false;
#endif

struct ShaderVariant {
  Shading shading = Shading::skin;
  bool regions = false;            // skin and walls
  bool shadows = false;            // bodies and drapes
  bool pattern_per_pixel = false;  // skin
  bool section = false;            // skin, walls and scalar fields
  bool layers = false;             // walls
  // NOLINTNEXTLINE(modernize-use-nullptr)
  auto operator<=>(const ShaderVariant&) const = default;
};

// Throw InputError when this OpenGL can't compile the program.
class Program {
 public:
  Program() = default;
  static Program of_variant(const GlFunctions& gl, const ShaderVariant& variant);
  static Program of_background(const GlFunctions& gl);
  static Program of_wireframe(const GlFunctions& gl);

  void use() const;

  // Uniforms of the program in use; a name that the shader doesn't have is ignored.
  void set(const char* name, int value) const;
  void set(const char* name, const Eigen::Vector2f& value) const;
  void set(const char* name, const Vec3f& value) const;
  void set(const char* name, const Vec4f& value) const;
  void set(const char* name, const Eigen::Matrix4f& value) const;
  void set(const char* name, std::span<const Vec3f> values) const;
  void set(const char* name, std::span<const Vec4f> values) const;
  void set(const char* name, std::span<const std::array<int, 2>> values) const;

 private:
  static Program link(const GlFunctions& gl, std::initializer_list<unsigned> stages);
  int location(const char* name) const;

  const GlFunctions* gl_ = nullptr;  // functions of the context
  unsigned id_ = 0;                  // number of the program in OpenGL
};

}  // namespace sectio
