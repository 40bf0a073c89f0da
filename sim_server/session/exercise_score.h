// The score of an exercise (paper C, 4: a visible area of tissue to remove, and an object in which to place it): how
// much of the marked tissue is off the organ, what went with it, whether it is in the bin, and what the instruments
// did. Volumes are those at rest, so it makes no difference what model the organ has, or whether what came off is a
// body of its own, a component of one, or crumbs that were removed.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/material/region_volumes.h"
#include "sim_server/scene/scene.h"
#include "sim_server/simulation.h"

namespace sectio {

// A connected piece of tissue.
struct TissuePiece {
  std::string body;
  double marked_m3 = 0, healthy_m3 = 0;
  bool held_in_place = false;  // it has vertices that are fixed
  bool in_bin = false;         // all of it
};

// The pieces of one body.
std::vector<TissuePiece> tissue_pieces(const BodySpec& spec, const TriangleMesh& mesh,
                                       std::span<const Vec3f> positions_world_m, const Box& bin);

struct InstrumentUse {
  std::string name;
  double path_m = 0;  // of its tip
  double largest_force_n = 0;
  double contact_time_s = 0;
};

struct Score {
  std::string body;
  double marked_m3 = 0;          // at the beginning
  double marked_removed_m3 = 0;  // of it, no longer part of the organ
  double marked_in_bin_m3 = 0;
  double healthy_lost_m3 = 0;
  bool in_bin = false;  // everything marked that has come off; false when nothing has
  double time_s = 0;    // from the first touch to the last
  double largest_force_n = 0;
  std::vector<TissuePiece> removed;
  std::vector<InstrumentUse> instruments;
};

class ExerciseScore {
 public:
  // `scene` has an exercise; both arguments outlive the score.
  ExerciseScore(const Scene& scene, const Simulation& simulation);
  // After each step.
  void add(const StepOutput& output);
  // The score at this moment. The organ is the body that is held in place, or else the largest piece. O(all).
  Score finish() const;

 private:
  std::vector<TissuePiece> pieces() const;

  const Scene& scene_;
  const Simulation& simulation_;
  std::vector<std::uint32_t> family_;  // the organ and what came off it, by body_id
  double marked_m3_ = 0, healthy_m3_ = 0;
  std::vector<InstrumentUse> instruments_;
  std::vector<std::optional<Vec3>> tips_;
  std::optional<double> first_touch_s_;
  double last_touch_s_ = 0;
};

// For a person: a line each.
std::vector<std::string> to_lines(const Score& score);

}  // namespace sectio
