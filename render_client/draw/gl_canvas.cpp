#include "render_client/draw/gl_canvas.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "common/core/error.h"
#include "render_client/draw/gl_functions.h"
#include "render_client/draw/gl_program.h"
#include "render_client/draw/region_shader.h"
#include "render_client/draw/tissue_noise.h"

namespace sectio {

namespace {

constexpr float kNeverDeep_m = 1e3f;     // to which the last layer reaches
constexpr float kBehindAll = 0.999999f;  // a depth just in front of the background

bool is_tissue(Shading shading) {
  return shading == Shading::skin || shading == Shading::wall || shading == Shading::blood ||
         shading == Shading::scalar_field;
}

bool takes_shadows(Shading shading) {
  return shading == Shading::skin || shading == Shading::wall || shading == Shading::blood ||
         shading == Shading::drape || shading == Shading::plastic || shading == Shading::cloth;
}

struct GpuMesh {
  GLuint array = 0, vertices = 0, indices = 0;
  std::size_t vertex_capacity = 0;
  std::uint32_t index_count = 0;
  // The triangles, and, in contexts that draw wireframes as lines, their edges once somebody has asked for them.
  std::vector<std::uint32_t> triangles;
  GLuint lines = 0;
  GLuint region_cells = 0;  // a texture; 0: no regions
  RegionTable regions;

  bool is_free() const { return array == 0; }
};

class GlCanvas final : public Canvas {
 public:
  GlCanvas(std::unique_ptr<GlContext> context, int samples);

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
  void make_current() { context_->make_current(); }
  void make_noise();
  void make_weave();
  void make_sample_buffer();
  GLuint make_cells(std::span<const std::uint32_t> cells);
  void warm_up();
  const Program& program(const ShaderVariant& variant);
  static void set_region_uniforms(const Program& program, const RegionTable& table);
  void set_occluder_uniforms(const Program& program) const;
  static void set_layer_uniforms(const Program& program, std::span<const TissueLayer> layers);
  void set_section_uniforms(const Program& program, const Material& material) const;
  Eigen::Vector2f half_size_px() const;
  void draw_elements(MeshId mesh, IndexRange range);
  void draw_lines(GpuMesh& mesh, IndexRange range);

  std::unique_ptr<GlContext> context_;
  const GlFunctions& gl_;
  Image& image_;
  std::map<ShaderVariant, Program> programs_;
  Program background_, wireframe_;
  GLuint empty_array_ = 0;
  GLuint sample_framebuffer_ = 0;
  std::array<GLuint, 2> sample_buffers_{};
  int samples_, samples_width_px_ = 0, samples_height_px_ = 0;
  CanvasView view_;
  GlTarget target_;
  std::vector<GpuMesh> meshes_;
  MeshId unseen_triangle_ = 0;
};

GlCanvas::GlCanvas(std::unique_ptr<GlContext> context, int samples)
    : context_(std::move(context)), gl_(context_->functions()), image_(context_->picture()), samples_(samples) {
  make_current();
  background_ = Program::of_background(gl_);
  wireframe_ = Program::of_wireframe(gl_);
  make_noise();
  make_weave();
  gl_.GenVertexArrays(1, &empty_array_);
  gl_.Enable(GL_SCISSOR_TEST);
  gl_.Enable(GL_DEPTH_TEST);
  gl_.DepthFunc(GL_LEQUAL);
  gl_.BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  warm_up();
}

void GlCanvas::make_noise() {
  const TissueNoise& volumes = tissue_noise();
  constexpr GLsizei kSize = kTissueNoiseSize;
  std::array<GLuint, 2> textures{};
  gl_.GenTextures(2, textures.data());
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& texels = i == 0 ? volumes.noise : volumes.relief;
    gl_.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(i));
    gl_.BindTexture(GL_TEXTURE_3D, textures[i]);
    gl_.TexImage3D(GL_TEXTURE_3D, 0, GL_RGBA8, kSize, kSize, kSize, 0, GL_RGBA, GL_UNSIGNED_BYTE, texels.data());
    gl_.GenerateMipmap(GL_TEXTURE_3D);
    for (const GLenum axis : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R}) {
      gl_.TexParameteri(GL_TEXTURE_3D, axis, GL_REPEAT);
    }
    gl_.TexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    gl_.TexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_NEAREST);
  }
}

// The mottling of the relief where z is 0, averaged to texels of 0.4 mm: without mipmaps a look-up takes less than half
// of the time, and seen from where instruments reach, a pixel is about as large.
void GlCanvas::make_weave() {
  constexpr std::size_t kSize = kTissueNoiseSize, kCell = 4, kWeave = kSize / kCell;
  std::array<unsigned, kWeave * kWeave> sums{};
  for (const std::size_t z : {std::size_t{0}, kSize - 1})  // z = 0 is between them
    for (std::size_t y = 0; y < kSize; ++y)
      for (std::size_t x = 0; x < kSize; ++x)
        sums[y / kCell * kWeave + x / kCell] += tissue_noise().relief[4 * ((z * kSize + y) * kSize + x) + 3];
  std::array<std::uint8_t, kWeave * kWeave> texels;
  std::transform(sums.begin(), sums.end(), texels.begin(),
                 [](unsigned sum) { return static_cast<std::uint8_t>(sum / (2 * kCell * kCell)); });
  GLuint texture = 0;
  gl_.GenTextures(1, &texture);
  gl_.ActiveTexture(GL_TEXTURE3);
  gl_.BindTexture(GL_TEXTURE_2D, texture);
  gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_R8, kWeave, kWeave, 0, GL_RED, GL_UNSIGNED_BYTE, texels.data());
  gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
}

void GlCanvas::make_sample_buffer() {
  if (sample_framebuffer_ == 0) {
    gl_.GenFramebuffers(1, &sample_framebuffer_);
    gl_.GenRenderbuffers(2, sample_buffers_.data());
  }
  samples_width_px_ = image_.width_px;
  samples_height_px_ = image_.height_px;
  gl_.BindFramebuffer(GL_FRAMEBUFFER, sample_framebuffer_);
  const std::array<std::array<GLenum, 2>, 2> attachments{
      {{GL_RGBA8, GL_COLOR_ATTACHMENT0}, {GL_DEPTH_COMPONENT24, GL_DEPTH_ATTACHMENT}}};
  for (std::size_t i = 0; i < attachments.size(); ++i) {
    gl_.BindRenderbuffer(GL_RENDERBUFFER, sample_buffers_[i]);
    gl_.RenderbufferStorageMultisample(GL_RENDERBUFFER, samples_, attachments[i][0], image_.width_px, image_.height_px);
    gl_.FramebufferRenderbuffer(GL_FRAMEBUFFER, attachments[i][1], GL_RENDERBUFFER, sample_buffers_[i]);
  }
  if (gl_.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw InputError("this OpenGL has no buffers of " + std::to_string(samples_) + " samples a pixel");
  }
}

// Compiles what most scenes need, so that neither a first cut nor an instrument that comes in holds up a picture.
void GlCanvas::warm_up() {
  unseen_triangle_ = add_mesh();
  set_vertices(unseen_triangle_, std::array<CanvasVertex, 3>{});
  set_indices(unseen_triangle_, std::array<std::uint32_t, 3>{0, 1, 2});
  begin({});
  for (const Shading shading :
       {Shading::skin, Shading::wall, Shading::blood, Shading::metal, Shading::polymer, Shading::glow, Shading::drape})
    program({.shading = shading});
  draw_wireframe(unseen_triangle_, {0, 3}, Eigen::Matrix4f::Identity());
  finish();
}

// llvmpipe compiles a shader when something is drawn with it. The triangle has no area. A shading that takes shadows is
// compiled with and without them: instruments come and go in the middle of a session.
const Program& GlCanvas::program(const ShaderVariant& variant) {
  if (const auto found = programs_.find(variant); found != programs_.end()) return found->second;
  ShaderVariant made = variant;
  for (const bool shadows : {false, true}) {
    if (shadows && !takes_shadows(variant.shading)) continue;
    made.shadows = shadows;
    const Program& program = programs_.emplace(made, Program::of_variant(gl_, made)).first->second;
    program.use();
    draw_elements(unseen_triangle_, {0, 3});
  }
  return programs_.at(variant);
}

MeshId GlCanvas::add_mesh() {
  make_current();
  std::size_t place = 0;
  while (place < meshes_.size() && !meshes_[place].is_free()) ++place;
  if (place == meshes_.size()) meshes_.emplace_back();
  GpuMesh& mesh = meshes_[place];
  gl_.GenVertexArrays(1, &mesh.array);
  gl_.GenBuffers(1, &mesh.vertices);
  gl_.GenBuffers(1, &mesh.indices);
  gl_.BindVertexArray(mesh.array);
  gl_.BindBuffer(GL_ARRAY_BUFFER, mesh.vertices);
  gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, mesh.indices);
  const auto attribute = [this](GLuint location, GLint size, GLenum type, std::size_t offset) {
    gl_.EnableVertexAttribArray(location);
    gl_.VertexAttribPointer(location, size, type, GL_TRUE, sizeof(CanvasVertex),
                            reinterpret_cast<const void*>(offset));  // NOLINT(performance-no-int-to-ptr): GL's way
  };
  attribute(0, 3, GL_FLOAT, offsetof(CanvasVertex, position_m));
  attribute(1, 3, GL_FLOAT, offsetof(CanvasVertex, normal));
  attribute(2, 4, GL_FLOAT, offsetof(CanvasVertex, rest_m));
  attribute(3, 4, GL_UNSIGNED_BYTE, offsetof(CanvasVertex, pattern));
  attribute(4, 1, GL_FLOAT, offsetof(CanvasVertex, scalar));
  return static_cast<MeshId>(place);
}

void GlCanvas::remove_mesh(MeshId mesh) {
  make_current();
  GpuMesh& m = meshes_[mesh];
  gl_.DeleteVertexArrays(1, &m.array);
  gl_.DeleteBuffers(1, &m.vertices);
  gl_.DeleteBuffers(1, &m.indices);
  if (m.lines != 0) gl_.DeleteBuffers(1, &m.lines);
  if (m.region_cells != 0) gl_.DeleteTextures(1, &m.region_cells);
  m = {};
}

void GlCanvas::set_vertices(MeshId mesh, std::span<const CanvasVertex> vertices) {
  make_current();
  GpuMesh& m = meshes_[mesh];
  gl_.BindBuffer(GL_ARRAY_BUFFER, m.vertices);
  if (vertices.size() > m.vertex_capacity) {
    m.vertex_capacity = vertices.size() + vertices.size() / 4;
    gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(m.vertex_capacity * sizeof(CanvasVertex)), nullptr,
                   GL_DYNAMIC_DRAW);
  }
  gl_.BufferSubData(GL_ARRAY_BUFFER, 0, static_cast<GLsizeiptr>(vertices.size_bytes()), vertices.data());
}

void GlCanvas::set_indices(MeshId mesh, std::span<const std::uint32_t> indices) {
  make_current();
  GpuMesh& m = meshes_[mesh];
  gl_.BindVertexArray(m.array);
  gl_.BufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size_bytes()), indices.data(),
                 GL_STATIC_DRAW);
  m.index_count = static_cast<std::uint32_t>(indices.size());
  if constexpr (!kWireframesAreLines) return;
  m.triangles.assign(indices.begin(), indices.end());
  if (m.lines != 0) gl_.DeleteBuffers(1, &m.lines);
  m.lines = 0;
}

void GlCanvas::begin(const CanvasView& view) {
  make_current();
  view_ = view;
  target_ = context_->target();
  if (view.part != PicturePart::whole) target_.width_px /= 2;
  if (view.part == PicturePart::right_half) target_.left_px += target_.width_px;
  if (samples_ > 1 && (samples_width_px_ != image_.width_px || samples_height_px_ != image_.height_px))
    make_sample_buffer();
  gl_.BindFramebuffer(GL_FRAMEBUFFER, sample_framebuffer_ != 0 ? sample_framebuffer_ : target_.framebuffer);
  gl_.Viewport(target_.left_px, target_.bottom_px, target_.width_px, target_.height_px);
  gl_.Scissor(target_.left_px, target_.bottom_px, target_.width_px, target_.height_px);  // the rest stays
  gl_.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

void GlCanvas::set_occluder_uniforms(const Program& program) const {
  std::array<Vec4f, 2> from, to;
  for (std::size_t i = 0; i < 2; ++i) {
    const Occluder& occluder = view_.occluders[i];
    from[i] = view_.view_from_world * occluder.from_world_m.homogeneous();
    to[i] = view_.view_from_world * occluder.to_world_m.homogeneous();
    from[i].w() = occluder.from_radius_m;
    to[i].w() = occluder.to_radius_m;
  }
  program.set("occluder_from", std::span<const Vec4f>(from));
  program.set("occluder_to", std::span<const Vec4f>(to));
  program.set("occluder_count", view_.occluder_count);
}

void GlCanvas::set_layer_uniforms(const Program& program, std::span<const TissueLayer> layers) {
  std::array<Vec4f, kMaxLayers> uniform;
  for (std::size_t i = 0; i < kMaxLayers; ++i) {
    const TissueLayer& layer = layers[std::min(i, layers.size() - 1)];
    const bool is_last = i + 1 >= layers.size();
    uniform[i] << layer.colour.cwiseProduct(layer.colour).cast<float>(),
        is_last ? kNeverDeep_m : static_cast<float>(layer.to_depth_m);
  }
  program.set("layer", std::span<const Vec4f>(uniform));
}

void GlCanvas::set_section_uniforms(const Program& program, const Material& material) const {
  const Eigen::Matrix4f view_to_world = view_.view_from_world.inverse();
  program.set("section", Vec4f(view_to_world.transpose() * *view_.section));
  program.set("inside_colour", material.inside_colour);
  program.set("rest_from_view", Eigen::Matrix4f(material.rest_from_world * view_to_world));
}

Eigen::Vector2f GlCanvas::half_size_px() const {
  return 0.5f * Eigen::Vector2f(static_cast<float>(target_.width_px), static_cast<float>(target_.height_px));
}

void GlCanvas::draw_elements(MeshId mesh, IndexRange range) {
  SECTIO_ASSERT(range.first + range.count <= meshes_[mesh].index_count, "the range is within the index buffer");
  gl_.BindVertexArray(meshes_[mesh].array);
  gl_.DrawElements(GL_TRIANGLES, static_cast<GLsizei>(range.count), GL_UNSIGNED_INT,
                   // NOLINTNEXTLINE(performance-no-int-to-ptr): GL's way
                   reinterpret_cast<const void*>(sizeof(std::uint32_t) * std::size_t{range.first}));
}

void GlCanvas::set_regions(MeshId mesh, std::span<const Region> regions, const Eigen::AlignedBox3d& rest_box) {
  make_current();
  GpuMesh& m = meshes_[mesh];
  if (m.region_cells != 0) gl_.DeleteTextures(1, &m.region_cells);
  m.region_cells = 0;
  m.regions = {};
  if (regions.empty()) return;
  m.regions = region_table(regions, rest_box);
  m.region_cells = make_cells(m.regions.cells);
}

// A texture with a number for each cell of the grid, read as it is.
GLuint GlCanvas::make_cells(std::span<const std::uint32_t> cells) {
  constexpr GLsizei kSize = kRegionGridSize;
  GLuint texture = 0;
  gl_.GenTextures(1, &texture);
  gl_.ActiveTexture(GL_TEXTURE2);
  gl_.BindTexture(GL_TEXTURE_3D, texture);
  gl_.TexImage3D(GL_TEXTURE_3D, 0, GL_R32UI, kSize, kSize, kSize, 0, GL_RED_INTEGER, GL_UNSIGNED_INT, cells.data());
  gl_.TexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  gl_.TexParameteri(GL_TEXTURE_3D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  return texture;
}

void GlCanvas::set_region_uniforms(const Program& program, const RegionTable& table) {
  program.set("part_of", std::span<const std::array<int, 2>>(table.part_of));
  program.set("part_a", std::span<const Vec4f>(table.part_a));
  program.set("part_b", std::span<const Vec4f>(table.part_b));
  program.set("part_q", std::span<const Vec4f>(table.part_q));
  program.set("region_colour", std::span<const Vec4f>(table.colour));
  program.set("region_grain", std::span<const Vec4f>(table.grain));
  program.set("region_rim", std::span<const Vec4f>(table.rim));
  program.set("grid_from", table.grid_from_m);
  program.set("grid_per", table.grid_per_m);
}

void GlCanvas::draw(MeshId mesh, IndexRange range, const Material& material, const Eigen::Matrix4f& world_from_mesh) {
  const GpuMesh& m = meshes_[mesh];
  const Shading shading = material.shading;
  const ShaderVariant variant{.shading = shading,
                              .regions = m.region_cells != 0 && (shading == Shading::skin || shading == Shading::wall),
                              .shadows = view_.occluder_count > 0 && !material.lit && takes_shadows(shading),
                              .pattern_per_pixel = shading == Shading::skin && material.pattern_per_pixel,
                              .section = view_.section && is_tissue(shading),
                              .layers = shading == Shading::wall && !material.layers.empty()};
  if (variant.regions) {
    gl_.ActiveTexture(GL_TEXTURE2);
    gl_.BindTexture(GL_TEXTURE_3D, m.region_cells);
  }
  const Program& program = this->program(variant);
  if (range.count == 0) return;
  program.use();
  program.set("view_from_mesh", Eigen::Matrix4f(view_.view_from_world * world_from_mesh));
  program.set("projection", view_.projection);
  program.set("base_colour", material.colour);
  if (variant.regions) set_region_uniforms(program, m.regions);
  if (variant.shadows) set_occluder_uniforms(program);
  if (variant.layers) set_layer_uniforms(program, material.layers);
  if (variant.section) set_section_uniforms(program, material);
  if ((shading == Shading::skin && !variant.section) || shading == Shading::drape) {
    gl_.Enable(GL_CULL_FACE);
  } else {
    gl_.Disable(GL_CULL_FACE);
  }
  // A body on a drape sinks into it a little, and the back faces of a section must not be hidden there.
  const bool goes_behind = view_.section && shading == Shading::drape;
  if (goes_behind) gl_.DepthRangef(kBehindAll, kBehindAll);
  draw_elements(mesh, range);
  if (goes_behind) gl_.DepthRangef(0.0f, 1.0f);
}

// The edges of the triangles of a range, each drawn once or twice, a little before the triangles themselves.
void GlCanvas::draw_lines(GpuMesh& m, IndexRange range) {
  gl_.BindVertexArray(m.array);
  if (m.lines == 0) {
    std::vector<std::uint32_t> lines;
    lines.reserve(2 * m.triangles.size());
    for (std::size_t i = 0; i + 2 < m.triangles.size(); i += 3)
      for (std::size_t k = 0; k < 3; ++k) {
        lines.push_back(m.triangles[i + k]);
        lines.push_back(m.triangles[i + (k + 1) % 3]);
      }
    gl_.GenBuffers(1, &m.lines);
    gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, m.lines);
    gl_.BufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(sizeof(std::uint32_t) * lines.size()), lines.data(),
                   GL_STATIC_DRAW);
  }
  Eigen::Matrix4f nearer = view_.projection;
  nearer.row(2) -= 2e-4f * nearer.row(3);
  wireframe_.set("projection", nearer);
  gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, m.lines);
  gl_.DrawElements(GL_LINES, static_cast<GLsizei>(2 * range.count), GL_UNSIGNED_INT,
                   // NOLINTNEXTLINE(performance-no-int-to-ptr): GL's way
                   reinterpret_cast<const void*>(2 * sizeof(std::uint32_t) * std::size_t{range.first}));
  gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, m.indices);
}

void GlCanvas::draw_wireframe(MeshId mesh, IndexRange range, const Eigen::Matrix4f& world_from_mesh) {
  if (range.count == 0) return;
  wireframe_.use();
  wireframe_.set("view_from_mesh", Eigen::Matrix4f(view_.view_from_world * world_from_mesh));
  wireframe_.set("projection", view_.projection);
  wireframe_.set("half_size_px", half_size_px());
  gl_.Enable(GL_CULL_FACE);
  gl_.Enable(GL_BLEND);
  gl_.Enable(GL_POLYGON_OFFSET_FILL);
  gl_.PolygonOffset(-1.0f, -1.0f);
  gl_.DepthMask(GL_FALSE);
  if constexpr (kWireframesAreLines)
    draw_lines(meshes_[mesh], range);
  else
    draw_elements(mesh, range);
  gl_.DepthMask(GL_TRUE);
  gl_.Disable(GL_POLYGON_OFFSET_FILL);
  gl_.Disable(GL_BLEND);
}

Image& GlCanvas::finish() {
  gl_.Disable(GL_CULL_FACE);
  background_.use();
  gl_.BindVertexArray(empty_array_);
  gl_.DrawArrays(GL_TRIANGLES, 0, 3);
  if (sample_framebuffer_ != 0) {
    const int right_px = target_.left_px + target_.width_px, top_px = target_.bottom_px + target_.height_px;
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, target_.framebuffer);
    gl_.BlitFramebuffer(target_.left_px, target_.bottom_px, right_px, top_px, target_.left_px, target_.bottom_px,
                        right_px, top_px, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  }
  if (!image_.rgba.empty()) {
    gl_.Finish();
    context_->finish(target_);
  }
  return image_;
}

}  // namespace

void read_pixels(const GlFunctions& gl, const GlTarget& part, Image& picture) {
  gl.BindFramebuffer(GL_READ_FRAMEBUFFER, part.framebuffer);
  gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
  for (int y = 0; y < part.height_px; ++y)
    gl.ReadPixels(part.left_px, part.bottom_px + y, part.width_px, 1, GL_RGBA, GL_UNSIGNED_BYTE,
                  picture.pixel(part.left_px, picture.height_px - 1 - part.bottom_px - y));
}

std::unique_ptr<Canvas> make_gl_canvas(std::unique_ptr<GlContext> context, int samples_per_pixel) {
  return std::make_unique<GlCanvas>(std::move(context), samples_per_pixel);
}

}  // namespace sectio
