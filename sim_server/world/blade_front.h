// The force on a blade in tissue. It sticks to the front of its cut like a spring, which yields at the toughness of the
// tissue times the length of its edge at the front: with b from the front to the edge, n across the edge towards its
// sharp side, and L that length,
//
//   F = -J L b / d,  |b| <= d (n.b) / |b|,  d = max(kYields_m, J L / kStiffest)
//
// Beyond that the front goes on along b, whose work is then J times the area that it cuts, exactly; an edge that is
// drawn along itself cuts at less force (slice and push: Atkins et al. 2004). A blade that goes back leaves its front
// without a force, and meets it again where it was (swept_tissue.h). A front that comes into an earlier cut, as that of
// a hand that trembles does again and again, lets go over kEbbs_s rather than at once; one that comes out of it again
// begins with the force at hand. Either way, tissue that gives way is cut for nothing.
#pragma once

#include <optional>

#include "sim_server/world/swept_tissue.h"

namespace sectio {

class BladeFront {
 public:
  static constexpr double kYields_m = 5e-4, kStiffest_n_per_m = 1400;  // a hand's device can render these
  static constexpr double kEbbs_s = 0.008;                             // by an eighth of the force in a millisecond

  // Nothing holds the blade any more; what has been cut stays so.
  void release() { *this = {}; }
  void begin_step(double step_s);
  // The edge was here, in the frame of the next move(); it has not moved.
  void is_at(const EdgeAtRest& edge) {
    if (edge_) edge_ = edge;
  }
  // The edge is here now. `sharp_side`: unit; none: it cuts in any direction.
  void move(SweptTissue& tissue, const EdgeAtRest& edge, const std::optional<Vec3>& sharp_side,
            double toughness_j_per_m2);

  // All in the frame of the body at rest.
  const Vec3& force_n() const { return force_n_; }
  const Vec3& ahead() const { return ahead_; }       // n
  double strength_n() const { return strength_n_; }  // J L: the front yields here; 0: nothing holds the edge
  double stiffness_n_per_m() const;
  double work_j() const { return work_j_; }        // work by the hand in the last move()
  double new_area_m2() const { return area_m2_; }  // area that has been cut since release()

  template <class A>
  void archive(A& a) {
    a(edge_, way_, stretched_m_, force_n_, ahead_, middle_, strength_n_, least_n_, most_n_, gives_way_, ebbs_, met_,
      work_j_, area_m2_);
  }

 private:
  void give_way(SweptTissue& tissue, const EdgeAtRest& edge, double share);
  void advance(SweptTissue& tissue, const EdgeAtRest& edge, const std::optional<Vec3>& sharp_side,
               double toughness_j_per_m2);

  std::optional<EdgeAtRest> edge_;
  std::optional<SweptTissue::Way> way_;
  Vec3 stretched_m_ = Vec3::Zero();  // b
  Vec3 force_n_ = Vec3::Zero(), ahead_ = Vec3::Zero();
  double middle_ = 0.5;  // middle of the part of the edge in tissue
  double strength_n_ = 0, work_j_ = 0, area_m2_ = 0;
  // A front that has been lost has no less strength before the next step, and no more force; then it gives way by this
  // share of what it is stretched.
  double least_n_ = 0, most_n_ = 0, gives_way_ = 0;
  bool ebbs_ = false;  // the tissue at the anchor holds less than least_n_
  bool met_ = false;   // in this step
};

}  // namespace sectio
