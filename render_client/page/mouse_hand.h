// A mouse as a hand. The pointer leads the instrument's tip over the tissue: hovering while no button is down, and,
// while the first button is down, a depth beneath the surface. From the moment at which a button goes down the surface
// is taken as it was then, so that neither the tissue that the instrument moves nor the piece that it holds moves the
// hand. The instrument stands on the mean of the surface around its tip: a hand doesn't turn with every bump, and a
// thin vessel is cut along the line of sight. A stroke may begin beside a body: the tip is then as far from the eye as
// the body's rim, goes down there, and comes into the body from outside. A stroke that has begun follows the plane
// through its last contact where there is no tissue, and over an open cut; a hovering tip stays as far from the eye.
// The sharp edge leads: the instrument turns into the direction of its motion. Closed jaws carry what they hold
// upright, and higher than a hand hovers.
//
// The result is a wish: a device_bridge draws a mass along it, which tissue holds up. Time is passed in.
#pragma once

#include <optional>

#include "render_client/page/pick.h"

namespace sectio {

struct Pointer {
  Ray ray;
  bool pressed = false;  // the first button: into the tissue
  bool closes = false;   // the second button: jaws
};

class MouseHand {
 public:
  static constexpr double kHover_m = 0.008;
  static constexpr double kCarry_m = 0.04;
  static constexpr double kAround_m = 0.012;  // so far the surface around the tip counts for its normal
  static constexpr double kBeside_m = 0.03;   // so near to a body's rim a stroke may begin beside it
  static constexpr double kDefaultDepth_m = 0.005;
  static constexpr double kDeepest_m = 0.05;
  static constexpr double kSink_m_per_s = 0.08;  // down into the tissue and up again
  static constexpr double kTurn_m = 0.006;       // the edge turns into the direction of motion over this way
  static constexpr double kBegins_m = 0.001;     // at once, when a stroke has gone so far
  static constexpr double kWidest_rad = 0.6;     // widest angle of jaws
  static constexpr double kSnip_rad = 0.14;      // scissors, which then cut 8 mm: a blade's length would leave a curve
  static constexpr double kJaws_rad_per_s = 1.5;

  explicit MouseHand(double widest_rad = kWidest_rad) : widest_rad_(widest_rad) {}

  // `right_world`: where the edge points at first.
  void point(const Pointer& pointer, const Frame& frame, const Vec3& right_world);
  // The tip rises. A button that is down counts again once it has been up.
  void lift();
  void deepen(double by_m);
  void roll(double by_rad) { roll_rad_ += by_rad; }
  void pitch(double by_rad);
  // Time goes on: the tip sinks and rises, jaws close and open.
  void tick(double now_s);

  // Nothing before the pointer has been over tissue, or near it.
  std::optional<JointPose> wish() const;
  double depth_m() const { return depth_m_; }
  bool pressed() const { return pressed_; }
  bool waits_for_button() const { return is_lifted_; }  // it was lifted while one was down, and that one is still down
  // How often the button went down where there is no body near.
  unsigned presses_beside() const { return presses_beside_; }

 private:
  struct Contact {
    Vec3 point_world_m;
    Vec3 normal_world;
  };
  std::optional<Contact> contact_at(const Ray& ray, const std::optional<Hit>& hit) const;
  std::optional<Contact> contact_beside(const Ray& ray) const;

  std::optional<Contact> contact_;
  SurfaceShot shot_;  // taken when a button went down
  Vec3 ahead_world_ = Vec3::UnitX();
  bool has_ahead_ = false;
  std::optional<Vec3> begins_at_m_;  // the place at which the button went down
  bool has_begun_ = false;           // the stroke has a direction
  bool pressed_ = false, closes_ = false;
  bool button_is_down_ = false, any_is_down_ = false, is_lifted_ = false;
  unsigned presses_beside_ = 0;
  double depth_m_ = kDefaultDepth_m;
  double height_m_ = kHover_m;  // the tip, above the contact
  double roll_rad_ = 0;
  double pitch_rad_ = 0.2;  // the handle leans back
  double widest_rad_, opening_rad_ = widest_rad_;
  std::optional<double> last_s_;
};

}  // namespace sectio
