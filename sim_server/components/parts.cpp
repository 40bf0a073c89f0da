#include "sim_server/components/parts.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

#include "common/core/sort_unique.h"

namespace sectio {
namespace {

// One search. Searches that have met are merged into one.
struct Search {
  std::uint32_t joined_to = kNone;
  std::vector<std::uint32_t> seen;
  std::vector<std::uint32_t> open;  // the queue, which begins at `next`
  std::size_t next = 0;

  bool exhausted() const { return next == open.size(); }
  std::size_t size() const { return seen.size() + open.size() - next; }
};

class Searches {
 public:
  Searches(std::span<const std::uint32_t> seeds, const Neighbours& neighbours)
      : neighbours_(neighbours), seeds_(seeds) {
    searches_.resize(seeds.size());
    for (std::uint32_t i = 0; i < seeds.size(); ++i) {
      owner_.emplace(seeds[i], i);
      searches_[i].seen.push_back(seeds[i]);
      searches_[i].open.push_back(seeds[i]);
    }
  }

  // Merges seeds that are neighbours, then advances each search in turn until at most one is unfinished.
  void run() {
    std::vector<std::uint32_t> going;
    for (std::uint32_t i = 0; i < searches_.size(); ++i) {
      for (const std::uint32_t n : neighbours_of(seeds_[i]))
        if (const auto it = owner_.find(n); it != owner_.end()) join(i, it->second);
    }
    for (std::uint32_t i = 0; i < searches_.size(); ++i)
      if (searches_[i].joined_to == kNone) going.push_back(i);
    while (going.size() > 1) {
      for (const std::uint32_t i : going)
        if (searches_[i].joined_to == kNone && !searches_[i].exhausted()) expand(i);
      std::erase_if(going,
                    [&](std::uint32_t i) { return searches_[i].joined_to != kNone || searches_[i].exhausted(); });
    }
  }

  // The searches that ran out of neighbours; when all did, the largest is the rest.
  std::vector<std::vector<std::uint32_t>> parts(std::uint32_t& rest) {
    std::vector<std::uint32_t> roots;
    for (std::uint32_t i = 0; i < searches_.size(); ++i)
      if (searches_[i].joined_to == kNone) roots.push_back(i);
    const auto larger = [&](std::uint32_t a, std::uint32_t b) {
      const Search &x = searches_[a], &y = searches_[b];
      if (x.exhausted() != y.exhausted()) return y.exhausted();
      return x.seen.size() > y.seen.size();
    };
    const auto keeps = std::min_element(roots.begin(), roots.end(), larger);
    std::vector<std::vector<std::uint32_t>> result;
    for (const std::uint32_t i : roots) {
      if (i == *keeps)
        rest = searches_[i].seen.front();
      else
        result.push_back(std::move(searches_[i].seen));
    }
    return result;
  }

  std::uint64_t visited() const { return owner_.size(); }

 private:
  std::uint32_t root(std::uint32_t i) {
    while (searches_[i].joined_to != kNone) {
      const std::uint32_t up = searches_[i].joined_to;
      if (searches_[up].joined_to != kNone) searches_[i].joined_to = searches_[up].joined_to;
      i = up;
    }
    return i;
  }

  // Pours the smaller search into the larger. Returns the one that is left.
  std::uint32_t join(std::uint32_t a, std::uint32_t b) {
    a = root(a), b = root(b);
    if (a == b) return a;
    if (searches_[a].size() < searches_[b].size()) std::swap(a, b);
    Search &into = searches_[a], &from = searches_[b];
    into.seen.insert(into.seen.end(), from.seen.begin(), from.seen.end());
    into.open.insert(into.open.end(), from.open.begin() + static_cast<std::ptrdiff_t>(from.next), from.open.end());
    from = Search{a, {}, {}, 0};
    return a;
  }

  void expand(std::uint32_t i) {
    const std::uint32_t t = searches_[i].open[searches_[i].next++];
    for (const std::uint32_t n : neighbours_of(t)) {
      const auto [it, is_new] = owner_.emplace(n, i);
      if (is_new) {
        searches_[i].seen.push_back(n);
        searches_[i].open.push_back(n);
      } else {
        i = join(i, it->second);
      }
    }
  }

  std::span<const std::uint32_t> neighbours_of(std::uint32_t t) {
    around_.clear();
    neighbours_(t, around_);
    return around_;
  }

  const Neighbours& neighbours_;
  std::vector<std::uint32_t> around_;
  std::span<const std::uint32_t> seeds_;
  std::vector<Search> searches_;
  std::unordered_map<std::uint32_t, std::uint32_t> owner_;  // never iterated, as its order isn't defined
};

Part part_of(const TriangleMesh& mesh, std::vector<TriangleId> triangles) {
  Part part;
  part.triangles = std::move(triangles);
  std::sort(part.triangles.begin(), part.triangles.end());
  part.vertices.reserve(3 * part.triangles.size());
  for (const TriangleId t : part.triangles)
    part.vertices.insert(part.vertices.end(), mesh.triangle(t).v.begin(), mesh.triangle(t).v.end());
  sort_unique(part.vertices);
  return part;
}

}  // namespace

Separated separated(std::span<const std::uint32_t> seeds, const Neighbours& neighbours) {
  Separated result;
  if (seeds.empty()) return result;
  Searches searches(seeds, neighbours);
  searches.run();
  result.parts = searches.parts(result.rest);
  result.visited = searches.visited();
  return result;
}

PartSearch separated_parts(const TriangleMesh& mesh, std::span<const TriangleId> changed) {
  std::vector<TriangleId> seeds;
  for (const TriangleId t : changed)
    if (t < mesh.triangle_slots() && mesh.triangle(t).alive()) seeds.push_back(t);
  sort_unique(seeds);
  Separated found = separated(seeds, [&](TriangleId t, std::vector<std::uint32_t>& neighbours) {
    neighbours.insert(neighbours.end(), mesh.neighbours(t).begin(), mesh.neighbours(t).end());
  });
  PartSearch result;
  result.rest = found.rest;
  result.visited = found.visited;
  for (std::vector<TriangleId>& triangles : found.parts) result.parts.push_back(part_of(mesh, std::move(triangles)));
  return result;
}

Part part_at(const TriangleMesh& mesh, TriangleId triangle) {
  std::vector<TriangleId> order{triangle};
  std::vector<bool> seen(mesh.triangle_slots(), false);
  seen[triangle] = true;
  for (std::size_t k = 0; k < order.size(); ++k)
    for (const TriangleId n : mesh.neighbours(order[k]))
      if (!seen[n]) {
        seen[n] = true;
        order.push_back(n);
      }
  return part_of(mesh, std::move(order));
}

}  // namespace sectio
