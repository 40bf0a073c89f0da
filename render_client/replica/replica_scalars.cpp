#include "render_client/replica/replica_scalars.h"

#include <algorithm>

namespace sectio {

// The number of fields when there is no room for another.
std::size_t ReplicaScalars::find_or_add(const ScalarPiece& piece) {
  const auto known = std::ranges::find(fields_, piece.name, &ScalarField::name);
  const auto index = static_cast<std::size_t>(known - fields_.begin());
  if (known == fields_.end() && fields_.size() < kMaxScalars) {
    fields_.push_back({piece.name, piece.least, piece.most, {}});
    arrived_.emplace_back();
  }
  return index;
}

void ReplicaScalars::feed(ScalarPiece piece) {
  const std::size_t index = find_or_add(piece);
  if (index == fields_.size()) return;
  Arrived& arrived = arrived_[index];
  const auto [newest, is_new] = arrived.newest.try_emplace(piece.piece, piece.step);
  if (!is_new && piece.step <= newest->second) return;
  newest->second = piece.step;
  arrived.waiting.insert_or_assign(piece.piece, std::move(piece));
}

void ReplicaScalars::accept_pieces(std::uint64_t revision, std::span<const std::uint64_t> changed_at,
                                   std::span<const std::string> names) {
  for (std::size_t i = fields_.size(); i-- > 0;) {
    if (std::ranges::find(names, fields_[i].name) != names.end()) continue;
    fields_.erase(fields_.begin() + static_cast<std::ptrdiff_t>(i));
    arrived_.erase(arrived_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    ScalarField& field = fields_[i];
    field.values.resize(changed_at.size(), field.least);
    std::erase_if(arrived_[i].waiting, [&](const auto& entry) {
      const ScalarPiece& piece = entry.second;
      if (piece.revision > revision) return false;
      field.least = piece.least;
      field.most = piece.most;
      for (std::size_t k = 0; k < piece.levels.size(); ++k) {
        const std::size_t v = std::size_t{piece.piece} * kVerticesPerPiece + k;
        if (v < changed_at.size() && piece.revision >= changed_at[v])
          field.values[v] = from_level(piece.levels[k], piece.least, piece.most);
      }
      return true;
    });
  }
}

}  // namespace sectio
