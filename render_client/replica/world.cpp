#include "render_client/replica/world.h"

#include <algorithm>
#include <utility>

#include "common/messages/epoch.h"

namespace sectio {

namespace {

bool collide(const SceneInfo& a, const SceneInfo& b) {
  return a.world_bodies != b.world_bodies || overlap(a, b);
}

// The index of the server's first body in the scene.
std::size_t place_of(const SceneInfo& scene) {
  if (scene.bodies.empty()) return scene.world_bodies.size();
  const auto at = std::ranges::find(scene.world_bodies, scene.bodies.front().name);
  return static_cast<std::size_t>(at - scene.world_bodies.begin());
}

// Copies the topology only where it differs.
void copy(const BodyFrame& from, BodyFrame& to) {
  const bool same = to.name == from.name && to.revision == from.revision &&
                    to.triangles.size() == from.triangles.size() && to.rest_body_m.size() == from.rest_body_m.size();
  if (!same) {
    to = from;
    return;
  }
  to.positions_world_m = from.positions_world_m;
  to.scalars = from.scalars;
}

}  // namespace

World::Server* World::find(std::uint64_t epoch) const {
  for (const Servers* list : {&servers_, &claimants_})
    for (const auto& server : *list)
      if (server->epoch() == epoch) return server.get();
  return nullptr;
}

bool World::shows(std::uint64_t epoch) const {
  return std::ranges::any_of(servers_, [&](const auto& server) { return server->epoch() == epoch; });
}

void World::adopt(Server& server, const SceneInfo& scene) {
  server.former_epoch = server.epoch();
  server.of_former = {};
  server.replica.adopt(scene);
  server.pull = {};
  server.end.reset();
  server.hearing.fresh = true;  // its silence begins now
}

// The server that has claimed the session says nothing, while the former one speaks.
void World::give_back(Server& server, double now_s) {
  if (!server.of_former.is_silent(now_s) && !server.end && server.is_silent(now_s)) {
    SceneInfo scene = *server.replica.scene();
    scene.epoch = server.former_epoch;
    adopt(server, scene);
  }
}

// True when the scene is that of a session that is known, in another term: it goes on, or the message is a ghost.
bool World::hand_over(const SceneInfo& scene) {
  for (const Servers* list : {&servers_, &claimants_})
    for (const auto& server : *list) {
      if (!same_session(server->epoch(), scene.epoch)) continue;
      if (!takes_over(scene.epoch, server->epoch())) return true;
      adopt(*server, scene);
      return true;
    }
  return false;
}

void World::announce(const SceneInfo& scene) {
  if (Server* known = find(scene.epoch)) {
    known->replica.extend(scene);
    if (known->end) known->replica.feed(*known->end);  // it may have come before the bodies that it names
    return;
  }
  if (hand_over(scene)) return;
  const bool taken =
      std::ranges::any_of(servers_, [&](const auto& server) { return collide(*server->replica.scene(), scene); });
  auto server = std::make_unique<Server>();
  server->replica.reset(scene);
  if (const auto end = early_ends_.find(scene.epoch); end != early_ends_.end()) {
    server->end = end->second;
    server->replica.feed(end->second);
  }
  if (!taken && servers_.size() < kMaxServers) return show(std::move(server));
  add_claimant(std::move(server));
}

void World::add_claimant(std::unique_ptr<Server> server) {
  claimants_.push_back(std::move(server));
  if (claimants_.size() > kMaxServers) claimants_.erase(claimants_.begin());
}

void World::show(std::unique_ptr<Server> server) {
  const SceneInfo& scene = *server->replica.scene();
  const auto others = std::stable_partition(
      servers_.begin(), servers_.end(), [&](const auto& other) { return !collide(*other->replica.scene(), scene); });
  for (auto other = others; other != servers_.end(); ++other) {
    (*other)->drawn = false;
    add_claimant(std::move(*other));
  }
  servers_.erase(others, servers_.end());
  const auto at = std::ranges::find_if(
      servers_, [&](const auto& other) { return place_of(*other->replica.scene()) > place_of(scene); });
  servers_.insert(at, std::move(server));
  changed_ = true;
}

void World::feed(DeltaMessage message) {
  if (Server* server = find(message.epoch)) server->replica.feed(std::move(message));
}

void World::feed(KeyframeChunk chunk) {
  Server* server = find(chunk.epoch);
  if (!server || chunk.body_id >= server->replica.bodies().size()) return;
  const ReplicaBody& body = server->replica.bodies()[chunk.body_id];
  if (body.known() && chunk.revision <= body.mesh().revision()) return;  // for another viewer
  const std::uint64_t epoch = chunk.epoch;
  const std::uint32_t body_id = chunk.body_id;
  if (const auto bytes = server->pull.add(std::move(chunk))) server->replica.feed_keyframe(epoch, body_id, *bytes);
}

void World::feed(StateHeader header) {
  if (Server* server = find(header.epoch)) {
    server->hearing.fresh = true;
    server->replica.feed(std::move(header));
    return;
  }
  for (const auto& server : servers_)
    if (server->former_epoch == header.epoch) server->of_former.fresh = true;
}

void World::feed(StatePiece piece) {
  if (Server* server = find(piece.epoch)) server->replica.feed(std::move(piece));
}

void World::feed(ScalarPiece piece) {
  if (Server* server = find(piece.epoch)) server->replica.feed(std::move(piece));
}

void World::feed(const SessionEnd& end) {
  Server* server = find(end.epoch);
  if (!server) {
    early_ends_.insert_or_assign(end.epoch, end);
    if (early_ends_.size() > kMaxServers) early_ends_.erase(early_ends_.begin());
    return;
  }
  server->replica.feed(end);
  server->end = end;
}

bool World::gathered(double now_s) {
  if (begun_ || servers_.empty()) return begun_;
  if (!first_seen_s_) first_seen_s_ = now_s;
  std::vector<std::string> missing = servers_.front()->replica.scene()->world_bodies;
  for (const auto& server : servers_)
    for (const BodyInfo& body : server->replica.scene()->bodies)
      if (server->drawn) std::erase(missing, body.name);
  begun_ = missing.empty() || now_s - *first_seen_s_ > kGather_s;
  return begun_;
}

void World::promote_claimants(double now_s) {
  for (const auto& claimant : claimants_)
    if (claimant->replica.frame(now_s, claimant->frame)) claimant->drawn = true;
  const auto may_take_over = [&](const auto& claimant) {
    if (!claimant->drawn || (!claimant->end && claimant->is_silent(now_s))) return false;
    return std::ranges::all_of(servers_, [&](const auto& server) {
      return server->end || server->is_silent(now_s) || !collide(*server->replica.scene(), *claimant->replica.scene());
    });
  };
  while (true) {
    const auto at = std::ranges::find_if(claimants_, may_take_over);
    if (at == claimants_.end()) return;
    std::unique_ptr<Server> owner = std::move(*at);
    claimants_.erase(at);
    fresh_ = true;
    show(std::move(owner));
  }
}

bool World::frame(double now_s, Frame& frame) {
  for (const Servers* list : {&servers_, &claimants_})
    for (const auto& server : *list) {
      server->known_s = std::min(server->known_s, now_s);
      server->hearing.look(now_s);
      server->of_status.look(now_s);
      server->of_former.look(now_s);
    }
  for (const auto& server : servers_) give_back(*server, now_s);
  promote_claimants(now_s);
  for (const auto& server : servers_) {
    const bool is_new = server->replica.frame(now_s, server->frame);
    server->drawn |= is_new;
    fresh_ |= is_new;
  }
  if (!fresh_ || !gathered(now_s)) return false;
  fresh_ = false;
  merge(now_s, frame);
  return true;
}

void World::merge(double now_s, Frame& frame) {
  if (std::exchange(changed_, false)) {
    frame.bodies.clear();
    ++arrangement_;
  }
  frame.arrangement = arrangement_;
  // Time and instruments are those of a server that lives; one that is dead may have come further.
  const auto is_newer = [&](const Server& server, const Server& other) {
    const bool speaks = server.speaks(now_s);
    return speaks != other.speaks(now_s) ? speaks : server.frame.sim_time_s > other.frame.sim_time_s;
  };
  const Server* newest = nullptr;
  std::size_t count = 0;
  bool in_contact = false;
  for (const auto& server : servers_) {
    if (!server->drawn) continue;
    if (!newest || is_newer(*server, *newest)) newest = server.get();
    in_contact |= server->frame.in_contact;
    frame.bodies.resize(std::max(frame.bodies.size(), count + server->frame.bodies.size()));
    for (const BodyFrame& body : server->frame.bodies) copy(body, frame.bodies[count++]);
  }
  frame.bodies.resize(count);
  frame.session = newest->frame.session;
  frame.step = newest->frame.step;
  frame.sim_time_s = newest->frame.sim_time_s;
  frame.step_wall_time_s = newest->frame.step_wall_time_s;
  frame.camera = newest->frame.camera;
  frame.floor_z_m = newest->frame.floor_z_m;
  frame.gravity_m_per_s2 = newest->frame.gravity_m_per_s2;
  frame.tools = newest->frame.tools;
  frame.in_contact = in_contact;
}

std::vector<KeyframeRequest> World::take_requests(double now_s) {
  std::vector<KeyframeRequest> requests;
  for (const Servers* list : {&servers_, &claimants_})
    for (const auto& server : *list) {
      const std::vector<KeyframeRequest> some = keyframe_requests(server->replica, server->pull, now_s);
      requests.insert(requests.end(), some.begin(), some.end());
    }
  return requests;
}

double World::servers_apart_s() const {
  double first_s = 1e300, last_s = -1e300;
  for (const auto& server : servers_) {
    if (!server->drawn || server->end) return 0;
    first_s = std::min(first_s, server->frame.sim_time_s);
    last_s = std::max(last_s, server->frame.sim_time_s);
  }
  return std::max(0.0, last_s - first_s);
}

const Replica* World::replica_of(std::uint64_t epoch) const {
  const Server* server = find(epoch);
  return server ? &server->replica : nullptr;
}

std::vector<std::pair<std::uint64_t, std::size_t>> World::body_counts() const {
  std::vector<std::pair<std::uint64_t, std::size_t>> counts;
  for (const auto& server : servers_) counts.emplace_back(server->epoch(), server->replica.bodies().size());
  return counts;
}

std::vector<const ReplicaBody*> World::bodies() const {
  std::vector<const ReplicaBody*> result;
  for (const auto& server : servers_)
    for (const ReplicaBody& body : server->replica.bodies()) result.push_back(&body);
  return result;
}

std::vector<std::string> World::body_names() const {
  std::vector<std::string> names;
  for (const auto& server : servers_)
    for (const BodyInfo& body : server->replica.scene()->bodies) names.push_back(body.name);
  return names;
}

std::vector<BodyVersion> World::catch_up() {
  std::vector<BodyVersion> versions;
  for (const auto& server : servers_) {
    const std::vector<BodyVersion> some = server->replica.catch_up();
    versions.insert(versions.end(), some.begin(), some.end());
  }
  return versions;
}

void World::feed(const ServerStatus& status) {
  if (Server* server = find(status.epoch)) server->of_status.fresh = true;
}

bool World::has_ended(std::uint64_t epoch) const {
  const Server* server = find(epoch);
  return server && server->end;
}

std::string World::left_by(double now_s) const {
  bool any_ended = false;
  std::string silent;
  for (const auto& server : servers_) {
    any_ended |= server->end.has_value();
    if (server->end) continue;
    if (now_s - server->last_word_s() < kGone_s) return {};
    for (const BodyInfo& body : server->replica.scene()->bodies) silent += (silent.empty() ? "" : ", ") + body.name;
  }
  return any_ended ? silent : std::string();
}

std::optional<SessionEnd> World::session_end() const {
  if (servers_.empty()) return std::nullopt;
  SessionEnd all;
  for (const auto& server : servers_) {
    if (!server->end || server->end->bodies.size() != server->replica.bodies().size()) return std::nullopt;
    all.epoch = std::max(all.epoch, server->epoch());
    all.step = std::max(all.step, server->end->step);
    if (all.reason.empty()) all.reason = server->end->reason;
    all.bodies.insert(all.bodies.end(), server->end->bodies.begin(), server->end->bodies.end());
  }
  return all;
}

bool World::knows_all_bodies() const {
  return std::ranges::all_of(bodies(), [](const ReplicaBody* body) { return body->known(); });
}

std::size_t World::pulled_bytes() const {
  std::size_t sum = 0;
  for (const auto& server : servers_) sum += server->pull.bytes();
  return sum;
}

ReplicaCounts World::counts() const {
  ReplicaCounts sum;
  for (const auto& server : servers_) {
    const ReplicaCounts& c = server->replica.counts();
    sum.deltas_applied += c.deltas_applied;
    sum.deltas_dropped += c.deltas_dropped;
    sum.hash_mismatches += c.hash_mismatches;
    sum.resyncs += c.resyncs;
    sum.requests += c.requests;
    sum.frames += c.frames;
    sum.patched_frames += c.patched_frames;
  }
  return sum;
}

std::size_t World::bytes() const {
  std::size_t sum = 0;
  for (const ReplicaBody* body : bodies()) sum += body->bytes();
  return sum;
}

}  // namespace sectio
