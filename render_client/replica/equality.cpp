#include "render_client/replica/equality.h"

namespace sectio {

void Equality::compare(const World& world) {
  for (const auto& [epoch, server] : server_) {
    const Replica* replica = world.replica_of(epoch);
    if (!replica) continue;
    for (std::size_t b = 0; b < replica->bodies().size() && b < server.size(); ++b) {
      const ReplicaBody& body = replica->bodies()[b];
      if (!body.known() || body.mesh().revision() != server[b].revision) continue;
      compared_[{epoch, b}] = {body.mesh().hash() == server[b].topology_hash, server[b].revision};
    }
  }
}

std::vector<Equality::OfBody> Equality::of_bodies(const World& world) const {
  std::vector<OfBody> all;
  for (const auto& [epoch, body_count] : world.body_counts())
    for (std::size_t b = 0; b < body_count; ++b) {
      const auto known = compared_.find({epoch, b});
      all.push_back(known == compared_.end() ? OfBody{} : known->second);
    }
  return all;
}

}  // namespace sectio
