// OpenGL's functions as one context has them: each library of OpenGL in a program keeps to its own, and the one of
// the desktop needn't be of OSMesa's maker. For sources that draw by OpenGL; the headers of others don't include it.
#pragma once

#ifdef __EMSCRIPTEN__
#include <GLES3/gl3.h>
#else
#define GL_GLEXT_PROTOTYPES
#include <GL/osmesa.h>
// osmesa.h brings gl.h
#include <GL/glext.h>
#endif

#include <string>

#include "common/core/error.h"

namespace sectio {

#define SECTIO_GL_FUNCTIONS(f)                                                                                        \
  f(ActiveTexture) f(AttachShader) f(BindBuffer) f(BindFramebuffer) f(BindRenderbuffer) f(BindTexture)                \
      f(BindVertexArray) f(BlendFunc) f(BlitFramebuffer) f(BufferData) f(BufferSubData) f(CheckFramebufferStatus)     \
          f(Clear) f(CompileShader) f(CreateProgram) f(CreateShader) f(DeleteBuffers) f(DeleteShader)                 \
              f(DeleteTextures) f(DeleteVertexArrays) f(DepthFunc) f(DepthMask) f(DepthRangef) f(Disable)             \
                  f(DrawArrays) f(DrawElements) f(Enable) f(EnableVertexAttribArray) f(Finish)                        \
                      f(FramebufferRenderbuffer) f(GenBuffers) f(GenFramebuffers) f(GenRenderbuffers) f(GenTextures)  \
                          f(GenVertexArrays) f(GenerateMipmap) f(GetProgramiv) f(GetShaderInfoLog) f(GetShaderiv)     \
                              f(GetString) f(GetUniformLocation) f(LinkProgram) f(PixelStorei) f(PolygonOffset)       \
                                  f(ReadPixels) f(RenderbufferStorageMultisample) f(Scissor) f(ShaderSource)          \
                                      f(TexImage2D) f(TexImage3D) f(TexParameteri) f(Uniform1i) f(Uniform2fv)         \
                                          f(Uniform2iv) f(Uniform3fv) f(Uniform4fv) f(UniformMatrix4fv) f(UseProgram) \
                                              f(VertexAttribPointer) f(Viewport)

// NOLINTBEGIN(bugprone-macro-parentheses): a declared name takes none
struct GlFunctions {
#ifdef __EMSCRIPTEN__
  // A browser has one library of OpenGL.
#define SECTIO_DECLARE(name) decltype(&::gl##name) name = &::gl##name;
#else
  // find("glClear") gives the function of the context, or null. Throws InputError when one is missing.
  explicit GlFunctions(const auto& find) {
#define SECTIO_FIND(name)                                           \
  name = reinterpret_cast<decltype(&::gl##name)>(find("gl" #name)); \
  if (!name) throw InputError("this OpenGL has no function gl" #name);
    SECTIO_GL_FUNCTIONS(SECTIO_FIND)
#undef SECTIO_FIND
  }
#define SECTIO_DECLARE(name) decltype(&::gl##name) name;
#endif
  SECTIO_GL_FUNCTIONS(SECTIO_DECLARE)
#undef SECTIO_DECLARE
};
// NOLINTEND(bugprone-macro-parentheses)

}  // namespace sectio
