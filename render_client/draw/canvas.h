// The interface between drawing and a graphics library. It names no type of that library; gl_canvas.cpp implements it
// with OpenGL, for which osmesa_canvas.cpp has a context in software. A canvas belongs to the thread that made it.
// Several canvases may live at once, also in several threads.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include <Eigen/Core>

#include "common/material/looks.h"
#include "common/material/regions.h"
#include "common/math/types.h"
#include "render_client/draw/image.h"

namespace sectio {

// Procedural materials read rest_m, so that their pattern stays with the tissue while it moves.
struct CanvasVertex {
  Vec3f position_m = Vec3f::Zero();
  Vec3f normal = Vec3f::UnitZ();  // unit
  Vec3f rest_m = Vec3f::Zero();
  float depth_m = 0;  // wall: below the lip of its cut, along the surface; drape: its shade, 0 to 1
  std::array<std::uint8_t, 4>
      pattern{};     // noise that varies slowly (tissue_noise.h); of skin: broad; of a drape: folds
  float scalar = 0;  // 0 to 1; of skin and walls: wetness; of a scalar field: the value within the range that is shown
};
static_assert(sizeof(CanvasVertex) == 48);

struct IndexRange {
  std::uint32_t first = 0;
  std::uint32_t count = 0;
};

enum class Shading : std::uint8_t {
  skin,          // moist organ surface; back faces of skin and of drapes are not drawn
  wall,          // cut tissue, lit from both sides
  blood,         // on the lips of cuts
  scalar_field,  // a colour map of the vertices' scalar, lit from both sides
  metal,         // bare steel
  polymer,       // insulation
  plastic,       // a body of plastic, lit from both sides
  cloth,         // a body of cloth, lit from both sides
  glow,          // hot tip
  drape,         // cloth beneath the bodies
};

struct Material {
  Shading shading = Shading::skin;
  Vec3f colour = Vec3f::Constant(0.6f);  // colour on the screen, 0 to 1
  // Skin whose vertices are too far apart to carry the broad pattern looks it up for each pixel.
  bool pattern_per_pixel = false;
  // A section through the mesh shows this colour, and the regions where its places were at rest.
  Vec3f inside_colour = Vec3f::Constant(0.6f);
  Eigen::Matrix4f rest_from_world = Eigen::Matrix4f::Identity();
  std::span<const TissueLayer> layers = {};  // layers of a wall, by depth; at most kMaxLayers
  bool lit = false;                          // no occluder's shadow reaches the triangles
};

// Throws a soft shadow on bodies and drapes: a cone between two spheres.
struct Occluder {
  Vec3f from_world_m = Vec3f::Zero();
  Vec3f to_world_m = Vec3f::Zero();
  float from_radius_m = 0;
  float to_radius_m = 0;
};

// The part of a picture that a view fills.
enum class PicturePart : std::uint8_t { whole, left_half, right_half };

struct CanvasView {
  Eigen::Matrix4f view_from_world = Eigen::Matrix4f::Identity();  // rigid
  Eigen::Matrix4f projection = Eigen::Matrix4f::Identity();
  std::array<Occluder, 2> occluders;
  int occluder_count = 0;
  PicturePart part = PicturePart::whole;
  // Skin, walls, blood and scalar fields aren't drawn where n . p + d > 0 in the world; n is a unit vector. The plane
  // is drawn instead, where it is inside a closed mesh.
  std::optional<Eigen::Vector4f> section;
};

using MeshId = std::uint32_t;

class Canvas {
 public:
  virtual ~Canvas() = default;

  virtual int width_px() const = 0;
  virtual int height_px() const = 0;

  virtual MeshId add_mesh() = 0;
  virtual void remove_mesh(MeshId mesh) = 0;
  virtual void set_vertices(MeshId mesh, std::span<const CanvasVertex> vertices) = 0;
  virtual void set_indices(MeshId mesh, std::span<const std::uint32_t> indices) = 0;

  // The regions inside a mesh, which its skin and walls show by rest_m; at most kMaxRegions. All rest_m lie in the box.
  virtual void set_regions(MeshId mesh, std::span<const Region> regions, const Eigen::AlignedBox3d& rest_box) = 0;

  // Lamps hang at the camera: the picture depends on where things are to the camera, not in the world.
  virtual void begin(const CanvasView& view) = 0;
  // The first draw of a material in a view compiles its shader, even when the range is empty: about 0.1 s, or 0.4 s
  // with regions.
  virtual void draw(MeshId mesh, IndexRange range, const Material& material,
                    const Eigen::Matrix4f& world_from_mesh) = 0;
  // The edges of triangles that have been drawn already.
  virtual void draw_wireframe(MeshId mesh, IndexRange range, const Eigen::Matrix4f& world_from_mesh) = 0;
  // Fills what is left with the background. The picture is valid until the next begin() and may be drawn over; it has
  // no pixels when they stay in a window.
  virtual Image& finish() = 0;
};

// samples_per_pixel: 1 (live) or 4 (stills and videos: smooth edges for about three times the time). Compiles the
// shaders that most scenes need, which takes up to about a second. Rasterises on one thread unless the environment
// variable LP_NUM_THREADS says otherwise. Throws InputError when the canvas can't be made.
std::unique_ptr<Canvas> make_osmesa_canvas(int width_px, int height_px, int samples_per_pixel = 1);

// The same, by EGL without a display: by a graphics card with Mesa's driver, where there is one. A thread draws on
// canvases of one kind at a time.
std::unique_ptr<Canvas> make_egl_canvas(int width_px, int height_px, int samples_per_pixel = 1);

}  // namespace sectio
