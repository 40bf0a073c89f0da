#include "render_client/gateway/gateway.h"

#include <algorithm>
#include <utility>

#include "common/messages/epoch.h"

namespace sectio {

template <class Message>
void Gateway::post_all(LiveKind kind, const Message& message) {
  if (clients_.empty()) return;
  const SharedBytes bytes = shared(message);
  for (auto& [id, client] : clients_) client.mailbox.post(kind, bytes);
}

template <class Message>
void Gateway::post_all_newest(const Subject& subject, const Message& message) {
  const SharedBytes bytes = shared(message);
  newest_[subject] = bytes;
  for (auto& [id, client] : clients_) client.mailbox.post_newest(subject, bytes);
}

void Gateway::feed(const SceneInfo& message) {
  copy_.announce(message);
  std::erase_if(newest_, [&](const auto& each) { return !copy_.knows(each.first.epoch); });
  post_all(LiveKind::scene, message);
  if (takes_over(tools_epoch_, message.epoch)) return;
  tools_epoch_ = message.epoch;
  tries_.feed(message);
  std::vector<std::string> names;
  for (const ToolInfo& tool : message.tools) names.push_back(tool.name);
  roles_.set_tools(names);
}

void Gateway::feed(const DeltaMessage& message) {
  copy_.feed(message);
  post_all(LiveKind::delta, message);
}

void Gateway::feed(KeyframeChunk message) {
  copy_.feed(std::move(message));
}

void Gateway::feed(const StateHeader& message) {
  copy_.feed(message);
  tries_.feed(message);
  post_all_newest({LiveKind::state_header, message.epoch}, message);
}

void Gateway::feed(const StatePiece& message) {
  post_all_newest({LiveKind::state_piece, message.epoch, message.body_id, message.piece}, message);
}

void Gateway::feed(const ScalarPiece& message) {
  post_all_newest({LiveKind::scalar_piece, message.epoch, message.body_id, message.piece, message.name}, message);
}

void Gateway::feed(const SessionEvent& message) {
  // The kept events are said again to a gateway that joins anew.
  const auto is_known = [&](const SessionEvent& e) { return e.epoch == message.epoch && is_same_event(e, message); };
  if (std::ranges::any_of(heard_, is_known)) return;
  heard_.push_back(message);
  if (heard_.size() > kEventsHeard) heard_.pop_front();
  tries_.feed(message);
  post_all(LiveKind::event, message);
}

// Only events with words. A lag is told again and again: its newest is enough, and leaves place for others.
std::vector<SharedBytes> Gateway::events_of_late() const {
  std::vector<SharedBytes> late;
  bool has_lag = false;
  for (auto event = heard_.rbegin(); event != heard_.rend() && late.size() < kEventsKept; ++event) {
    if (event->text.empty()) continue;
    if (event->kind == kStepOverrun && std::exchange(has_lag, true)) continue;
    late.push_back(shared(*event));
  }
  std::ranges::reverse(late);
  return late;
}

void Gateway::feed(const ServerStatus& message) {
  post_all_newest({LiveKind::status, message.epoch}, message);
}

void Gateway::feed(const ContactMessage& message) {
  tries_.feed(message);
  post_all_newest({LiveKind::contact, message.epoch, message.model.tool_id}, message);
}

void Gateway::feed(const SessionEnd& message) {
  copy_.feed(message);
  post_all(LiveKind::session_end, message);
}

std::optional<std::uint32_t> Gateway::connect() {
  if (clients() >= limits_.max_clients) {
    ++counts_.clients_refused;
    return std::nullopt;
  }
  const std::uint32_t id = roles_.enter();
  welcome(clients_[id].mailbox);
  return id;
}

std::uint32_t Gateway::connect_inside() {
  welcome(clients_[kInside].mailbox);
  return kInside;
}

void Gateway::welcome(Mailbox& mailbox) const {
  for (const SharedBytes& scene : copy_.scenes()) mailbox.post(LiveKind::scene, scene);
  for (const auto& [subject, bytes] : newest_) mailbox.post_newest(subject, bytes);
  for (const SharedBytes& event : events_of_late()) mailbox.post(LiveKind::event, event);
  for (const SharedBytes& end : copy_.ends()) mailbox.post(LiveKind::session_end, end);
}

void Gateway::disconnect(std::uint32_t client) {
  const auto at = clients_.find(client);
  if (at == clients_.end()) return;
  replaced_before_ += at->second.mailbox.replaced();
  dropped_before_ += at->second.mailbox.dropped();
  clients_.erase(at);
  if (client != kInside) roles_.leave(client);
}

bool Gateway::receive(std::uint32_t client, std::span<const std::uint8_t> frame, double now_s) {
  const auto at = clients_.find(client);
  if (at == clients_.end()) return false;
  bool fine = frame.size() <= kMaxMessageBytes;
  LiveFrameReader reader(fine ? frame : std::span<const std::uint8_t>{});
  while (const auto message = reader.next()) fine = take_message(client, *message, now_s) && fine;
  fine = fine && !reader.damaged();
  counts_.refused_garbage += fine ? 0 : 1;
  at->second.conduct.message(fine);
  return frame.size() <= kMaxMessageBytes && may_stay(client, at->second);
}

bool Gateway::may_stay(std::uint32_t client, Client& who) {
  const char* const fault = who.conduct.fault();
  if (fault == nullptr || client == kInside) return true;
  if (std::exchange(who.is_guilty, true)) return false;
  ++counts_.clients_cut;
  guilty_.push_back({client, fault});
  return false;
}

// False for bytes that are no message of a page.
bool Gateway::take_message(std::uint32_t client, const LiveFrameReader::Message& message, double now_s) {
  switch (message.kind) {
    case LiveKind::hello:
      if (const auto hello = decode<Hello>(message.bytes)) return take_hello(client, *hello, now_s), true;
      return false;
    case LiveKind::claim:
      if (const auto claim = decode<ToolClaim>(message.bytes)) return take_claim(client, *claim, now_s), true;
      return false;
    case LiveKind::wish:
      if (const auto wish = decode<ToolWish>(message.bytes)) return take_wish(client, *wish, now_s), true;
      return false;
    case LiveKind::order:
      if (const auto order = decode<SessionOrder>(message.bytes)) return take_order(client, *order, now_s), true;
      return false;
    case LiveKind::keyframe_request:
      if (const auto request = decode<KeyframeRequest>(message.bytes))
        return send_keyframe(clients_.at(client), *request, now_s), true;
      return false;
    default:
      return false;
  }
}

void Gateway::take_hello(std::uint32_t client, const Hello& hello, double now_s) {
  if (roles_.hello(client, hello)) return;
  ++counts_.refused_tokens;
  clients_.at(client).conduct.refusal(now_s, Conduct::kWrongToken);
  notify(client, "the token in the address is not this session's: you watch");
}

void Gateway::take_claim(std::uint32_t client, const ToolClaim& claim, double now_s) {
  const std::string refusal = roles_.act(client, claim, now_s);
  if (refusal.empty()) return;
  ++counts_.refused_claims;
  clients_.at(client).conduct.refusal(now_s);
  notify(client, refusal);
}

void Gateway::take_wish(std::uint32_t client, ToolWish wish, double now_s) {
  if (!roles_.heard(client, wish.tool_id, now_s)) {
    ++counts_.refused_not_holder;
    clients_.at(client).conduct.refusal(now_s);
    return;
  }
  Hand& hand = hands_[wish.tool_id];
  constexpr double kJitter_s = 0.02;  // jitter of the network
  const double most_m = limits_.max_speed_m_per_s * (now_s - hand.heard_s + kJitter_s);
  const bool too_fast = hand.heard_s >= 0 && (wish.pose_world.position_m - hand.position_m).norm() > most_m;
  clients_.at(client).conduct.wish(too_fast);
  counts_.wishes_too_fast += too_fast ? 1 : 0;
  hand.position_m = wish.pose_world.position_m;
  hand.heard_s = now_s;
  wish.source = source_;
  wish.sequence = ++hand.sequence;
  wish.held = true;
  wishes_.push_back(wish);
  ++counts_.wishes;
}

void Gateway::take_order(std::uint32_t client, SessionOrder order, double now_s) {
  if (!roles_.may_lead(client)) {
    ++counts_.refused_orders;
    clients_.at(client).conduct.refusal(now_s);
    notify(client, "this session is led by somebody else");
    return;
  }
  TokenBucket& bucket = clients_.at(client).orders;
  if (!bucket.is_open(now_s)) {
    ++counts_.refused_orders;
    notify(client, "orders come too fast: not all of them are passed on");
    return;
  }
  bucket.take(1);
  order.source = source_ + ++order_count_;
  orders_.push_back(order);
  ++counts_.orders;
}

void Gateway::send_keyframe(Client& client, const KeyframeRequest& request, double now_s) {
  // A socket is reliable and paces itself: the first request is answered with all chunks.
  if (request.revision != kNoRevision || client.mailbox.holds_keyframe(request.epoch, request.body_id)) return;
  const std::vector<SharedBytes>& chunks = copy_.keyframe(request);
  if (chunks.empty()) return;
  const auto [sent_s, first] = client.keyframe_sent_s.try_emplace({request.epoch, request.body_id}, now_s);
  if (!first && now_s - sent_s->second < kKeyframeInterval_s) return;
  sent_s->second = now_s;
  client.mailbox.post_keyframe(request.epoch, request.body_id, chunks);
  ++counts_.keyframes;
}

void Gateway::notify(std::uint32_t client, const std::string& text) {
  const auto at = clients_.find(client);
  if (at != clients_.end())
    at->second.mailbox.post(LiveKind::notice, shared(Notice{text.substr(0, kMaxEventTextBytes)}));
}

void Gateway::tick(double now_s) {
  roles_.tick(now_s);
  const bool slept = now_s - ticked_s_ > kAsleep_s;
  ticked_s_ = now_s;
  for (auto& [id, client] : clients_) {
    if (slept) client.conduct.slept(now_s);
    client.conduct.tick(now_s);
    (void)may_stay(id, client);
  }
  tries_.tick(roles_.hands());
  for (const auto& [person, text] : roles_.take_notices())
    for (const auto& [id, client] : clients_)
      if (person == kNobody || person == id) notify(id, text);
  for (const std::uint32_t tool : roles_.take_freed()) {
    Hand& hand = hands_[tool];
    if (hand.heard_s < 0) continue;
    hand.heard_s = -1;
    wishes_.push_back({source_, tool, ++hand.sequence, Pose{hand.position_m}, false});
  }
  if (!roles_.take_changed()) return;
  for (auto& [id, client] : clients_) client.mailbox.post_newest({LiveKind::roster}, shared(roles_.roster_for(id)));
}

bool Gateway::next_frame(std::uint32_t client, std::vector<std::uint8_t>& frame) {
  const auto at = clients_.find(client);
  return at != clients_.end() && at->second.mailbox.take(frame);
}

bool Gateway::has_mail(std::uint32_t client) const {
  const auto at = clients_.find(client);
  return at != clients_.end() && !at->second.mailbox.is_empty();
}

std::string Gateway::title(std::uint32_t client) const {
  return "browser " + std::to_string(client) + " (" + roles_.name_of(client) + ")";
}

std::vector<ToolWish> Gateway::take_wishes() {
  return std::exchange(wishes_, {});
}

std::vector<SessionOrder> Gateway::take_orders() {
  return std::exchange(orders_, {});
}

std::string Gateway::metrics() const {
  std::uint64_t replaced = replaced_before_, dropped = dropped_before_;
  for (const auto& [id, client] : clients_) {
    replaced += client.mailbox.replaced();
    dropped += client.mailbox.dropped();
  }
  std::string text;
  const auto add = [&](const std::string& name, const char* type, std::uint64_t value) {
    text +=
        "# TYPE sectio_gateway_" + name + " " + type + "\nsectio_gateway_" + name + " " + std::to_string(value) + "\n";
  };
  add("clients", "gauge", clients());
  add("clients_refused_total", "counter", counts_.clients_refused);
  add("clients_cut_total", "counter", counts_.clients_cut);
  add("wishes_total", "counter", counts_.wishes);
  add("wishes_too_fast_total", "counter", counts_.wishes_too_fast);
  add("refused_garbage_total", "counter", counts_.refused_garbage);
  add("refused_not_holder_total", "counter", counts_.refused_not_holder);
  add("refused_claims_total", "counter", counts_.refused_claims);
  add("orders_total", "counter", counts_.orders);
  add("refused_orders_total", "counter", counts_.refused_orders);
  add("refused_tokens_total", "counter", counts_.refused_tokens);
  add("keyframes_total", "counter", counts_.keyframes);
  add("states_replaced_total", "counter", replaced);
  add("topology_dropped_total", "counter", dropped);
  return text;
}

}  // namespace sectio
