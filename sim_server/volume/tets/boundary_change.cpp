#include "sim_server/volume/tets/boundary_change.h"

#include <algorithm>
#include <bit>

namespace sectio {
namespace {

using Corners3 = std::array<VertexId, 3>;

struct Face {
  Corners3 key;            // ascending
  Corners3 before, after;  // oriented as in its last tetrahedron
  std::uint8_t owners_before = 0, owners_after = 0;
};

// Faces by their corners, in the order of insertion.
class FaceTable {
 public:
  explicit FaceTable(std::size_t most) : place_(std::bit_ceil(2 * most + 1), kNone) { faces_.reserve(most); }

  Face& at(const Corners3& corners) {
    Corners3 key = corners;
    if (key[0] > key[1]) std::swap(key[0], key[1]);
    if (key[1] > key[2]) std::swap(key[1], key[2]);
    if (key[0] > key[1]) std::swap(key[0], key[1]);
    std::uint64_t hash = (std::uint64_t{key[0]} << 32 | key[1]) * 0x9e3779b97f4a7c15u ^ key[2] * 0xc2b2ae3d27d4eb4fu;
    hash ^= hash >> 29;
    for (std::size_t slot = hash & (place_.size() - 1);; slot = (slot + 1) & (place_.size() - 1)) {
      if (place_[slot] == kNone) {
        place_[slot] = static_cast<std::uint32_t>(faces_.size());
        faces_.push_back({key, {}, {}});
        return faces_.back();
      }
      Face& face = faces_[place_[slot]];
      if (face.key[0] == key[0] && face.key[1] == key[1] && face.key[2] == key[2]) return face;
    }
  }
  std::span<const Face> all() const { return faces_; }

 private:
  std::vector<std::uint32_t> place_;
  std::vector<Face> faces_;
};

template <class F>
void each_face(const Tetrahedron& t, const F& f) {
  if (t == kNoTetrahedron) return;
  for (const auto& [i, j, k] : kTetFaces) f(Corners3{t[i], t[j], t[k]});
}

}  // namespace

BoundaryChange boundary_change(std::span<const TetEdit> edits) {
  FaceTable faces(8 * edits.size());
  for (const TetEdit& e : edits) {
    each_face(e.before, [&](const Corners3& corners) {
      Face& face = faces.at(corners);
      face.before = corners;
      ++face.owners_before;
    });
    each_face(e.after, [&](const Corners3& corners) {
      Face& face = faces.at(corners);
      face.after = corners;
      ++face.owners_after;
    });
  }
  BoundaryChange change;
  for (const Face& face : faces.all()) {
    if (face.owners_before == 1 && face.owners_after != 1) change.removed.push_back(face.before);
    if (face.owners_after == 1 && face.owners_before != 1) change.added.push_back(face.after);
  }
  return change;
}

}  // namespace sectio
