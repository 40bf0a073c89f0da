#include "render_client/net/heard_record.h"

#include <algorithm>

#include "common/core/log.h"

namespace sectio {
namespace {

constexpr double kAnew_s = 0.5;  // a session that goes back further begins anew

}  // namespace

HeardRecord::HeardRecord(const std::string& path, const std::string& viewer)
    : path_(path), record_(path, {{"viewer", viewer}}) {}

void HeardRecord::hear(const DeltaMessage& message) {
  if (ended_) return;
  DeltaQueue& deltas = deltas_[{message.epoch, message.body_id}];
  if (deltas.edits() > kMostHeldEdits) deltas.clear();  // the world, too, may need a keyframe then
  deltas.add(message.delta);
}

void HeardRecord::hear(const StateHeader& header) {
  times_s_[header.epoch] = std::max(times_s_[header.epoch], header.sim_time_s);
  wait(header.epoch, qos_of<StateHeader>(), encode(header));
}

void HeardRecord::wait(std::uint64_t epoch, const TopicQos& topic, std::vector<std::uint8_t> bytes) {
  if (!ended_) waiting_.push_back({epoch, &topic, std::move(bytes)});
}

void HeardRecord::keep(const World& world) {
  if (ended_ || !advance(world)) return;
  const bool whole = record_.time_s() >= keyframes_kept_s_ + kKeyframesKeptEvery_s;
  if (whole) keyframes_kept_s_ = record_.time_s();
  for (const auto& [epoch, bodies] : world.body_counts()) {
    const Replica& replica = *world.replica_of(epoch);
    if (whole || scenes_[epoch] != bodies) record_.add(*replica.scene());
    scenes_[epoch] = bodies;
    for (std::uint32_t b = 0; b < bodies; ++b)
      if (replica.bodies()[b].known()) keep_body({epoch, b}, replica.bodies()[b].mesh(), whole);
  }
  for (const Waiting& message : waiting_)
    if (scenes_.contains(message.epoch)) record_.add(*message.topic, message.bytes);
  waiting_.clear();
  lose(record_.take_fault());
}

bool HeardRecord::finish() {
  ended_ = true;
  lose(record_.finish());
  return is_whole_;
}

void HeardRecord::lose(const std::optional<std::string>& fault) {
  if (!fault) return;
  if (is_whole_) log_warning(*fault);
  is_whole_ = false;
}

// The clock of the record goes on. False where it would go back.
bool HeardRecord::advance(const World& world) {
  for (const auto& [epoch, bodies] : world.body_counts()) {
    const auto heard = times_s_.find(epoch);
    if (heard == times_s_.end()) continue;
    if (heard->second < newest_s_ - kAnew_s) {
      log_info(path_ + ": ends where the session was begun anew");
      ended_ = true;
      return false;
    }
    newest_s_ = std::max(newest_s_, heard->second);
  }
  times_s_.clear();
  record_.set_time(newest_s_);
  return true;
}

// The body as the world has it now: by the deltas that led there, or as a whole.
void HeardRecord::keep_body(const BodyKey& key, const TriangleMesh& mesh, bool whole) {
  const auto& [epoch, body_id] = key;
  const BodyVersion now{mesh.revision(), mesh.hash()};
  const auto before = versions_.find(key);
  DeltaQueue& deltas = deltas_[key];
  std::vector<const TopologyDelta*> way;
  bool linked = before != versions_.end() && deltas.links(before->second.revision, now.revision);
  for (std::uint64_t r = linked ? before->second.revision : now.revision; r < now.revision; r = way.back()->revision)
    way.push_back(deltas.next(r, now.revision));
  if (!way.empty() && way.back()->hash_after != now.topology_hash) linked = false;
  if (linked)
    for (const TopologyDelta* delta : way) record_.add(DeltaMessage{epoch, body_id, *delta});
  if (whole || !linked) record_.add_keyframe(epoch, body_id, mesh);
  deltas.forget_before(now.revision);
  versions_[key] = now;
}

}  // namespace sectio
