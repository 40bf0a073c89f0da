#include "render_client/gateway/try_book.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <utility>

#include "common/core/error.h"
#include "common/core/json_text.h"
#include "common/core/log.h"
#include "common/core/wall_time.h"
#include "common/core/write_file.h"
#include "common/messages/epoch.h"

namespace sectio {

namespace {

void write(JsonText& json, const char* key, const auto& lines) {
  json.key(key).open('[');
  for (const std::string& line : lines) json.value(line);
  json.close(']');
}

}  // namespace

void TryBook::keep_in(const std::string& directory) {
  directory_ = directory;
  std::error_code error;
  if (!directory.empty()) std::filesystem::create_directories(directory, error);
  if (error) throw InputError(directory + ": " + error.message());
}

void TryBook::feed(const SceneInfo& message) {
  if (message.task.empty() || message.epoch == epoch_) return;
  const bool goes_on = same_session(message.epoch, epoch_) && message.task == task_;
  epoch_ = message.epoch;
  next_s_ = 0;
  forces_n_.clear();
  if (goes_on) return;
  begin();
  moments_.clear();
  task_ = message.task;
  tools_.clear();
  for (const ToolInfo& tool : message.tools) tools_.push_back(tool.name);
}

bool TryBook::presses(const Moment& moment) {
  return std::ranges::any_of(moment.places, [](const Place& place) { return place.force_n > 0; });
}

// With the moments of the newest epoch.
void TryBook::begin() {
  begun_us_ = microseconds_since_1970();
  every_s_ = kEvery_s;
  score_.clear();
  hands_.clear();
  std::erase_if(moments_, [&](const Moment& moment) { return moment.epoch != epoch_; });
  has_touched_ = std::ranges::any_of(moments_, presses);
}

// The session has gone back in time: moments of former epochs after the first one of this epoch haven't been.
void TryBook::forget_what_comes_later() {
  const auto first = std::ranges::find(moments_, epoch_, &Moment::epoch);
  if (first == moments_.end() || first == moments_.begin() || std::prev(first)->time_s <= first->time_s) return;
  const double time_s = first->time_s;
  std::erase_if(moments_, [&](const Moment& moment) { return moment.epoch != epoch_ && moment.time_s > time_s; });
}

void TryBook::feed(const SessionEvent& message) {
  begins_anew_ |= message.kind == kBegunAnew && message.epoch == epoch_;
  const bool is_of_this =
      same_session(message.epoch, epoch_);  // a server tells the score of the term that it ends, too
  if (message.kind != kScoreTold || !is_of_this || task_.empty()) return;
  if (const std::pair at(message.epoch, message.step); std::exchange(scored_at_, at) != at) score_.clear();
  if (score_.size() < kMostLines) score_.push_back(message.text);
  has_news_ = true;
}

void TryBook::feed(const ContactMessage& message) {
  if (message.epoch != epoch_) return;
  double& force_n = forces_n_[message.model.tool_id];
  force_n = std::max(force_n, message.model.force_world_n.norm());
}

void TryBook::feed(const StateHeader& message) {
  if (message.epoch != epoch_ || task_.empty()) return;
  if (message.sim_time_s < next_s_) return;
  next_s_ = message.sim_time_s + every_s_;
  Moment& moment = moments_.emplace_back(epoch_, message.sim_time_s);
  for (std::uint32_t t = 0; t < message.tools.size(); ++t)
    moment.places.push_back({message.tools[t].pose_world.position_m, forces_n_[t], message.tools[t].present});
  has_touched_ |= presses(moment);
  forces_n_.clear();
  if (moments_.size() < kMostPlaces) return;
  for (std::size_t i = 0; 2 * i < moments_.size(); ++i) moments_[i] = std::move(moments_[2 * i]);
  moments_.resize(moments_.size() / 2);
  every_s_ *= 2;
}

void TryBook::tick(const std::vector<std::string>& hands) {
  hands_.insert(hands.begin(), hands.end());
  const bool begins_anew = std::exchange(begins_anew_, false);
  if (!begins_anew) forget_what_comes_later();
  if (std::exchange(has_news_, false) && !directory_.empty() && has_touched_) keep();
  if (begins_anew) begin();
}

void TryBook::keep() const {
  const std::string path = directory_ + "/try_" + std::to_string(begun_us_) + ".json";
  try {
    write_file(path, try_as_json() + "\n");
  } catch (const InputError& error) {
    log_limited(LogLevel::warning, "tries", error.what());
  }
}

std::string TryBook::task_as_json() const {
  JsonText json;
  json.open('{');
  write(json, "task", task_);
  return json.text();
}

// The task comes first, so that a file tells at once of which exercise it is.
std::string TryBook::try_as_json() const {
  JsonText json;
  json.open('{');
  write(json, "task", task_);
  json.key("begun_s").value(static_cast<std::uint64_t>(begun_us_ / 1'000'000)).key("every_s").value(every_s_);
  write(json, "score", score_);
  write(json, "hands", hands_);
  json.key("tools").open('[');
  for (std::uint32_t t = 0; t < tools_.size(); ++t) {
    json.open('{').key("name").value(tools_[t]).key("at_mm").open('[');
    const auto in_mm = [](double m) { return 0.1 * std::round(1e4 * m); };
    for (const auto& [epoch, time_s, places] : moments_) {
      if (t >= places.size() || !places[t].present) {
        json.null();
        continue;
      }
      const Vec3& at_m = places[t].at_m;
      json.open('[').value(in_mm(at_m.x())).value(in_mm(at_m.y())).value(in_mm(at_m.z())).close(']');
    }
    json.close(']').key("force_n").open('[');
    for (const auto& [epoch, time_s, places] : moments_)
      json.value(t < places.size() ? 1e-3 * std::round(1e3 * places[t].force_n) : 0.0);
    json.close(']').close('}');
  }
  json.close(']').close('}');
  return json.text();
}

std::string TryBook::json() const {
  std::vector<std::string> tries;
  std::vector<std::filesystem::path> files;
  std::error_code error;
  if (!directory_.empty() && !task_.empty())
    for (const auto& entry : std::filesystem::directory_iterator(directory_, error)) files.push_back(entry.path());
  std::ranges::sort(files);
  for (const std::filesystem::path& path : files) {
    std::ifstream file(path);
    std::string text;
    if (path.extension() == ".json" && std::getline(file, text) && text.starts_with(task_as_json()) &&
        text.back() == '}')
      tries.push_back(std::move(text));
  }
  if (directory_.empty() && !score_.empty() && has_touched_) tries.push_back(try_as_json());
  std::string all = "[";
  for (std::size_t i = tries.size() - std::min(tries.size(), kMostTriesShown); i < tries.size(); ++i)
    all += (all.size() > 1 ? "," : "") + tries[i];
  return all + "]";
}

}  // namespace sectio
