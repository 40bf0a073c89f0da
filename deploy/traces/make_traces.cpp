// Writes the instruments' motions of the scenes in deploy/scenes as CSV. The numbers to tune stand in the tables below.
//
// A motion: hover above the start of the stroke, press down to the depth, draw the blade along the stroke at constant
// speed, lift. The blade stands upright on the surface, leans back a little, and its sharp edge (tool +x) leads.
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "common/core/arguments.h"
#include "common/core/formatted.h"
#include "deploy/meshes/shapes.h"
#include "deploy/traces/motions.h"
#include "deploy/traces/passages.h"

namespace sectio {
namespace {

// A curve through all points with even tangents (Catmull and Rom 1974); closed paths run over their start.
Path curve(const Path& through, bool closed) {
  constexpr int kPieces = 200;
  const int n = static_cast<int>(through.size());
  const auto point = [&](int i) {
    return through[static_cast<std::size_t>(closed ? (i + n) % n : std::clamp(i, 0, n - 1))];
  };
  Path path;
  for (int i = 0; i < (closed ? n : n - 1); ++i) {
    const Vec3 a = point(i - 1), b = point(i), c = point(i + 1), d = point(i + 2);
    for (int k = 0; k < kPieces; ++k) {
      const double t = double(k) / kPieces;
      path.push_back(b + 0.5 * t * ((c - a) + t * ((2 * a - 5 * b + 4 * c - d) + t * (3 * (b - c) + d - a))));
    }
  }
  path.push_back(point(closed ? n : n - 1));
  return path;
}

// Forceps, shaft upright: they wait, come down on the skin at a place, close, carry what they hold elsewhere and open.
struct Carry {
  const char* name;
  double (*shape)(const Vec3&);
  Vec3 from_m;     // only x and y count
  double depth_m;  // the tips, below the skin, when they close
  Vec3 to_m;       // the tips are here when they open
  double wait_s;
  Vec3 park_m;           // the tips are here meanwhile
  double lift_m = 0.04;  // straight up before going anywhere
  double open_rad = 0.35;
  double turn_deg = 0;  // the jaws, about the shaft
  double stay_s = 0;    // when they have closed: they pull a little, and stay for so long
  bool carries = true;  // or they let go then
};

const auto kCarries = std::to_array<Carry>({
    {.name = "excision_kidney_forceps",
     .shape = kidney,
     .from_m = {0, 0, 0},
     .depth_m = 0.0015,
     .to_m = {0.030, -0.060, 0.002},
     .wait_s = 6.6,
     .park_m = {0.06, 0.05, 0.06},
     .turn_deg = 30},
    {.name = "tumour_kidney_forceps",
     .shape = kidney,
     .from_m = {0, 0, 0},
     .depth_m = 0.0015,
     .to_m = {0.005, -0.072, -0.008},
     .wait_s = 6.6,
     .park_m = {0.06, 0.05, 0.06},
     .turn_deg = 30},
    {.name = "tumour_kidney_hold",
     .shape = kidney,
     .from_m = {-0.040, 0.004, 0},
     .depth_m = 0.001,
     .to_m = Vec3::Zero(),
     .wait_s = 0.2,
     .park_m = {-0.08, 0.02, 0.06},
     .turn_deg = 90,
     .stay_s = 8.5,
     .carries = false},
    {.name = "exercise_tumour_forceps",
     .shape = liver,
     .from_m = {-0.030, -0.030, 0},
     .depth_m = 0.0015,
     .to_m = {-0.030, -0.122, -0.026},
     .wait_s = 7.6,
     .park_m = {0.04, 0.05, 0.10},
     .turn_deg = 30},
    {.name = "tumour_pole_forceps",
     .shape = kidney,
     .from_m = {0.046, 0.001, 0},
     .depth_m = 0.0015,
     .to_m = {0.096, 0.000, 0.007},
     .wait_s = 0.2,
     .park_m = {0.08, 0.02, 0.06},
     .stay_s = 4.2},
    {.name = "tumour_pole_hold",
     .shape = kidney,
     .from_m = {-0.010, 0.000, 0},
     .depth_m = 0.001,
     .to_m = Vec3::Zero(),
     .wait_s = 0.2,
     .park_m = {-0.05, 0.02, 0.06},
     .stay_s = 10,
     .carries = false},
});

// Scissors, blades flat ahead, go forward along a line: wide open to the next place, then they close there, not all the
// way, and open again.
struct Snips {
  const char* name;
  Vec3 first_tips_world_m;
  double ahead_deg;  // from +x towards +y
  double advance_m;  // from one snip to the next
  int snips;
  double open_rad = 0.4, shut_rad = 0.2;
  double close_s = 0.6;
  double speed_m_per_s = 0.03;
  double back_m = 0.06;  // from the first place: where they come from, and go
};

// The sheet of scissors_edge.yaml: 80 mm along x, 50 mm along y, its middle 60 mm above the floor.
const Snips kSnips{.name = "scissors_edge",
                   .first_tips_world_m = {0.0055, 0.017, 0.060},
                   .ahead_deg = 88,
                   .advance_m = 0.0125,
                   .snips = 3};

double smooth_step(double s) {
  return s * s * (3 - 2 * s);
}

// Samples as text.
class Recorder {
 protected:
  static constexpr double kStep_s = 0.01;

  explicit Recorder(bool has_jaws) : has_jaws_(has_jaws) {
    text_ = "time_s,x_world_m,y_world_m,z_world_m,qw,qx,qy,qz";
    text_ += has_jaws ? ",opening_rad\n" : "\n";
  }

  template <class PoseAt>
  void timed(double duration_s, const PoseAt& pose) {
    const int steps = std::max(1, static_cast<int>(std::lround(duration_s / kStep_s)));
    for (int i = 1; i <= steps; ++i) add(pose(double(i) / steps));
  }

  void hold(const Pose& pose, double duration_s) {
    add(pose);
    time_s_ += duration_s - kStep_s;
    add(pose);
  }
  void turn_jaws(double to_rad, double duration_s) {
    const double from_rad = opening_rad_;
    timed(duration_s, [&](double t) {
      opening_rad_ = from_rad + smooth_step(t) * (to_rad - from_rad);
      return now_;
    });
  }
  // Moves in an arc.
  void travel(const Pose& to, double duration_s, double rise_m) {
    const Pose from = now_;
    const int steps = static_cast<int>(std::lround(duration_s / kStep_s));
    for (int i = 1; i <= steps; ++i) {
      const double t = double(i) / steps;
      Pose pose = interpolate(from, to, smooth_step(t));
      pose.position_m.z() += 4 * t * (1 - t) * rise_m;
      add(pose);
    }
  }

  void add(const Pose& pose) {
    now_ = pose;
    Eigen::Quaterniond q = pose.orientation;
    if (q.coeffs().dot(last_.coeffs()) < 0) q.coeffs() = -q.coeffs();
    last_ = q;
    text_ += formatted("%.3f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f\n", time_s_, pose.position_m.x(), pose.position_m.y(),
                       pose.position_m.z(), q.w(), q.x(), q.y(), q.z());
    if (has_jaws_) {
      text_.back() = ',';
      text_ += formatted("%.6f\n", opening_rad_);
    }
    time_s_ += kStep_s;
  }

  bool has_jaws_;
  double time_s_ = 0;
  double opening_rad_ = 0;
  Pose now_;
  Eigen::Quaterniond last_ = Eigen::Quaterniond::Identity();
  std::string text_;
};

class TraceWriter : Recorder {
 public:
  explicit TraceWriter(const Motion& motion) : Recorder(motion.open_rad > 0), motion_(motion), shape_(motion.shape) {}

  std::string run() {
    opening_rad_ = motion_.open_rad;
    for (std::size_t i = 0; i < motion_.strokes.size(); ++i) {
      path_ = curve(motion_.strokes[i].through, motion_.strokes[i].closed);
      if (motion_.strokes[i].closed) path_.insert(path_.end(), path_.begin() + 1, path_.end());
      measure();
      const double last_m = motion_.strokes[i].closed ? length_m_ / 2 + motion_.strokes[i].overlap_m : length_m_;
      if (i == 0) {
        hold(at(0, motion_.height_m), motion_.hover_s);
      } else {
        travel(at(0, motion_.height_m), motion_.travel_s, motion_.height_m);
      }
      has_jaws_ ? snip(last_m) : stroke(last_m);
    }
    if (!motion_.leave_m.isZero(0)) travel({now_.position_m + motion_.leave_m, now_.orientation}, motion_.travel_s, 0);
    hold(now_, motion_.hover_s);
    return text_;
  }

 private:
  void measure() {
    arc_m_.assign(1, 0);
    for (std::size_t i = 1; i < path_.size(); ++i) {
      arc_m_.push_back(arc_m_.back() + (skin(path_[i]) - skin(path_[i - 1])).norm());
    }
    length_m_ = arc_m_.back();
  }
  Vec3 skin(const Vec3& p) const { return first_hit(shape_, Vec3(p.x(), p.y(), 0.1), Vec3(p.x(), p.y(), 0)); }
  Vec3 path_at(double s_m) const {
    const auto above = std::upper_bound(arc_m_.begin(), arc_m_.end(), std::clamp(s_m, 0.0, length_m_));
    const auto i = static_cast<std::size_t>(
        std::clamp<std::ptrdiff_t>(above - arc_m_.begin(), 1, std::ptrdiff_t(arc_m_.size()) - 1));
    const double t = (std::clamp(s_m, 0.0, length_m_) - arc_m_[i - 1]) / (arc_m_[i] - arc_m_[i - 1]);
    return path_[i - 1] + t * (path_[i] - path_[i - 1]);
  }

  // The tool's pose with its tip at `height_m` over the skin, s along the stroke.
  Pose at(double s_m, double height_m) const {
    constexpr double kLook_m = 0.002;
    const Vec3 on_skin = skin(path_at(s_m));
    const Vec3 normal = gradient(shape_, on_skin).normalized();
    const double before = std::max(s_m - kLook_m, 0.0), after = std::min(before + 2 * kLook_m, length_m_);
    Vec3 along = skin(path_at(after)) - skin(path_at(before));
    along = (along - normal * normal.dot(along)).normalized();
    const double lean = motion_.lean_deg * M_PI / 180;
    const Vec3 shaft = std::cos(lean) * normal - std::sin(lean) * along;
    Mat3 axes;
    axes.col(2) = shaft;
    axes.col(1) = shaft.cross(along).normalized();
    axes.col(0) = axes.col(1).cross(shaft);
    return {motion_.place_m + on_skin + height_m * normal, Eigen::Quaterniond(axes)};
  }

  // Down with open blades; close, open a little higher, go on to the next place; up.
  void snip(double last_m) {
    const double high = motion_.height_m, low = -motion_.depth_m;
    timed(motion_.press_s, [&](double t) { return at(0, high + smooth_step(t) * (low - high)); });
    for (int i = 0; i < motion_.snips; ++i) {
      const double here_m = motion_.snips > 1 ? last_m * i / (motion_.snips - 1) : 0;
      const double next_m = motion_.snips > 1 ? last_m * std::min(i + 1, motion_.snips - 1) / (motion_.snips - 1) : 0;
      timed(motion_.close_s, [&](double t) {
        opening_rad_ = (1 - smooth_step(t)) * motion_.open_rad;
        return at(here_m, low);
      });
      timed(motion_.lift_s, [&](double t) {
        opening_rad_ = smooth_step(t) * motion_.open_rad;
        return at(here_m, low + smooth_step(t) * (high - low));
      });
      if (i + 1 == motion_.snips) break;
      timed((next_m - here_m) / motion_.speed_m_per_s,
            [&](double t) { return at(here_m + t * (next_m - here_m), high); });
      timed(motion_.press_s, [&](double t) { return at(next_m, high + smooth_step(t) * (low - high)); });
    }
  }

  // The extra depth of a knife, which goes down in the middle of the stroke, on for a little, and up again.
  double sunk_m(double t) const {
    const double ramp = std::clamp((0.1 - std::abs(t - 0.55)) / 0.05, 0.0, 1.0);
    return motion_.sink_m * smooth_step(ramp);
  }

  void stroke(double last_m) {
    const double run_m = motion_.press_run_m, high = motion_.height_m, low = -motion_.depth_m;
    timed(motion_.press_s, [&](double t) { return at(t * run_m, high + smooth_step(t) * (low - high)); });
    timed((last_m - run_m) / motion_.speed_m_per_s,
          [&](double t) { return at(run_m + t * (last_m - run_m), low - sunk_m(t)); });
    timed(motion_.lift_s, [&](double t) { return at(last_m, low + smooth_step(t) * (high - low)); });
  }

  const Motion& motion_;
  ImplicitShape shape_;
  Path path_;
  std::vector<double> arc_m_;
  double length_m_ = 0;
};

class CarryWriter : Recorder {
 public:
  explicit CarryWriter(const Carry& carry) : Recorder(true), carry_(carry) {}

  std::string run() {
    const Vec3 outside(carry_.from_m.x(), carry_.from_m.y(), 0.1), inside(carry_.from_m.x(), carry_.from_m.y(), 0);
    const Vec3 skin = first_hit(carry_.shape, outside, inside), up = carry_.lift_m * Vec3::UnitZ();
    opening_rad_ = carry_.open_rad;
    hold(at(carry_.park_m), carry_.wait_s);
    travel(at(skin + up), 1.0, 0);
    travel(at(skin - carry_.depth_m * Vec3::UnitZ()), 0.8, 0);
    turn_jaws(0, 0.4);
    if (carry_.stay_s > 0) {
      travel(at(skin + 0.001 * Vec3::UnitZ()), 0.6, 0);
      hold(now_, carry_.stay_s);
    }
    if (!carry_.carries) {
      turn_jaws(carry_.open_rad, 0.4);
      travel(at(skin + up), 0.8, 0);
      return text_;
    }
    travel(at(skin + up), 1.2, 0);
    travel(at(carry_.to_m + up), 1.4, 0);
    travel(at(carry_.to_m), 1.0, 0);
    turn_jaws(carry_.open_rad, 0.4);
    travel(at(carry_.to_m + up), 0.8, 0);
    hold(now_, 0.4);
    return text_;
  }

 private:
  Pose at(const Vec3& tips_m) const {
    const double half_rad = carry_.turn_deg * M_PI / 360;
    return {tips_m, Eigen::Quaterniond(std::cos(half_rad), 0, 0, std::sin(half_rad))};
  }

  const Carry& carry_;
};

class SnipWriter : Recorder {
 public:
  explicit SnipWriter(const Snips& snips) : Recorder(true), snips_(snips) {}

  std::string run() {
    opening_rad_ = snips_.open_rad;
    hold(at(-snips_.back_m), 0.4);
    for (int i = 0; i < snips_.snips; ++i) {
      go_to(i * snips_.advance_m);
      turn_jaws(snips_.shut_rad, snips_.close_s);
      turn_jaws(snips_.open_rad, snips_.close_s);
    }
    go_to(-snips_.back_m);
    hold(now_, 0.4);
    return text_;
  }

 private:
  Pose at(double ahead_m) const {
    const Eigen::Quaterniond q(Eigen::AngleAxisd(snips_.ahead_deg * M_PI / 180, Vec3::UnitZ()));
    return {snips_.first_tips_world_m + ahead_m * (q * Vec3::UnitX()), q};
  }
  void go_to(double ahead_m) {
    const Pose to = at(ahead_m);
    travel(to, (to.position_m - now_.position_m).norm() / snips_.speed_m_per_s, 0);
  }

  const Snips& snips_;
};

bool write(const std::string& directory, const std::string& name, const std::string& text) {
  const std::string path = directory + "/" + name + ".csv";
  if (std::ofstream(path, std::ios::binary) << text) return true;
  std::cerr << path << ": not written\n";
  return false;
}

int run(int argc, char** argv) {
  std::string directory;
  Arguments arguments("make_traces", "writes the instruments' traces of the scenes");
  arguments.option("DIR", directory, "folder for the files", Need::required);
  if (!arguments.parse(argc, argv)) return 0;
  bool written = true;
  for (const Motion& motion : kMotions) written &= write(directory, motion.name, TraceWriter(motion).run());
  for (const Carry& carry : kCarries) written &= write(directory, carry.name, CarryWriter(carry).run());
  written &= write(directory, kSnips.name, SnipWriter(kSnips).run());
  for (const Passage& passage : passages()) written &= write(directory, passage.name, trace_of(passage));
  return written ? 0 : 1;
}

}  // namespace
}  // namespace sectio

int main(int argc, char** argv) {
  return sectio::run_program("make_traces", [&] { return sectio::run(argc, argv); });
}
