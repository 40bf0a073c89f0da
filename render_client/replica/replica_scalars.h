// The scalar fields of one body as a viewer has them. Pieces may come in any order and get lost; of each piece the
// newest holds.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "common/messages/state.h"

namespace sectio {

class ReplicaScalars {
 public:
  // A valid piece (common/messages/validate.h) of a body.
  void feed(ScalarPiece piece);

  // The topology is at this revision; changed_at names for each vertex slot the revision of its last change. Takes over
  // the values that were sent at the slot's revision or later; values for a newer topology wait. Fields without a name
  // in `names` are gone.
  void accept_pieces(std::uint64_t revision, std::span<const std::uint64_t> changed_at,
                     std::span<const std::string> names);

  // After accept_pieces(): one value a vertex slot; the least of the range where none has come yet.
  const std::vector<ScalarField>& fields() const { return fields_; }

 private:
  struct Arrived {
    std::map<std::uint32_t, ScalarPiece> waiting;   // by piece
    std::map<std::uint32_t, std::uint64_t> newest;  // step, by piece
  };

  std::size_t find_or_add(const ScalarPiece& piece);

  std::vector<ScalarField> fields_;
  std::vector<Arrived> arrived_;  // one a field
};

}  // namespace sectio
