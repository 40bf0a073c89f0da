// Draws a whole Frame: bodies, instruments, numbers. Keeps what it uploaded, so only what changed is sent again:
// positions every time, index buffers when a body's revision changed, instruments once.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "render_client/draw/body_mesh.h"
#include "render_client/draw/camera.h"
#include "render_client/draw/canvas.h"
#include "render_client/draw/floor_mesh.h"
#include "render_client/draw/overlay.h"
#include "render_client/draw/tool_mesh.h"
#include "render_client/replica/frame.h"

namespace sectio {

struct DrawOptions {
  bool wireframe = false;
  bool overlay = true;
  bool fit_camera = false;            // show all of all bodies, along the frame's own line of sight
  double frames_per_s = 0;            // for the overlay; 0: not shown
  std::optional<Stereo> stereo = {};  // the left eye's picture beside the right one's, each as large as the canvas
};

class FramePainter {
 public:
  // The canvas must outlive the painter; same thread.
  explicit FramePainter(Canvas& canvas);
  ~FramePainter();
  FramePainter(const FramePainter&) = delete;
  FramePainter& operator=(const FramePainter&) = delete;

  // The picture is the canvas's own and valid until the next call. A body with a position that is missing or not
  // finite is left out, and a line of the overlay says so.
  const Image& draw_frame(const Frame& frame, const DrawOptions& options = {});

 private:
  struct DrawnBody {
    MeshId canvas_mesh = 0;
    std::string name;
    std::uint64_t revision = 0;
    std::size_t vertex_slots = 0, triangle_slots = 0;
    BodyMesh mesh;
    bool visible = false;
  };
  struct DrawnTool {
    MeshId canvas_mesh = 0;
    std::string kind;
    std::array<Vec3, 4> abcd_tool_m;
    double opening_rad = 0;
    ToolMesh mesh;
  };

  void update_bodies(const Frame& frame);
  void update_tools(const Frame& frame);
  Image& draw_view(const Frame& frame, const DrawOptions& options, const EyeView& eye);
  std::vector<std::string> overlay_lines(const Frame& frame, const DrawOptions& options) const;

  Canvas& canvas_;
  Text text_;
  std::string session_;
  std::vector<DrawnBody> bodies_;
  std::vector<DrawnTool> tools_;
  FloorMesh floor_;
  MeshId floor_mesh_ = 0;
  Image pair_;
};

}  // namespace sectio
