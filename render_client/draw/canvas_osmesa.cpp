// The software canvas: OpenGL 3.3 core in Mesa's llvmpipe, drawn into the picture's own memory. libOSMesa exports the
// gl* functions, so no loader is needed.
#define GL_GLEXT_PROTOTYPES
#include <GL/osmesa.h>
// osmesa.h brings gl.h
#include <GL/glext.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <vector>

#include "common/core/error.h"
#include "common/core/log.h"
#include "render_client/draw/canvas.h"
#include "render_client/draw/region_shader.h"
#include "render_client/draw/shaders.h"
#include "render_client/draw/tissue_noise.h"

namespace sectio {

namespace {

GLuint compile(GLenum stage, const char* head, const char* body) {
  const GLuint shader = glCreateShader(stage);
  const std::array<const char*, 3> sources{shaders::kVersion, head, body};
  glShaderSource(shader, static_cast<GLsizei>(sources.size()), sources.data(), nullptr);
  glCompileShader(shader);
  GLint ok = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (!ok) {
    std::array<char, 2000> text{};
    glGetShaderInfoLog(shader, static_cast<GLsizei>(text.size()), nullptr, text.data());
    throw InputError("this OpenGL can't compile a shader: " + std::string(text.data()));
  }
  return shader;
}

struct Program {
  GLuint id = 0;
  GLint view_from_mesh = -1, projection = -1, base_colour = -1, occluder_from = -1, occluder_to = -1,
        occluder_count = -1, half_size_px = -1;
  // Of skin and walls.
  GLint region_count = -1, part_of = -1, part_a = -1, part_b = -1, part_q = -1, region_colour = -1, region_grain = -1,
        region_rim = -1, grid_from = -1, grid_per = -1;
};

Program link(std::initializer_list<GLuint> stages) {
  Program program;
  program.id = glCreateProgram();
  for (const GLuint stage : stages) glAttachShader(program.id, stage);
  glLinkProgram(program.id);
  for (const GLuint stage : stages) glDeleteShader(stage);
  GLint ok = 0;
  glGetProgramiv(program.id, GL_LINK_STATUS, &ok);
  if (!ok) throw InputError("this OpenGL can't link a shader program");
  const auto uniform = [&](const char* name) { return glGetUniformLocation(program.id, name); };
  program.view_from_mesh = uniform("view_from_mesh");
  program.projection = uniform("projection");
  program.base_colour = uniform("base_colour");
  program.occluder_from = uniform("occluder_from");
  program.occluder_to = uniform("occluder_to");
  program.occluder_count = uniform("occluder_count");
  program.half_size_px = uniform("half_size_px");
  program.region_count = uniform("region_count");
  program.part_of = uniform("part_of");
  program.grid_from = uniform("grid_from");
  program.grid_per = uniform("grid_per");
  program.part_a = uniform("part_a");
  program.part_b = uniform("part_b");
  program.part_q = uniform("part_q");
  program.region_colour = uniform("region_colour");
  program.region_grain = uniform("region_grain");
  program.region_rim = uniform("region_rim");
  glUseProgram(program.id);
  glUniform1i(uniform("noise"), 0);
  glUniform1i(uniform("relief"), 1);
  glUniform1i(uniform("region_cells"), 2);
  return program;
}

const char* fragment_source(Shading shading) {
  switch (shading) {
    case Shading::skin:
      return shaders::kSkin;
    case Shading::wall:
      return shaders::kWall;
    case Shading::metal:
      return shaders::kMetal;
    case Shading::polymer:
      return shaders::kPolymer;
    case Shading::drape:
      return shaders::kDrape;
    case Shading::glow:
      return shaders::kGlow;
  }
  return shaders::kSkin;
}

struct GpuMesh {
  GLuint array = 0, vertices = 0, indices = 0;
  std::size_t vertex_capacity = 0;  // 0 and no array: a free place
  std::uint32_t index_count = 0;
  GLuint region_cells = 0;  // a texture; 0: no regions
  RegionTable regions;
};

class OsmesaCanvas final : public Canvas {
 public:
  OsmesaCanvas(int width_px, int height_px, int samples);
  ~OsmesaCanvas() override;
  OsmesaCanvas(const OsmesaCanvas&) = delete;
  OsmesaCanvas& operator=(const OsmesaCanvas&) = delete;

  int width_px() const override { return image_.width_px; }
  int height_px() const override { return image_.height_px; }
  MeshId add_mesh() override;
  void remove_mesh(MeshId mesh) override;
  void set_vertices(MeshId mesh, std::span<const CanvasVertex> vertices) override;
  void set_indices(MeshId mesh, std::span<const std::uint32_t> indices) override;
  void set_regions(MeshId mesh, std::span<const Region> regions, const Eigen::AlignedBox3d& rest_box) override;
  void begin(const CanvasView& view) override;
  void draw(MeshId mesh, IndexRange range, const Material& material, const Eigen::Matrix4f& world_from_mesh) override;
  void draw_wireframe(MeshId mesh, IndexRange range, const Eigen::Matrix4f& world_from_mesh) override;
  Image& finish() override;

 private:
  void make_current();
  void make_programs();
  void make_noise();
  void make_sample_buffer(int samples);
  static GLuint make_cells(int size, std::span<const std::uint32_t> cells);
  void use_regions(const Program& program, const GpuMesh& mesh);
  void warm_up();
  void draw_elements(MeshId mesh, IndexRange range);

  OSMesaContext context_ = nullptr;
  Image image_;
  std::array<Program, kAllShadings.size()> programs_;
  Program background_, wire_;
  GLuint empty_array_ = 0;
  GLuint no_cells_ = 0;
  GLuint sample_framebuffer_ = 0;
  std::array<GLuint, 2> sample_buffers_{};
  CanvasView view_;
  std::vector<GpuMesh> meshes_;
};

OsmesaCanvas::OsmesaCanvas(int width_px, int height_px, int samples) : image_(width_px, height_px) {
  setenv("LP_NUM_THREADS", "1", 0);
  const std::array attributes{OSMESA_FORMAT,
                              OSMESA_RGBA,
                              OSMESA_DEPTH_BITS,
                              24,
                              OSMESA_PROFILE,
                              OSMESA_CORE_PROFILE,
                              OSMESA_CONTEXT_MAJOR_VERSION,
                              3,
                              OSMESA_CONTEXT_MINOR_VERSION,
                              3,
                              0};
  context_ = OSMesaCreateContextAttribs(attributes.data(), nullptr);
  if (!context_) throw InputError("OSMesa can't make an OpenGL 3.3 core context");
  try {
    make_current();
    const auto* renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    if (!renderer || std::string(renderer).find("llvmpipe") == std::string::npos) {
      log_warning("OpenGL is drawn by " + std::string(renderer ? renderer : "nothing known") +
                  ", not by llvmpipe: expect few frames per second");
    }
    make_programs();
    make_noise();
    no_cells_ = make_cells(1, std::array<std::uint32_t, 1>{0});
    glGenVertexArrays(1, &empty_array_);
    if (samples > 1) make_sample_buffer(samples);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LEQUAL);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    warm_up();
  } catch (...) {
    OSMesaDestroyContext(context_);
    throw;
  }
}

OsmesaCanvas::~OsmesaCanvas() {
  OSMesaDestroyContext(context_);
}

void OsmesaCanvas::make_current() {
  if (OSMesaGetCurrentContext() == context_) return;
  if (!OSMesaMakeCurrent(context_, image_.rgba.data(), GL_UNSIGNED_BYTE, image_.width_px, image_.height_px)) {
    throw InputError("OSMesa can't draw a picture of " + std::to_string(image_.width_px) + " x " +
                     std::to_string(image_.height_px) + " pixels");
  }
  OSMesaPixelStore(OSMESA_Y_UP, 0);
}

void OsmesaCanvas::make_programs() {
  for (const Shading shading : kAllShadings) {
    programs_[static_cast<std::size_t>(shading)] = link(
        {compile(GL_VERTEX_SHADER, "", shaders::kVertex),
         compile(GL_FRAGMENT_SHADER, (std::string(shaders::kLighting) + shaders::kBackdrop + shaders::kRegions).c_str(),
                 fragment_source(shading))});
  }
  background_ = link({compile(GL_VERTEX_SHADER, "", shaders::kBackgroundVertex),
                      compile(GL_FRAGMENT_SHADER, shaders::kBackdrop, shaders::kBackground)});
  wire_ =
      link({compile(GL_VERTEX_SHADER, "", shaders::kVertex), compile(GL_GEOMETRY_SHADER, "", shaders::kWireGeometry),
            compile(GL_FRAGMENT_SHADER, "", shaders::kWire)});
}

void OsmesaCanvas::make_noise() {
  const TissueNoise volumes = make_tissue_noise();
  constexpr GLsizei kSize = kTissueNoiseSize;
  std::array<GLuint, 2> textures{};
  glGenTextures(2, textures.data());
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& texels = i == 0 ? volumes.noise : volumes.relief;
    glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(i));
    glBindTexture(GL_TEXTURE_3D, textures[i]);
    glTexImage3D(GL_TEXTURE_3D, 0, GL_RGBA8, kSize, kSize, kSize, 0, GL_RGBA, GL_UNSIGNED_BYTE, texels.data());
    glGenerateMipmap(GL_TEXTURE_3D);
    for (const GLenum axis : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R}) {
      glTexParameteri(GL_TEXTURE_3D, axis, GL_REPEAT);
    }
    glTexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_NEAREST);
  }
}

void OsmesaCanvas::make_sample_buffer(int samples) {
  glGenFramebuffers(1, &sample_framebuffer_);
  glBindFramebuffer(GL_FRAMEBUFFER, sample_framebuffer_);
  glGenRenderbuffers(2, sample_buffers_.data());
  const std::array<std::array<GLenum, 2>, 2> kinds{
      {{GL_RGBA8, GL_COLOR_ATTACHMENT0}, {GL_DEPTH_COMPONENT24, GL_DEPTH_ATTACHMENT}}};
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    glBindRenderbuffer(GL_RENDERBUFFER, sample_buffers_[i]);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, kinds[i][0], image_.width_px, image_.height_px);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, kinds[i][1], GL_RENDERBUFFER, sample_buffers_[i]);
  }
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw InputError("this OpenGL has no buffers of " + std::to_string(samples) + " samples a pixel");
  }
}

// llvmpipe compiles a shader when it is first used with a given state, 50 to 400 ms each.
void OsmesaCanvas::warm_up() {
  const MeshId mesh = add_mesh();
  std::array<CanvasVertex, 3> corners;
  for (std::size_t i = 0; i < 3; ++i) {
    corners[i].position_m = Vec3f(i == 1 ? 0.5f : 0.0f, i == 2 ? 0.5f : 0.0f, 0.0f);
    corners[i].normal = Vec3f::UnitZ();
    corners[i].rest_m = corners[i].position_m;
  }
  const std::array<std::uint32_t, 3> indices{0, 1, 2};
  set_vertices(mesh, corners);
  set_indices(mesh, indices);
  begin({});
  for (const Shading shading : kAllShadings) draw(mesh, {0, 3}, {shading, Vec3f::Ones()}, Eigen::Matrix4f::Identity());
  draw_wireframe(mesh, {0, 3}, Eigen::Matrix4f::Identity());
  finish();
  remove_mesh(mesh);
}

MeshId OsmesaCanvas::add_mesh() {
  make_current();
  std::size_t place = 0;
  while (place < meshes_.size() && meshes_[place].array != 0) ++place;
  if (place == meshes_.size()) meshes_.emplace_back();
  GpuMesh& mesh = meshes_[place];
  glGenVertexArrays(1, &mesh.array);
  glGenBuffers(1, &mesh.vertices);
  glGenBuffers(1, &mesh.indices);
  glBindVertexArray(mesh.array);
  glBindBuffer(GL_ARRAY_BUFFER, mesh.vertices);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, mesh.indices);
  const auto attribute = [](GLuint location, GLint size, std::size_t offset) {
    glEnableVertexAttribArray(location);
    glVertexAttribPointer(location, size, GL_FLOAT, GL_FALSE, sizeof(CanvasVertex),
                          reinterpret_cast<const void*>(offset));  // NOLINT(performance-no-int-to-ptr): GL's way
  };
  attribute(0, 3, offsetof(CanvasVertex, position_m));
  attribute(1, 3, offsetof(CanvasVertex, normal));
  attribute(2, 4, offsetof(CanvasVertex, rest_m));
  return static_cast<MeshId>(place);
}

void OsmesaCanvas::remove_mesh(MeshId mesh) {
  make_current();
  GpuMesh& m = meshes_[mesh];
  glDeleteVertexArrays(1, &m.array);
  glDeleteBuffers(1, &m.vertices);
  glDeleteBuffers(1, &m.indices);
  if (m.region_cells != 0) glDeleteTextures(1, &m.region_cells);
  m = {};
}

void OsmesaCanvas::set_vertices(MeshId mesh, std::span<const CanvasVertex> vertices) {
  make_current();
  GpuMesh& m = meshes_[mesh];
  glBindBuffer(GL_ARRAY_BUFFER, m.vertices);
  if (vertices.size() > m.vertex_capacity) {
    m.vertex_capacity = vertices.size() + vertices.size() / 4;
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(m.vertex_capacity * sizeof(CanvasVertex)), nullptr,
                 GL_DYNAMIC_DRAW);
  }
  glBufferSubData(GL_ARRAY_BUFFER, 0, static_cast<GLsizeiptr>(vertices.size_bytes()), vertices.data());
}

void OsmesaCanvas::set_indices(MeshId mesh, std::span<const std::uint32_t> indices) {
  make_current();
  GpuMesh& m = meshes_[mesh];
  glBindVertexArray(m.array);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size_bytes()), indices.data(), GL_STATIC_DRAW);
  m.index_count = static_cast<std::uint32_t>(indices.size());
}

void OsmesaCanvas::begin(const CanvasView& view) {
  make_current();
  view_ = view;
  glBindFramebuffer(GL_FRAMEBUFFER, sample_framebuffer_);
  glViewport(0, 0, image_.width_px, image_.height_px);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  Eigen::Matrix<float, 4, 2> from, to;
  for (int i = 0; i < 2; ++i) {
    const Occluder& occluder = view.occluders[static_cast<std::size_t>(i)];
    from.col(i) = view.view_from_world * occluder.from_world_m.homogeneous();
    to.col(i) = view.view_from_world * occluder.to_world_m.homogeneous();
    from(3, i) = occluder.from_radius_m;
    to(3, i) = occluder.to_radius_m;
  }
  for (const Shading shading : {Shading::skin, Shading::wall, Shading::drape}) {
    const Program& program = programs_[static_cast<std::size_t>(shading)];
    glUseProgram(program.id);
    glUniform4fv(program.occluder_from, 2, from.data());
    glUniform4fv(program.occluder_to, 2, to.data());
    glUniform1i(program.occluder_count, view.occluder_count);
    glUniform2f(program.half_size_px, 0.5f * static_cast<float>(image_.width_px),
                0.5f * static_cast<float>(image_.height_px));
  }
}

void OsmesaCanvas::draw_elements(MeshId mesh, IndexRange range) {
  SECTIO_ASSERT(range.first + range.count <= meshes_[mesh].index_count, "the range is within the index buffer");
  glBindVertexArray(meshes_[mesh].array);
  glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(range.count), GL_UNSIGNED_INT,
                 // NOLINTNEXTLINE(performance-no-int-to-ptr): GL's way
                 reinterpret_cast<const void*>(sizeof(std::uint32_t) * std::size_t{range.first}));
}

void OsmesaCanvas::set_regions(MeshId mesh, std::span<const Region> regions, const Eigen::AlignedBox3d& rest_box) {
  make_current();
  GpuMesh& m = meshes_[mesh];
  if (m.region_cells != 0) glDeleteTextures(1, &m.region_cells);
  m.region_cells = 0;
  m.regions = {};
  if (regions.empty()) return;
  m.regions = region_table(regions, rest_box);
  m.region_cells = make_cells(kRegionGridSize, m.regions.cells);
}

// One number for each cell of a cube, read as it is.
GLuint OsmesaCanvas::make_cells(int size, std::span<const std::uint32_t> cells) {
  GLuint texture = 0;
  glGenTextures(1, &texture);
  glActiveTexture(GL_TEXTURE2);
  glBindTexture(GL_TEXTURE_3D, texture);
  glTexImage3D(GL_TEXTURE_3D, 0, GL_R32UI, size, size, size, 0, GL_RED_INTEGER, GL_UNSIGNED_INT, cells.data());
  glTexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  return texture;
}

// Into the program in use.
void OsmesaCanvas::use_regions(const Program& program, const GpuMesh& mesh) {
  const RegionTable& t = mesh.regions;
  glUniform1i(program.region_count, t.count);
  glActiveTexture(GL_TEXTURE2);
  glBindTexture(GL_TEXTURE_3D, t.count == 0 ? no_cells_ : mesh.region_cells);
  if (t.count == 0) return;
  const auto vectors = [](GLint location, const auto& values) {
    glUniform4fv(location, static_cast<GLsizei>(values.size()), values.front().data());
  };
  glUniform2iv(program.part_of, static_cast<GLsizei>(t.part_of.size()), t.part_of.front().data());
  vectors(program.part_a, t.part_a);
  vectors(program.part_b, t.part_b);
  vectors(program.part_q, t.part_q);
  vectors(program.region_colour, t.colour);
  vectors(program.region_grain, t.grain);
  vectors(program.region_rim, t.rim);
  glUniform3fv(program.grid_from, 1, t.grid_from_m.data());
  glUniform3fv(program.grid_per, 1, t.grid_per_m.data());
}

void OsmesaCanvas::draw(MeshId mesh, IndexRange range, const Material& material,
                        const Eigen::Matrix4f& world_from_mesh) {
  if (range.count == 0) return;
  const Program& program = programs_[static_cast<std::size_t>(material.shading)];
  const Eigen::Matrix4f view_from_mesh = view_.view_from_world * world_from_mesh;
  glUseProgram(program.id);
  glUniformMatrix4fv(program.view_from_mesh, 1, GL_FALSE, view_from_mesh.data());
  glUniformMatrix4fv(program.projection, 1, GL_FALSE, view_.projection.data());
  glUniform3fv(program.base_colour, 1, material.colour.data());
  use_regions(program, meshes_[mesh]);
  if (material.shading == Shading::skin || material.shading == Shading::drape) {
    glEnable(GL_CULL_FACE);
  } else {
    glDisable(GL_CULL_FACE);
  }
  draw_elements(mesh, range);
}

void OsmesaCanvas::draw_wireframe(MeshId mesh, IndexRange range, const Eigen::Matrix4f& world_from_mesh) {
  if (range.count == 0) return;
  const Eigen::Matrix4f view_from_mesh = view_.view_from_world * world_from_mesh;
  glUseProgram(wire_.id);
  glUniformMatrix4fv(wire_.view_from_mesh, 1, GL_FALSE, view_from_mesh.data());
  glUniformMatrix4fv(wire_.projection, 1, GL_FALSE, view_.projection.data());
  glUniform2f(wire_.half_size_px, 0.5f * static_cast<float>(image_.width_px),
              0.5f * static_cast<float>(image_.height_px));
  glEnable(GL_CULL_FACE);
  glEnable(GL_BLEND);
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(-1.0f, -1.0f);
  glDepthMask(GL_FALSE);
  draw_elements(mesh, range);
  glDepthMask(GL_TRUE);
  glDisable(GL_POLYGON_OFFSET_FILL);
  glDisable(GL_BLEND);
}

Image& OsmesaCanvas::finish() {
  glDisable(GL_CULL_FACE);
  glUseProgram(background_.id);
  glBindVertexArray(empty_array_);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  if (sample_framebuffer_ != 0) {
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
    glBlitFramebuffer(0, 0, image_.width_px, image_.height_px, 0, 0, image_.width_px, image_.height_px,
                      GL_COLOR_BUFFER_BIT, GL_NEAREST);
  }
  glFinish();
  return image_;
}

}  // namespace

std::unique_ptr<Canvas> make_osmesa_canvas(int width_px, int height_px, int samples_per_pixel) {
  constexpr int kMaxSize_px = 16384;
  if (width_px < 1 || height_px < 1 || width_px > kMaxSize_px || height_px > kMaxSize_px) {
    throw InputError("picture size " + std::to_string(width_px) + " x " + std::to_string(height_px) +
                     ": expected 1 to " + std::to_string(kMaxSize_px) + " pixels");
  }
  if (samples_per_pixel != 1 && samples_per_pixel != 4) {
    throw InputError("samples per pixel: expected 1 or 4, got " + std::to_string(samples_per_pixel));
  }
  return std::make_unique<OsmesaCanvas>(width_px, height_px, samples_per_pixel);
}

}  // namespace sectio
