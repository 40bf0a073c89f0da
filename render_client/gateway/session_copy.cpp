#include "render_client/gateway/session_copy.h"

#include <algorithm>
#include <utility>

#include "common/delta/keyframe.h"
#include "common/messages/epoch.h"

namespace sectio {

void SessionCopy::announce(const SceneInfo& scene) {
  const auto before =
      std::ranges::find_if(servers_, [&](const auto& each) { return same_session(each.first, scene.epoch); });
  if (before != servers_.end() && before->first > scene.epoch) return;  // a ghost
  if (before != servers_.end() && before->first < scene.epoch) {
    auto server = servers_.extract(before);
    server.key() = scene.epoch;
    server.mapped().replica.adopt(scene);
    server.mapped().pull = {};
    server.mapped().end.reset();
    server.mapped().bodies.clear();  // their chunks name the server before
    servers_.insert(std::move(server));
  }
  const auto [at, is_new] = servers_.try_emplace(scene.epoch);
  Server& server = at->second;
  if (is_new)
    server.replica.reset(scene);
  else
    server.replica.extend(scene);
  server.bodies.resize(server.replica.bodies().size());
  if (servers_.size() > kMaxServers) servers_.erase(servers_.begin());
}

void SessionCopy::feed(const DeltaMessage& message) {
  const auto at = servers_.find(message.epoch);
  if (at == servers_.end()) return;
  at->second.replica.feed(message);
  at->second.replica.catch_up();
}

void SessionCopy::feed(KeyframeChunk chunk) {
  const auto at = servers_.find(chunk.epoch);
  if (at == servers_.end() || chunk.body_id >= at->second.bodies.size()) return;
  Server& server = at->second;
  const ReplicaBody& body = server.replica.bodies()[chunk.body_id];
  if (body.known() && chunk.revision <= body.mesh().revision()) return;
  const std::uint32_t body_id = chunk.body_id;
  const auto bytes = server.pull.add(std::move(chunk));
  if (!bytes) return;
  server.replica.feed_keyframe(at->first, body_id, *bytes);
  server.replica.catch_up();
}

void SessionCopy::feed(const StateHeader& header) {
  const auto at = servers_.find(header.epoch);
  if (at == servers_.end()) return;
  at->second.heard = ++states_heard_;
  at->second.replica.follow(header);
}

void SessionCopy::feed(const SessionEnd& end) {
  const auto at = servers_.find(end.epoch);
  if (at == servers_.end()) return;
  at->second.end = end;
  at->second.replica.feed(end);
}

std::vector<KeyframeRequest> SessionCopy::take_requests(double now_s) {
  std::vector<KeyframeRequest> requests;
  for (auto& [epoch, server] : servers_) {
    const auto some = keyframe_requests(server.replica, server.pull, now_s);
    requests.insert(requests.end(), some.begin(), some.end());
  }
  return requests;
}

std::vector<SharedBytes> SessionCopy::scenes() const {
  std::vector<const Server*> by_age;
  for (const auto& [epoch, server] : servers_) by_age.push_back(&server);
  std::ranges::stable_sort(by_age, std::ranges::greater(), &Server::heard);
  std::vector<SharedBytes> scenes;
  for (const Server* server : by_age) scenes.push_back(shared(*server->replica.scene()));
  return scenes;
}

std::vector<SharedBytes> SessionCopy::ends() const {
  std::vector<SharedBytes> ends;
  for (const auto& [epoch, server] : servers_)
    if (server.end) ends.push_back(shared(*server.end));
  return ends;
}

const std::vector<SharedBytes>& SessionCopy::keyframe(const KeyframeRequest& request) {
  static const std::vector<SharedBytes> none;
  const auto at = servers_.find(request.epoch);
  if (at == servers_.end() || request.body_id >= at->second.bodies.size()) return none;
  const ReplicaBody& known = at->second.replica.bodies()[request.body_id];
  if (!known.known() || known.mesh().revision() == request.known_revision) return none;
  Body& body = at->second.bodies[request.body_id];
  if (body.revision != known.mesh().revision()) {
    body.revision = known.mesh().revision();
    body.chunks.clear();
    const std::vector<std::uint8_t> bytes = to_bytes(keyframe_of(known.mesh()));
    for (const KeyframeChunk& chunk : split_keyframe(request.epoch, request.body_id, body.revision, bytes, kChunkBytes))
      body.chunks.push_back(shared(chunk));
  }
  return body.chunks;
}

}  // namespace sectio
