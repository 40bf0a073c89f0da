// The page without its browser: a session, a camera, and a hand that follows the pointer. It tells what to draw, what
// to send and what to show beside the picture.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "render_client/draw/draw_frame.h"
#include "render_client/draw/orbit_camera.h"
#include "render_client/page/headset.h"
#include "render_client/page/live_session.h"
#include "render_client/page/mouse_hand.h"
#include "render_client/page/pad_hand.h"

namespace sectio {

class LiveView {
 public:
  LiveSession session;
  bool wireframe = false;
  std::string field;  // the bodies show it in colours; empty: tissue

  // True when there is something new to draw. Sends the wish of a hand that holds an instrument.
  bool tick(double now_s);
  const Frame& frame() const { return frame_; }
  bool has_frame() const { return camera_.has_value(); }

  // Places of the picture: -1 to 1, y up.
  void point(double x, double y, bool pressed, bool closes);
  // A pad leads the instrument from when it is pushed until the pointer does.
  void push_pad(const PadState& state);
  // A person with a headset sees the scene in the room, and a controller leads; nobody else does meanwhile.
  void wear_headset(bool on);
  std::optional<Headset>& headset() { return headset_; }
  void orbit(double right_rad, double up_rad);
  void pan(double right, double up);
  void zoom(double factor);
  void reset_camera();
  // A plane through what the camera looks at, facing it and so much nearer; it stays where it is when the camera turns.
  void set_section(bool on, double nearer_m);
  const std::optional<SectionPlane>& section() const { return section_; }
  MouseHand& hand() { return hand_; }
  void redraw() { move_camera(); }
  void set_aspect(double aspect) { aspect_ = aspect; }

  // For the script of the page, as JSON.
  std::string describe(double now_s) const;

 private:
  bool snips(std::uint32_t tool_id) const;
  static constexpr double kStillThere_s = 0.5;

  void hold(double now_s);
  void describe_people(class JsonText& json) const;
  std::uint32_t frozen_tools() const;
  void describe_tools(JsonText& json, std::span<const ServerStatus* const> statuses, double now_s) const;
  void describe_bodies(JsonText& json) const;
  void describe_lines(JsonText& json) const;
  void describe_hand(JsonText& json) const;
  void describe_score(JsonText& json) const;
  void describe_statuses(JsonText& json, std::span<const ServerStatus* const> statuses) const;
  std::optional<JointPose> instrument() const;  // the instrument that is held, if it is drawn
  std::optional<JointPose> wish() const;
  void move_camera() { moved_ = true; }

  Frame frame_;
  std::optional<Camera> first_view_;  // camera of the scene; another scene may come in its place
  std::optional<OrbitCamera> camera_;
  MouseHand hand_;
  PadHand pad_;
  bool pad_leads_ = false;
  std::optional<Headset> headset_;
  std::optional<std::uint32_t> held_;
  bool was_halted_ = false;  // the instrument in hand was frozen
  std::optional<SectionPlane> section_;
  double section_nearer_m_ = 0;
  double aspect_ = 1;
  bool moved_ = false;
  double claimed_s_ = -1e300, ticked_s_ = -1e300;
  std::uint64_t pictures_ = 0;
};

}  // namespace sectio
