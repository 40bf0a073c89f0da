// A body under its own weight, much finer than what a plan chooses from: what candidates are measured against.
//
// The reference is a lattice of hexahedra in as many tetrahedra as a body has at most, which end where it is held as
// those of candidates do. Displacements are those of small strains (deformation/sag.h), in reference and candidate
// alike, so that they differ by the discretisation, and by what a model is unable to do, alone. A coarse lattice, whose
// equilibrium is found for large strains, too, tells by how much more or less an error of stiffness moves the body
// there: a rod that hangs down moves less, one that stands and is about to bend aside moves more.
#pragma once

#include <memory>
#include <optional>
#include <span>

#include "sim_server/deformation/sag.h"
#include "sim_server/planning/body_shape.h"
#include "sim_server/scene/scene.h"

namespace sectio {

class WeighedBody {
 public:
  // Gravity in the body's frame. The body is held, and is filled from its surface by the lattice mesher.
  WeighedBody(const BodySpec& body, const planning::BodyShape& shape, const Vec3& gravity_body_m_per_s2);
  ~WeighedBody();

  // The error of a model that says how far its particles move: the root mean square of the difference over the tissue
  // that is free, relative to what the weight moves, or to planning::kSagThatMatters of the thickness where it moves
  // less. Nothing when one of them isn't known.
  std::optional<double> error_of(std::span<const SagPoint> candidate) const;

 private:
  class Field;
  std::unique_ptr<Field> reference_;  // none: the body can't be weighed
  double floor_m_ = 0;
  double amplification_ = 1;
};

}  // namespace sectio
