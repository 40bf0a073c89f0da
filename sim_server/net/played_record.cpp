#include "sim_server/net/played_record.h"

#include <algorithm>

#include "common/core/error.h"
#include "common/core/log.h"
#include "common/dds/qos.h"

namespace sectio {
namespace {

double time_of(const McapReader::Message& message) {
  return 1e-9 * static_cast<double>(message.time_ns);
}

}  // namespace

PlayedRecord::PlayedRecord(const std::string& path) : path_(path), reader_(path) {
  const std::string scene = qos_of<SceneInfo>().name;
  while (const auto message = reader_.next()) {
    end_s_ = std::max(end_s_, time_of(*message));
    const std::uint64_t at = reader_.place();
    if (message->topic == scene && (places_.empty() || places_.back().at != at))
      places_.push_back({time_of(*message), at});
  }
  is_damaged_ = reader_.at() < reader_.size() && !reader_.is_finished();
  if (is_damaged_)
    log_warning(path_ + ": damaged at byte " + std::to_string(reader_.at()) + ": read as far as it is whole");
  else if (!reader_.is_finished())
    log_warning(path_ + ": " + kNoEnd);
  if (places_.empty()) throw InputError(path_ + ": a record without a scene");
  begin_at(places_.front());
  while (next_ && !world_.can_be_shown()) take_next();
  if (!world_.can_be_shown()) throw InputError(path_ + ": a record without the bodies of its scene");
}

void PlayedRecord::begin_at(const Place& place) {
  reader_.go_to(place.at);
  world_ = PlayedWorld();
  time_s_ = place.sim_time_s;
  next_ = reader_.next();
}

void PlayedRecord::take_next() {
  time_s_ = std::max(time_s_, time_of(*next_));
  world_.take(*next_);
  next_ = reader_.next();
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
    begin_at(*after);
    advance(sim_time_s);
  } while (!world_.can_be_shown() && after != places_.begin());
  while (next_ && !world_.can_be_shown()) take_next();
  advance(time_s_);  // all of that moment
}

}  // namespace sectio
