// An isotropic elastic material: what every model of tissue begins with.
#pragma once

namespace sectio {

struct ElasticMaterial {
  double young_pa = 6000;
  double poisson = 0.45;
  double density_kg_per_m3 = 1060;
};

}  // namespace sectio
