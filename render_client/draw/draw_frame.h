// Draws a whole Frame: bodies, instruments, numbers. It remembers the meshes that the canvas has and sends again only
// the changes: positions every time, index buffers when a body's revision changed, instruments once.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render_client/draw/body_mesh.h"
#include "render_client/draw/camera.h"
#include "render_client/draw/canvas.h"
#include "render_client/draw/floor_mesh.h"
#include "render_client/draw/lip_lines.h"
#include "render_client/draw/overlay.h"
#include "render_client/draw/shadow_split.h"
#include "render_client/draw/tool_mesh.h"
#include "render_client/replica/frame.h"

namespace sectio {

struct DrawOptions {
  bool wireframe = false;
  bool overlay = true;
  bool fit_camera = false;            // show all of all bodies, along the frame's own line of sight
  double frames_per_s = 0;            // for the overlay; 0: not shown
  std::optional<Stereo> stereo = {};  // left half of the picture: left eye; right half: right eye
  // The tissue on one side of the plane is left out, and so are the edges of triangles. Regions inside are shown as at
  // rest.
  std::optional<SectionPlane> section = {};
  std::string field = {};  // bodies with a scalar field of this name show it in colours instead of tissue
};

class FramePainter {
 public:
  // The canvas must outlive the painter; same thread.
  explicit FramePainter(Canvas& canvas);
  ~FramePainter();
  FramePainter(const FramePainter&) = delete;
  FramePainter& operator=(const FramePainter&) = delete;

  // The picture belongs to the canvas and is valid until the next call. A body with a position that is missing or not
  // finite is left out, and a line of the overlay says so. A field named "wetness", from 0 to 1, makes tissue glossy.
  const Image& draw_frame(const Frame& frame, const DrawOptions& options = {});

  // The same in two parts, for several eyes: sends what has changed, and draws the frame that was sent last as an eye
  // sees it.
  void update(const Frame& frame, const DrawOptions& options);
  const Image& draw_eye(const Frame& frame, const DrawOptions& options, const EyeView& eye);

  // The range of the shown field over all bodies that were drawn last; empty: none of them has the field.
  const std::optional<FieldRange>& field_range() const { return field_range_; }

 private:
  struct DrawnBody {
    MeshId canvas_mesh = 0, canvas_lips = 0;
    std::string name;
    std::uint64_t revision = 0;
    std::size_t vertex_slots = 0, triangle_slots = 0;
    BodyMesh mesh;
    LipLines lips;
    bool pattern_per_pixel = false;
    bool shows_field = false;
    bool visible = false;
  };
  struct DrawnTool {
    MeshId canvas_mesh = 0;
    std::string kind;
    std::array<Vec3, 4> abcd_tool_m;
    double opening_rad = 0;
    ToolMesh mesh;
  };

  void remove_last_body();
  void update_bodies(const Frame& frame, const DrawOptions& options);
  void update_tools(const Frame& frame);
  void draw_body(const DrawnBody& drawn, const BodyFrame& body, const CanvasView& view, const DrawOptions& options);
  void draw_floor(const CanvasView& view);
  void draw_parts(MeshId mesh, const ShadowSplit::Parts& parts, Material material);
  Camera camera_of(const Frame& frame, const DrawOptions& options) const;
  double aspect(const DrawOptions& options) const {  // aspect of the picture of one eye
    return static_cast<double>(canvas_.width_px()) / (options.stereo ? 2 : 1) / canvas_.height_px();
  }
  const Image& draw_part(const Frame& frame, const DrawOptions& options, const EyeView& eye, PicturePart part);
  std::vector<std::string> overlay_lines(const Frame& frame, const DrawOptions& options) const;

  Canvas& canvas_;
  Text text_;
  std::pair<std::string, std::uint64_t> arrangement_;  // session and number of what is drawn
  std::vector<DrawnBody> bodies_;
  std::vector<DrawnTool> tools_;
  std::optional<FieldRange> field_range_;
  ShadowSplit split_;
  FloorMesh floor_;
  MeshId floor_mesh_ = 0;
};

}  // namespace sectio
