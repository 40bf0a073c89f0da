#include "render_client/draw/gl_program.h"

#include <string>
#include <vector>

#include "common/core/error.h"
#include "render_client/draw/colour_map.h"
#include "render_client/draw/gl_functions.h"
#include "render_client/draw/region_shader.h"
#include "render_client/draw/shaders.h"

namespace sectio {

namespace {

// The source is the parts one behind the other.
GLuint compile(const GlFunctions& gl, GLenum stage, std::vector<const char*> parts) {
  const GLuint shader = gl.CreateShader(stage);
  parts.insert(parts.begin(), shaders::kVersion);
  gl.ShaderSource(shader, static_cast<GLsizei>(parts.size()), parts.data(), nullptr);
  gl.CompileShader(shader);
  GLint ok = 0;
  gl.GetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (!ok) {
    std::array<char, 2000> text{};
    gl.GetShaderInfoLog(shader, static_cast<GLsizei>(text.size()), nullptr, text.data());
    throw InputError("this OpenGL can't compile a shader: " + std::string(text.data()));
  }
  return shader;
}

const char* fragment_source(Shading shading) {
  switch (shading) {
    case Shading::skin:
      return shaders::kSkin;
    case Shading::wall:
      return shaders::kWall;
    case Shading::blood:
      return shaders::kBlood;
    case Shading::scalar_field:
      return shaders::kScalarField;
    case Shading::metal:
      return shaders::kMetal;
    case Shading::polymer:
      return shaders::kPolymer;
    case Shading::plastic:
      return shaders::kPlastic;
    case Shading::cloth:
      return shaders::kCloth;
    case Shading::drape:  // has a vertex shader of its own, too
      return shaders::kDrape;
    case Shading::glow:
      return shaders::kGlow;
  }
  return shaders::kSkin;
}

}  // namespace

Program Program::link(const GlFunctions& gl, std::initializer_list<unsigned> stages) {
  Program program;
  program.gl_ = &gl;
  program.id_ = gl.CreateProgram();
  for (const GLuint stage : stages) gl.AttachShader(program.id_, stage);
  gl.LinkProgram(program.id_);
  for (const GLuint stage : stages) gl.DeleteShader(stage);
  GLint ok = 0;
  gl.GetProgramiv(program.id_, GL_LINK_STATUS, &ok);
  if (!ok) throw InputError("this OpenGL can't link a shader program");
  program.use();
  program.set("noise", 0);
  program.set("relief", 1);
  program.set("region_cells", 2);
  program.set("weave", 3);
  program.set("colour_stops", std::span<const Vec3f>(kColourMap));
  return program;
}

Program Program::of_variant(const GlFunctions& gl, const ShaderVariant& variant) {
  if (variant.shading == Shading::drape)
    return link(
        gl,
        {compile(gl, GL_VERTEX_SHADER,
                 {shaders::kAttributes, shaders::kLamps, shaders::kBackdrop, shaders::kDrapeVertex}),
         compile(gl, GL_FRAGMENT_SHADER,
                 {variant.shadows ? "#define SHADOWS\n" : "", shaders::kLamps, shaders::kKeyLight, shaders::kDrape})});
  return link(
      gl, {compile(gl, GL_VERTEX_SHADER, {shaders::kAttributes, shaders::kVertex}),
           compile(gl, GL_FRAGMENT_SHADER,
                   {variant.regions ? "#define REGIONS\n" : "", variant.shadows ? "#define SHADOWS\n" : "",
                    variant.pattern_per_pixel ? "#define PATTERN_PER_PIXEL\n" : "",
                    variant.section ? "#define SECTION\n" : "", variant.layers ? "#define LAYERS\n" : "",
                    shaders::kLamps, shaders::kKeyLight, shaders::kLighting, variant.regions ? shaders::kRegions : "",
                    variant.section ? shaders::kSection : "", fragment_source(variant.shading)})});
}

Program Program::of_background(const GlFunctions& gl) {
  return link(gl, {compile(gl, GL_VERTEX_SHADER, {shaders::kBackgroundVertex}),
                   compile(gl, GL_FRAGMENT_SHADER, {shaders::kBackdrop, shaders::kBackground})});
}

Program Program::of_wireframe(const GlFunctions& gl) {
#ifdef __EMSCRIPTEN__
  return link(gl, {compile(gl, GL_VERTEX_SHADER, {shaders::kAttributes, shaders::kVertex}),
                   compile(gl, GL_FRAGMENT_SHADER, {shaders::kWireLine})});
#else
  return link(gl, {compile(gl, GL_VERTEX_SHADER, {shaders::kAttributes, shaders::kVertex}),
                   compile(gl, GL_GEOMETRY_SHADER, {shaders::kWireGeometry}),
                   compile(gl, GL_FRAGMENT_SHADER, {shaders::kWire})});
#endif
}

void Program::use() const {
  gl_->UseProgram(id_);
}

int Program::location(const char* name) const {
  return gl_->GetUniformLocation(id_, name);
}

void Program::set(const char* name, int value) const {
  gl_->Uniform1i(location(name), value);
}
void Program::set(const char* name, const Eigen::Vector2f& value) const {
  gl_->Uniform2fv(location(name), 1, value.data());
}
void Program::set(const char* name, const Vec3f& value) const {
  gl_->Uniform3fv(location(name), 1, value.data());
}
void Program::set(const char* name, const Vec4f& value) const {
  gl_->Uniform4fv(location(name), 1, value.data());
}
void Program::set(const char* name, const Eigen::Matrix4f& value) const {
  gl_->UniformMatrix4fv(location(name), 1, GL_FALSE, value.data());
}
void Program::set(const char* name, std::span<const Vec3f> values) const {
  gl_->Uniform3fv(location(name), static_cast<GLsizei>(values.size()), values.front().data());
}
void Program::set(const char* name, std::span<const Vec4f> values) const {
  gl_->Uniform4fv(location(name), static_cast<GLsizei>(values.size()), values.front().data());
}
void Program::set(const char* name, std::span<const std::array<int, 2>> values) const {
  gl_->Uniform2iv(location(name), static_cast<GLsizei>(values.size()), values.front().data());
}

}  // namespace sectio
