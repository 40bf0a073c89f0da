// The page as its scripts call it (page.js, hand.js, headset.js). All in the one thread of the page.
#include <cstdint>
#include <memory>

#include "render_client/page/browser/webgl_context.h"
#include "render_client/page/live_view.h"

namespace {

using namespace sectio;

struct Page {
  LiveView view;
  WebglContext* context = nullptr;  // the canvas has it
  std::unique_ptr<Canvas> canvas;
  std::unique_ptr<FramePainter> painter;
  std::vector<std::uint8_t> incoming, outgoing;
  std::string description;
  bool stale = false;                  // there is something that hasn't been drawn yet
  std::array<Eigen::Matrix4f, 2> eye;  // into the eye from the room, and its projection

  DrawOptions options() const {
    return {.wireframe = view.wireframe, .overlay = false, .section = view.section(), .field = view.field};
  }
};

Page& page() {
  static Page the_page;
  return the_page;
}

}  // namespace

extern "C" {

// 0: this browser has no WebGL 2, or can't compile the shaders.
int page_begin(int width_px, int height_px) {
  std::unique_ptr<WebglContext> context = make_webgl_context(width_px, height_px);
  if (!context) return 0;
  context->make_current();
  Page& p = page();
  p.context = context.get();
  try {
    p.canvas = make_gl_canvas(std::move(context), 1);
    p.painter = std::make_unique<FramePainter>(*p.canvas);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 0;
  }
  p.view.set_aspect(static_cast<double>(width_px) / height_px);
  return 1;
}

void page_resize(int width_px, int height_px) {
  if (page().context) page().context->resize(width_px, height_px);
  page().view.set_aspect(static_cast<double>(width_px) / height_px);
  page().view.redraw();
}

const char* page_protocol() {
  static const std::string protocol = live_protocol();
  return protocol.c_str();
}

void page_connected(const char* name, const char* token) {
  page().view.session.connected({name, token});
}

void page_disconnected() {
  page().view.session.disconnected();
}
// A line among what happened, in place of the one of the same topic.
void page_note(const char* topic, const char* text) {
  page().view.session.note(topic, text);
}

// The buffer into which the script puts a frame of the socket, before page_receive().
std::uint8_t* page_incoming(int size) {
  page().incoming.resize(static_cast<std::size_t>(size));
  return page().incoming.data();
}
void page_receive(double now_s) {
  page().view.session.receive(page().incoming, now_s);
}

// 1: a picture has been drawn.
int page_tick(double now_s, int draws) {
  Page& p = page();
  p.stale = p.view.tick(now_s) || p.stale;
  if (!p.stale || draws == 0 || !p.painter) return 0;
  p.stale = false;
  // Eyes of a headset draw by themselves, as often as it asks for pictures.
  if (p.view.headset())
    p.painter->update(p.view.frame(), p.options());
  else
    p.painter->draw_frame(p.view.frame(), p.options());
  return 1;
}

// The bytes to send, page_outgoing_size() of them; until the next call.
const std::uint8_t* page_outgoing() {
  page().outgoing = page().view.session.take_outgoing();
  return page().outgoing.data();
}
int page_outgoing_size() {
  return static_cast<int>(page().outgoing.size());
}

const char* page_describe(double now_s) {
  page().description = page().view.describe(now_s);
  return page().description.c_str();
}

void page_claim(int tool_id, int action, int person) {
  page().view.session.claim(
      {static_cast<std::uint32_t>(tool_id), static_cast<ClaimAction>(action), static_cast<std::uint32_t>(person)});
}

void page_order(int kind, double gx_m_per_s2, double gy_m_per_s2, double gz_m_per_s2, double speed, double to_s,
                int tool_id) {
  const Vec3 gravity_m_per_s2(gx_m_per_s2, gy_m_per_s2, gz_m_per_s2);
  page().view.session.order(
      {0, static_cast<OrderKind>(kind), gravity_m_per_s2, speed, to_s, static_cast<std::uint32_t>(tool_id)});
}

void page_point(double x, double y, int pressed, int closes) {
  page().view.point(x, y, pressed != 0, closes != 0);
}
void page_deepen(double by_m) {
  page().view.hand().deepen(by_m);
}
void page_turn(double roll_rad, double pitch_rad) {
  page().view.hand().roll(roll_rad);
  page().view.hand().pitch(pitch_rad);
}

void page_orbit(double right_rad, double up_rad) {
  page().view.orbit(right_rad, up_rad);
}
void page_pan(double right, double up) {
  page().view.pan(right, up);
}
void page_zoom(double factor) {
  page().view.zoom(factor);
}
void page_reset_camera() {
  page().view.reset_camera();
}
void page_section(int on, double nearer_m) {
  page().view.set_section(on != 0, nearer_m);
}
void page_wireframe(int on) {
  page().view.wireframe = on != 0;
  page().view.redraw();
}
void page_field(const char* name) {
  page().view.field = name;
  page().view.redraw();
}

// Shares of full speed, -1 to 1.
void page_pad(double right, double away, double up, double roll, double pitch, int closes, int slow) {
  page().view.push_pad({right, away, up, roll, pitch, closes != 0, slow != 0});
}

void page_headset(int on) {
  page().view.wear_headset(on != 0);
  if (page().context && on == 0) page().context->aim(std::nullopt);
}
// The script puts two matrices of an eye here, by columns, before page_draw_eye().
float* page_eye() {
  return page().eye[0].data();
}
void page_draw_eye(int framebuffer, int left_px, int bottom_px, int width_px, int height_px) {
  Page& p = page();
  if (!p.view.headset() || !p.painter) return;
  p.context->aim(GlTarget{static_cast<unsigned>(framebuffer), left_px, bottom_px, width_px, height_px});
  p.painter->draw_eye(p.view.frame(), p.options(), p.view.headset()->eye(p.eye[0], p.eye[1]));
}
void page_controller(double x_m, double y_m, double z_m, double qx, double qy, double qz, double qw, double closed,
                     int carries) {
  if (page().view.headset())
    page().view.headset()->lead({{{x_m, y_m, z_m}, Eigen::Quaterniond(qw, qx, qy, qz)}, closed, carries != 0});
}

}  // extern "C"
