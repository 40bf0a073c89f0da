#include "device_bridge/net/strongest_contact.h"

#include <algorithm>
#include <tuple>

namespace sectio {

namespace {

// A surface that a free tool is near to counts more than none.
auto strength(const ContactModel& model) {
  return std::tuple(model.state, model.force_world_n.squaredNorm(), model.stiffness_n_per_m > 0);
}

}  // namespace

bool StrongestContact::feel(double now_s, const ContactMessage& contact) {
  std::erase_if(servers_, [&](const auto& each) {
    return !each.second.ended && each.first != contact.epoch && now_s - each.second.heard_s > kSilence_s;
  });
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
