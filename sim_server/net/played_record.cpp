#include "sim_server/net/played_record.h"

#include <algorithm>
#include <utility>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/log.h"
#include "common/dds/qos.h"

namespace sectio {
namespace {

double seconds(std::uint64_t ns) {
  return 1e-9 * static_cast<double>(ns);
}
double time_of(const McapReader::Message& message) {
  return seconds(message.time_ns);
}

}  // namespace

PlayedRecord::PlayedRecord(const std::string& path) : path_(path), reader_(path) {
  const std::string scene = qos_of<SceneInfo>().name;
  std::optional<std::uint64_t> lost;
  while (const auto chunk = reader_.next_chunk()) {
    end_s_ = std::max(end_s_, seconds(chunk->last_ns));
    if (chunk->topics.empty() && !lost) lost = chunk->place;
    if (std::ranges::find(chunk->topics, scene) != chunk->topics.end())
      places_.push_back({seconds(chunk->first_ns), chunk->place});
  }
  if (const auto passed = reader_.passed_damage()) lost = std::min(lost.value_or(*passed), *passed);
  is_damaged_ = reader_.at() < reader_.size() && !reader_.is_finished();
  if (is_damaged_)
    tell_damage(reader_.at(), "read as far as it is whole");
  else if (!reader_.is_finished())
    log_warning(path_ + ": " + kNoEnd);
  const std::string damage = lost ? path_ + ": damaged at byte " + std::to_string(*lost) : path_;
  if (places_.empty()) throw InputError(damage + ": a record without a scene");
  begin(places_.front());
  while (next_ && !world_.can_be_shown()) take_next();
  if (!world_.can_be_shown()) throw InputError(damage + ": a record without the bodies of its scene");
  if (!lost || *lost > places_.front().at) return;
  is_damaged_ = true;
  tell_damage(*lost, formatted("what is before %.2f s is not shown, nor read up to byte %llu", time_s_,
                               static_cast<unsigned long long>(places_.front().at)));
}

void PlayedRecord::begin_at(const Place& place) {
  reader_.go_to(place.at);
  world_ = PlayedWorld();
  time_s_ = place.sim_time_s;
  next_ = reader_.next();
}

void PlayedRecord::begin(const Place& place) {
  begin_at(place);
  if (stands_at_damage()) pass_damage();
}

bool PlayedRecord::stands_at_damage() const {
  return !next_ && !reader_.is_finished() && reader_.at() < reader_.size();
}

void PlayedRecord::step_on() {
  time_s_ = std::max(time_s_, time_of(*next_));
  world_.take(*next_);
  next_ = reader_.next();
}

void PlayedRecord::take_next() {
  step_on();
  if (stands_at_damage()) pass_damage();
}

void PlayedRecord::tell_damage(std::uint64_t at, const std::string& what) {
  if (std::exchange(told_at_, at) != at) log_warning(path_ + ": damaged at byte " + std::to_string(at) + ": " + what);
}

// To the next place from which all bodies are known; where there is none, it ends here.
void PlayedRecord::pass_damage() {
  is_damaged_ = true;
  const std::uint64_t at = reader_.at();
  PlayedWorld before = std::move(world_);
  const double before_s = time_s_;
  for (const Place& place : places_) {
    if (place.at <= at) continue;
    begin_at(place);
    while (next_ && !world_.can_be_shown()) step_on();
    if (!world_.can_be_shown()) continue;
    tell_damage(at, formatted("%.2f s to %.2f s, up to byte %llu, are not shown", before_s, time_s_,
                              static_cast<unsigned long long>(place.at)));
    return world_.begin_elsewhere();
  }
  world_ = std::move(before);
  time_s_ = before_s;
  next_.reset();
  tell_damage(at, formatted("shown up to %.2f s, as far as it is whole", time_s_));
}

bool PlayedRecord::advance(double sim_time_s) {
  while (next_ && time_of(*next_) <= sim_time_s) take_next();
  time_s_ = std::max(time_s_, std::min(sim_time_s, end_s_));
  return next_.has_value();
}

void PlayedRecord::seek(double sim_time_s) {
  auto after = std::ranges::find_if(places_, [&](const Place& place) { return place.sim_time_s > sim_time_s; });
  do {
    if (after != places_.begin()) --after;
    begin(*after);
    advance(sim_time_s);
  } while (!world_.can_be_shown() && after != places_.begin());
  while (next_ && !world_.can_be_shown()) take_next();
  advance(time_s_);  // all of that moment
}

}  // namespace sectio
