// The stress beneath a contact that is smaller than the elements is not resolved, and the surface between vertices is
// too stiff. A layer of tissue in series with a sample of the surface, as deep as a share of an element, gives way by
// as much; it vanishes as meshes get finer.
#pragma once

#include <algorithm>

#include "common/material/regions.h"
#include "sim_server/deformation/point_constraint.h"
#include "sim_server/world/body.h"

namespace sectio {

class ContactLayer {
 public:
  // It is no deeper than that, and gives way by no more.
  ContactLayer(const Body& body, double deepest_m) : body_(body), deepest_m_(deepest_m) {
    const MaterialSpec& m = body.spec.material;
    const double e_star_pa = m.young_pa / (1 - m.poisson * m.poisson);
    m_per_pa_ = std::min(deepest_m, body.engines.deformation->layer_m()) / e_star_pa;
    varies_ = vary_in_stiffness(body.spec.regions);
  }
  // Beneath a sample that a constraint holds.
  void put_under(PointConstraint& c, double area_rest_m2) const {
    c.gives_most_m = deepest_m_;
    c.compliance_m_per_n = m_per_pa_ / area_rest_m2;
    if (varies_) c.compliance_m_per_n /= stiffness_factor_at(body_.spec.regions, body_.mesh.rest_body_m(c.v[0]));
  }

 private:
  const Body& body_;
  double deepest_m_, m_per_pa_ = 0;
  bool varies_ = false;
};

}  // namespace sectio
