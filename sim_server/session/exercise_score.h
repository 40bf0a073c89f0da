// The score of an exercise (paper C, 4: a visible area of tissue to remove, and an object in which to place it): how
// much of the marked tissue is off the organ, what went with it, whether it is in the bin, and what the instruments
// did. Volumes are those at rest, so it makes no difference what model the organ has, or whether what came off is a
// body of its own, a component of one, or crumbs that were removed.
#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/material/region_volumes.h"
#include "common/math/positions_view.h"
#include "sim_server/scene/scene.h"
#include "sim_server/session/tremor_gauge.h"
#include "sim_server/simulation.h"

namespace sectio {

// A connected piece of tissue.
struct TissuePiece {
  std::string body;
  double marked_m3 = 0, healthy_m3 = 0;
  bool held_in_place = false;  // it has vertices that are fixed
  bool in_bin = false;         // all of it
};

struct InstrumentUse {
  std::string name;
  double path_m = 0;  // path of its tip, from its first touch to its last
  double largest_force_n = 0;
  double contact_time_s = 0;

  template <class A>
  void archive(A& a) {
    a(name, path_m, largest_force_n, contact_time_s);
  }
};

// A cut along a line. The blade's place is where a line from the lower end of its edge, along the tool's z axis, passes
// nearest to the line on the body; from there it is deep. The edge of scissors is where their blades cross.
struct LineScore {
  double length_m = 0;
  double cut_fraction = 0;  // share of the line cut near enough, and half as deep as it should be
  double deviation_m = 0;   // root mean square, over the way that was cut; the whole length when nothing was
  double most_deviation_m = 0;
  double depth_m = 0;   // the deepest of all passages at a place, mean over the places of the line that were reached
  double astray_m = 0;  // length of the cut that is further from the line than the tolerance
  double tremor_m = 0;  // the hand that trembles most (tremor_gauge.h)
  // The largest deviation in each of equal parts of the line, at most kLineParts; nothing where no blade was.
  std::vector<std::optional<double>> beside_m;

  bool has_cuts() const {
    return std::ranges::any_of(beside_m, [](const auto& part) { return part.has_value(); });
  }
};
constexpr std::size_t kLineParts = 40;

struct Score {
  std::string body;
  std::optional<LineScore> line;
  std::optional<std::size_t> spared_touches;  // times that an instrument began to touch a body that it should spare
  double marked_m3 = 0;                       // at the beginning
  double marked_removed_m3 = 0;               // marked tissue no longer part of the organ
  double marked_in_bin_m3 = 0;
  double healthy_lost_m3 = 0;
  bool has_bin = false;
  bool in_bin = false;  // everything marked that has come off; false when nothing has
  double time_s = 0;    // from the first touch to the last
  double largest_force_n = 0;
  std::vector<TissuePiece> removed;
  std::vector<InstrumentUse> instruments;
};

// Follows blades along the line of an exercise.
class LineWatch {
 public:
  LineWatch() = default;
  LineWatch(const LineSpec& line, const Pose& body_pose_world);
  // A blade that is in the tissue: the end of its edge, and which way its shaft goes; `way_m`: of this end since the
  // last step.
  void add(const Vec3& tip_world_m, const Vec3& shaft_world, double way_m);
  LineScore finish() const;

  template <class A>
  void archive(A& a) {
    a(depth_wanted_m_, within_m_, pitch_m_, points_, way_m_, square_m3_, most_m_, astray_m_);
  }

 private:
  struct Point {
    Vec3 at_world_m, along_world;
    bool is_cut = false;
    double depth_m = 0;              // the deepest passage near enough
    std::optional<double> beside_m;  // the largest deviation of blades that were nearest to it

    template <class A>
    void archive(A& a) {
      a(at_world_m, along_world, is_cut, depth_m, beside_m);
    }
  };

  double depth_wanted_m_ = 0, within_m_ = 0, pitch_m_ = 0;
  std::vector<Point> points_;  // about a millimetre apart; each stands for half of the way to its neighbours
  double way_m_ = 0, square_m3_ = 0, most_m_ = 0, astray_m_ = 0;
};

class ExerciseScore {
 public:
  // `scene` has an exercise; both arguments outlive the score.
  ExerciseScore(const Scene& scene, const Simulation& simulation);
  // After each step.
  void add(const StepOutput& output);
  // The score at this moment. The organ is the body that is held in place, or else the largest piece. O(all).
  Score finish() const;

  template <class A>
  void archive(A& a) {
    a(family_, marked_m3_, healthy_m3_, instruments_, line_, tremors_, untouched_m_, tips_, edges_, spared_touches_,
      first_touch_s_, last_touch_s_);
  }

 private:
  std::vector<TissuePiece> pieces() const;
  std::vector<TissuePiece> pieces_of(std::uint32_t body_id) const;

  // Volumes of the pieces of a body, in the order of their components, as long as its mesh has this revision.
  struct Weighed {
    std::optional<std::uint64_t> revision;
    std::vector<RegionVolumes> pieces;
  };
  mutable std::map<std::uint32_t, Weighed> weighed_;  // by body

  const Scene& scene_;
  const Simulation& simulation_;
  std::vector<std::uint32_t> family_;  // the organ and what came off it, by body_id
  double marked_m3_ = 0, healthy_m3_ = 0;
  std::vector<InstrumentUse> instruments_;
  std::optional<LineWatch> line_;
  std::vector<TremorGauge> tremors_;               // by tool
  std::vector<double> untouched_m_;                // by tool: the path of its tip since its last touch
  std::vector<std::optional<Vec3>> tips_, edges_;  // by tool: A, and the lower end of what cuts
  std::optional<std::size_t> spared_touches_;
  std::optional<double> first_touch_s_;
  double last_touch_s_ = 0;
};

// For a person: a line each.
std::vector<std::string> to_lines(const Score& score);

}  // namespace sectio
