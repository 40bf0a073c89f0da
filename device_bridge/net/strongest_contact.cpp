#include "device_bridge/net/strongest_contact.h"

#include <algorithm>
#include <tuple>

#include "common/messages/epoch.h"

namespace sectio {

namespace {

constexpr double kStillSpeaks_s = 0.05;  // models come every millisecond; nobody takes over sooner
constexpr std::size_t kMaxServers = 64;

// A surface that a free tool is near to counts more than none.
auto strength(const ContactModel& model) {
  return std::tuple(model.state, model.force_world_n.squaredNorm(), model.stiffness_n_per_m > 0);
}

}  // namespace

void StrongestContact::announce(const SceneInfo& scene) {
  if (scenes_.size() < kMaxServers || scenes_.contains(scene.epoch)) scenes_[scene.epoch] = scene;
}

// A server of its bodies, or that it says it takes the place of, speaks still.
bool StrongestContact::is_rival(double now_s, std::uint64_t epoch) const {
  if (servers_.contains(epoch)) return false;
  const auto own = scenes_.find(epoch);
  return std::ranges::any_of(servers_, [&](const auto& each) {
    if (each.second.ended || now_s - each.second.heard_s > kStillSpeaks_s) return false;
    const auto scene = scenes_.find(each.first);
    const bool same_bodies = own != scenes_.end() && scene != scenes_.end() && overlap(own->second, scene->second);
    return same_bodies || takes_over(epoch, each.first);
  });
}

bool StrongestContact::is_ghost(std::uint64_t epoch) const {
  return std::ranges::any_of(servers_, [&](const auto& each) { return takes_over(each.first, epoch); });
}

void StrongestContact::bury_before(std::uint64_t epoch) {
  std::erase_if(servers_, [&](const auto& each) { return takes_over(epoch, each.first); });
}

void StrongestContact::end(double now_s, std::uint64_t epoch) {
  if (is_ghost(epoch) || is_rival(now_s, epoch)) return;
  bury_before(epoch);
  servers_[epoch].ended = true;
}

bool StrongestContact::feel(double now_s, const ContactMessage& contact) {
  std::erase_if(servers_, [&](const auto& each) {
    return !each.second.ended && each.first != contact.epoch && now_s - each.second.heard_s > kSilence_s;
  });
  if (is_ghost(contact.epoch) || is_rival(now_s, contact.epoch)) return false;
  bury_before(contact.epoch);
  Server& server = servers_[contact.epoch];
  if (server.ended || (server.heard_s > 0 && contact.model.sequence <= server.model.sequence)) return false;
  server.model = contact.model;
  server.heard_s = now_s;
  const bool strongest = std::ranges::all_of(servers_, [&](const auto& each) {
    return each.second.ended || each.first == contact.epoch ||
           std::tuple_cat(strength(each.second.model), std::tuple(each.first)) <
               std::tuple_cat(strength(contact.model), std::tuple(contact.epoch));
  });
  if (!strongest) return false;
  model_ = contact.model;
  return true;
}

bool StrongestContact::all_ended(double now_s) const {
  const bool any = std::ranges::any_of(servers_, [](const auto& each) { return each.second.ended; });
  return any && std::ranges::none_of(servers_, [&](const auto& each) {
           return !each.second.ended && now_s - each.second.heard_s <= kSilence_s;
         });
}

}  // namespace sectio
