#include "render_client/draw/draw_frame.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

#include <Eigen/SVD>

#include "common/core/formatted.h"

namespace sectio {

namespace {

constexpr float kBlood[] = {0.30f, 0.03f, 0.04f};

Eigen::Matrix4f matrix_of(const Pose& pose) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = pose.orientation.normalized().toRotationMatrix();
  m.topRightCorner<3, 1>() = pose.position_m;
  return m.cast<float>();
}

bool is_drawable(const ToolFrame& tool) {
  return tool.present && tool.pose_world.position_m.allFinite() && tool.pose_world.orientation.coeffs().allFinite();
}

Occluder to_world(const Occluder& tool, const Pose& pose) {
  return {pose.to_world(tool.from_world_m.cast<double>()).cast<float>(),
          pose.to_world(tool.to_world_m.cast<double>()).cast<float>(), tool.from_radius_m, tool.to_radius_m};
}

Shading shading_of(BodySurface surface) {
  switch (surface) {
    case BodySurface::plastic:
      return Shading::plastic;
    case BodySurface::steel:
      return Shading::metal;
    case BodySurface::cloth:
      return Shading::cloth;
    default:
      return Shading::skin;
  }
}

std::string format(const char* pattern, double value) {
  return formatted(pattern, value);
}

// Between gravity and straight down.
double tilt_of_deg(const Vec3& gravity_m_per_s2) {
  if (gravity_m_per_s2.norm() < 1e-9) return 0;
  return std::acos(std::clamp(-gravity_m_per_s2.normalized().z(), -1.0, 1.0)) * 180 / std::numbers::pi;
}

// The rigid motion that brings a body back to rest as well as one can.
Eigen::Matrix4f rest_from_world(const BodyFrame& body) {
  Vec3 world_mean = Vec3::Zero(), rest_mean = Vec3::Zero();
  double corners = 0;
  const auto for_corners = [&](const auto& visit) {
    for (const Triangle& t : body.triangles)
      if (t.alive())
        for (const VertexId v : t.v) visit(Vec3(body.positions_world_m[v].cast<double>()), body.rest_body_m[v]);
  };
  for_corners([&](const Vec3& world, const Vec3f& rest) {
    world_mean += world;
    rest_mean += rest.cast<double>();
    ++corners;
  });
  if (corners == 0) return Eigen::Matrix4f::Identity();
  world_mean /= corners;
  rest_mean /= corners;
  Mat3 covariance = Mat3::Zero();
  for_corners([&](const Vec3& world, const Vec3f& rest) {
    covariance += (rest.cast<double>() - rest_mean) * (world - world_mean).transpose();
  });
  const Eigen::JacobiSVD<Mat3> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double hand = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  Eigen::Matrix4d motion = Eigen::Matrix4d::Identity();
  motion.topLeftCorner<3, 3>() = svd.matrixU() * Vec3(1, 1, hand).asDiagonal() * svd.matrixV().transpose();
  motion.topRightCorner<3, 1>() = rest_mean - motion.topLeftCorner<3, 3>() * world_mean;
  return motion.cast<float>();
}

const ScalarField* field_of(const BodyFrame& body, const std::string& name) {
  const auto found = std::find_if(body.scalars.begin(), body.scalars.end(),
                                  [&](const ScalarField& field) { return field.name == name; });
  return found == body.scalars.end() ? nullptr : &*found;
}

// The range of the field over all bodies that have it.
std::optional<FieldRange> range_of(const Frame& frame, const std::string& name) {
  std::optional<FieldRange> range;
  for (const BodyFrame& body : frame.bodies) {
    const ScalarField* field = field_of(body, name);
    if (!field) continue;
    if (!range) range = FieldRange{field->least, field->most};
    range->least = std::min(range->least, field->least);
    range->most = std::max(range->most, field->most);
  }
  return range;
}

// The text follows the picture: 14 pixels high at 720 lines.
int text_size_px(int height_px) {
  return std::clamp(height_px / 50, 10, 40);
}

}  // namespace

FramePainter::FramePainter(Canvas& canvas)
    : canvas_(canvas), text_(text_size_px(canvas.height_px())), floor_mesh_(canvas.add_mesh()) {
  canvas_.set_indices(floor_mesh_, floor_.indices());
}

FramePainter::~FramePainter() {
  while (!bodies_.empty()) remove_last_body();
  for (const DrawnTool& tool : tools_) canvas_.remove_mesh(tool.canvas_mesh);
  canvas_.remove_mesh(floor_mesh_);
}

void FramePainter::remove_last_body() {
  canvas_.remove_mesh(bodies_.back().canvas_mesh);
  canvas_.remove_mesh(bodies_.back().canvas_lips);
  bodies_.pop_back();
}

void FramePainter::update_bodies(const Frame& frame, const DrawOptions& options) {
  field_range_ = range_of(frame, options.field);
  const bool is_another =
      std::exchange(arrangement_, {frame.session, frame.arrangement}) != std::pair(frame.session, frame.arrangement);
  while (bodies_.size() > frame.bodies.size()) remove_last_body();
  for (std::size_t i = 0; i < frame.bodies.size(); ++i) {
    const BodyFrame& body = frame.bodies[i];
    bool arranged = i < bodies_.size() && !is_another;
    if (i == bodies_.size()) {
      bodies_.emplace_back().canvas_mesh = canvas_.add_mesh();
      bodies_.back().canvas_lips = canvas_.add_mesh();
    }
    DrawnBody& drawn = bodies_[i];
    arranged = arranged && drawn.revision == body.revision && drawn.name == body.name &&
               drawn.vertex_slots == body.rest_body_m.size() && drawn.triangle_slots == body.triangles.size();
    if (!arranged) {
      drawn.mesh.arrange(body);
      if (drawn.name != body.name || drawn.vertex_slots == 0 || is_another) {
        canvas_.set_regions(drawn.canvas_mesh, body.regions, drawn.mesh.rest_box());
        drawn.pattern_per_pixel = drawn.mesh.is_coarse();
      }
      drawn.name = body.name;
      drawn.revision = body.revision;
      drawn.vertex_slots = body.rest_body_m.size();
      drawn.triangle_slots = body.triangles.size();
      canvas_.set_indices(drawn.canvas_mesh, drawn.mesh.indices());
      drawn.lips.arrange(body);
      canvas_.set_indices(drawn.canvas_lips, drawn.lips.indices());
    }
    const ScalarField* field = field_of(body, options.field);
    drawn.shows_field = field != nullptr;
    drawn.visible = drawn.mesh.move(body);
    if (field)
      drawn.mesh.set_scalars(field, field_range_->least, field_range_->most);
    else
      drawn.mesh.set_scalars(field_of(body, "wetness"));
    if (!drawn.visible) continue;
    canvas_.set_vertices(drawn.canvas_mesh, drawn.mesh.vertices());
    if (drawn.lips.empty()) continue;
    drawn.lips.move(body);
    canvas_.set_vertices(drawn.canvas_lips, drawn.lips.vertices());
  }
}

void FramePainter::update_tools(const Frame& frame) {
  while (tools_.size() > frame.tools.size()) {
    canvas_.remove_mesh(tools_.back().canvas_mesh);
    tools_.pop_back();
  }
  for (std::size_t i = 0; i < frame.tools.size(); ++i) {
    const ToolFrame& tool = frame.tools[i];
    const bool is_new = i == tools_.size();
    if (is_new) tools_.emplace_back().canvas_mesh = canvas_.add_mesh();
    DrawnTool& drawn = tools_[i];
    if (!is_new && drawn.kind == tool.kind && drawn.abcd_tool_m == tool.abcd_tool_m &&
        drawn.opening_rad == tool.pose_world.opening_rad)
      continue;
    drawn.kind = tool.kind;
    drawn.abcd_tool_m = tool.abcd_tool_m;
    drawn.opening_rad = tool.pose_world.opening_rad;
    drawn.mesh = make_tool_mesh(tool);
    canvas_.set_indices(drawn.canvas_mesh, drawn.mesh.indices);
    canvas_.set_vertices(drawn.canvas_mesh, drawn.mesh.vertices);
  }
}

Camera FramePainter::camera_of(const Frame& frame, const DrawOptions& options) const {
  return options.fit_camera ? fit_camera(frame, aspect(options)) : frame.camera;
}

void FramePainter::update(const Frame& frame, const DrawOptions& options) {
  update_bodies(frame, options);
  update_tools(frame);
  if (!frame.floor_z_m) return;
  floor_.move(frame, camera_of(frame, options));
  canvas_.set_vertices(floor_mesh_, floor_.vertices());
}

const Image& FramePainter::draw_eye(const Frame& frame, const DrawOptions& options, const EyeView& eye) {
  return draw_part(frame, options, eye, PicturePart::whole);
}

const Image& FramePainter::draw_frame(const Frame& frame, const DrawOptions& options) {
  update(frame, options);
  const Camera camera = camera_of(frame, options);
  const double aspect = this->aspect(options);
  if (!options.stereo) return draw_eye(frame, options, {view_from_world(camera), projection(camera, aspect)});
  draw_part(frame, options, eye_view(camera, aspect, *options.stereo, -1), PicturePart::left_half);
  return draw_part(frame, options, eye_view(camera, aspect, *options.stereo, 1), PicturePart::right_half);
}

void FramePainter::draw_parts(MeshId mesh, const ShadowSplit::Parts& parts, Material material) {
  material.lit = true;
  canvas_.draw(mesh, parts.lit, material, Eigen::Matrix4f::Identity());
  material.lit = false;
  canvas_.draw(mesh, parts.shadowed, material, Eigen::Matrix4f::Identity());
}

void FramePainter::draw_body(const DrawnBody& drawn, const BodyFrame& body, const CanvasView& view,
                             const DrawOptions& options) {
  const Eigen::Matrix4f in_world = Eigen::Matrix4f::Identity();
  const IndexRange all{0, static_cast<std::uint32_t>(drawn.mesh.indices().size())};
  Material material{Shading::scalar_field, body.skin_colour.cast<float>(), drawn.pattern_per_pixel,
                    body.wall_colour.cast<float>()};
  if (options.section) material.rest_from_world = rest_from_world(body);
  if (drawn.shows_field) {
    canvas_.draw(drawn.canvas_mesh, all, material, in_world);
  } else {
    const bool is_tissue = body.surface == BodySurface::tissue;
    material.shading = shading_of(body.surface);
    split_.look(view, drawn.mesh.vertices());
    const ShadowSplit::Parts skin = split_.append(drawn.mesh.indices(), drawn.mesh.skin()),
                             walls = split_.append(drawn.mesh.indices(), drawn.mesh.walls());
    if (view.occluder_count > 0) canvas_.set_indices(drawn.canvas_mesh, split_.indices());
    draw_parts(drawn.canvas_mesh, skin, material);
    if (is_tissue) material.shading = Shading::wall;
    material.colour = material.inside_colour;
    material.layers = body.layers;
    draw_parts(drawn.canvas_mesh, walls, material);
    const IndexRange lips{0, static_cast<std::uint32_t>(drawn.lips.indices().size())};
    if (is_tissue && lips.count > 0)
      canvas_.draw(drawn.canvas_lips, lips, {Shading::blood, Vec3f(kBlood[0], kBlood[1], kBlood[2])}, in_world);
  }
  if (options.wireframe && !options.section) canvas_.draw_wireframe(drawn.canvas_mesh, all, in_world);
}

void FramePainter::draw_floor(const CanvasView& view) {
  constexpr float kCloth[] = {0.13f, 0.36f, 0.38f};
  split_.look(view, floor_.vertices());
  const ShadowSplit::Parts parts =
      split_.append(floor_.indices(), {0, static_cast<std::uint32_t>(floor_.indices().size())});
  canvas_.set_indices(floor_mesh_, split_.indices());
  draw_parts(floor_mesh_, parts, {Shading::drape, Vec3f(kCloth[0], kCloth[1], kCloth[2])});
}

const Image& FramePainter::draw_part(const Frame& frame, const DrawOptions& options, const EyeView& eye,
                                     PicturePart part) {
  CanvasView view;
  view.part = part;
  view.view_from_world = eye.view_from_world;
  view.projection = eye.projection;
  if (options.section) {
    const Vec3f normal = options.section->normal_world.cast<float>();
    view.section = (Vec4f() << normal, -normal.dot(options.section->point_world_m.cast<float>())).finished();
  }
  for (std::size_t i = 0; i < tools_.size() && view.occluder_count < 2; ++i) {
    if (!is_drawable(frame.tools[i])) continue;
    view.occluders[static_cast<std::size_t>(view.occluder_count++)] =
        to_world(tools_[i].mesh.shadow, frame.tools[i].pose_world);
  }

  canvas_.begin(view);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (bodies_[i].visible) draw_body(bodies_[i], frame.bodies[i], view, options);
  }
  for (std::size_t i = 0; i < tools_.size(); ++i) {
    if (!is_drawable(frame.tools[i])) continue;
    const Eigen::Matrix4f world_from_tool = matrix_of(frame.tools[i].pose_world);
    for (const ToolPart& piece : tools_[i].mesh.parts) {
      canvas_.draw(tools_[i].canvas_mesh, piece.range, piece.material, world_from_tool);
    }
  }
  if (frame.floor_z_m) draw_floor(view);
  Image& image = canvas_.finish();
  if (!options.overlay) return image;
  const int left_px = part == PicturePart::right_half ? image.width_px / 2 : 0;
  draw_panel(image, text_, overlay_lines(frame, options), left_px);
  if (field_range_) draw_legend(image, text_, options.field, *field_range_, left_px);
  return image;
}

std::vector<std::string> FramePainter::overlay_lines(const Frame& frame, const DrawOptions& options) const {
  std::string title = frame.session.empty() ? "no session" : frame.session;
  for (const BodyFrame& body : frame.bodies) title += "   " + body.name + " r" + std::to_string(body.revision);
  std::string numbers = "step " + std::to_string(frame.step) + "   " + format("%.3f s", frame.sim_time_s) +
                        format("   %.2f ms/step", 1e3 * frame.step_wall_time_s);
  if (options.frames_per_s > 0) numbers += format("   %.0f frames/s", options.frames_per_s);
  std::vector<std::string> lines{title, numbers};
  if (frame.in_contact) lines.emplace_back("in contact");
  if (const double tilt_deg = tilt_of_deg(frame.gravity_m_per_s2); tilt_deg > 0.5)
    lines.push_back(format("patient tilted by %.0f deg", tilt_deg));
  if (!options.field.empty() && !field_range_) lines.push_back("no body has a field " + options.field);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (!bodies_[i].visible) lines.push_back(frame.bodies[i].name + ": not drawn, positions are not finite");
  }
  return lines;
}

}  // namespace sectio
