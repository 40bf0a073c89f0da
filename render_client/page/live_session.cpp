#include "render_client/page/live_session.h"

#include <algorithm>
#include <utility>

#include "common/core/joined.h"
#include "common/messages/codec.h"
#include "common/messages/epoch.h"

namespace sectio {

namespace {

// Events whose text is half a sentence. Some tell of a state, and only the newest of these is of use.
struct Words {
  std::uint8_t kind;
  const char* before;
  bool is_state, names_tool;
};
constexpr Words kWords[] = {
    {kCutEnded, "cut ended: ", false, true},        {kCutRefused, "cut refused: ", false, true},
    {kReleased, "let go: ", false, true},           {kDidNotCut, "did not cut: ", false, true},
    {kBodySplit, "came off: ", false, false},       {kStepOverrun, "pace of the server ", true, false},
    {kGravityTurned, "gravity turns ", true, false}};

std::string body_names(const Replica& replica) {
  std::vector<std::string> names;
  for (const BodyInfo& body : replica.scene()->bodies) names.push_back(body.name);
  return joined(names);
}

}  // namespace

template <class Message>
void LiveSession::send(LiveKind kind, const Message& message) {
  append_live(kind, encode(message), outgoing_);
}

template <class Message, class Use>
void LiveSession::with(const LiveFrameReader::Message& message, const Use& use) {
  if (auto decoded = decode<Message>(message.bytes))
    use(std::move(*decoded));
  else
    ++damaged_;
}

void LiveSession::connected(const Hello& hello) {
  outgoing_.clear();
  roster_ = {};
  send(LiveKind::hello, hello);
}

void LiveSession::disconnected() {
  std::replace(roster_.holders.begin(), roster_.holders.end(), roster_.you, kNobody);
}

void LiveSession::receive(std::span<const std::uint8_t> frame, double now_s) {
  LiveFrameReader reader(frame);
  while (const auto message = reader.next()) take(*message, now_s);
  if (reader.damaged()) ++damaged_;
}

void LiveSession::take(const LiveFrameReader::Message& message, double now_s) {
  switch (message.kind) {
    case LiveKind::scene:
      return with<SceneInfo>(message, [&](const SceneInfo& scene) {
        world_.announce(scene);
        if (!scene.task.empty()) task_ = scene.task;
        if (!world_.knows(scored_at_.first)) score_.clear();
        const auto is_gone = [&](const auto& each) { return !world_.knows(each.first); };
        std::erase_if(statuses_, is_gone);
        std::erase_if(heard_s_, is_gone);
      });
    case LiveKind::delta:
      return with<DeltaMessage>(message, [&](DeltaMessage delta) { world_.feed(std::move(delta)); });
    case LiveKind::keyframe_chunk:
      return with<KeyframeChunk>(message, [&](KeyframeChunk chunk) { world_.feed(std::move(chunk)); });
    case LiveKind::state_header:
      return with<StateHeader>(message, [&](StateHeader header) {
        if (world_.knows(header.epoch)) heard_s_[header.epoch] = now_s;
        time_s_ = header.sim_time_s;
        world_.feed(std::move(header));
      });
    case LiveKind::state_piece:
      return with<StatePiece>(message, [&](StatePiece piece) { world_.feed(std::move(piece)); });
    case LiveKind::scalar_piece:
      return with<ScalarPiece>(message, [&](ScalarPiece piece) { world_.feed(std::move(piece)); });
    case LiveKind::event:
      return with<SessionEvent>(message, [&](const SessionEvent& event) { take(event); });
    case LiveKind::status:
      return with<ServerStatus>(message, [&](const ServerStatus& status) {
        if (world_.knows(status.epoch)) heard_s_[status.epoch] = now_s;
        statuses_[status.epoch] = status;
        equality_.hear(status.epoch, status.bodies);
        world_.feed(status);
      });
    case LiveKind::contact:
      return with<ContactMessage>(message, [&](const ContactMessage& contact) { forces_.hear(contact.model, now_s); });
    case LiveKind::session_end:
      return with<SessionEnd>(message, [&](const SessionEnd& end) {
        world_.feed(end);
        equality_.hear(end.epoch, end.bodies);
        const Replica* replica = world_.replica_of(end.epoch);
        const bool is_last = !replica || world_.body_counts().size() < 2 || world_.session_end();
        note((is_last ? "the session" : "the server of " + body_names(*replica)) + " has ended: " + end.reason);
      });
    case LiveKind::roster:
      return with<Roster>(message, [&](Roster roster) { roster_ = std::move(roster); });
    case LiveKind::notice:
      return with<Notice>(message, [&](const Notice& notice) { note(notice.text); });
    default:
      ++damaged_;
  }
}

// The lines of a score come one behind the other, in one step.
void LiveSession::take(const SessionEvent& event) {
  const auto is_known = [&](const SessionEvent& e) { return e.epoch == event.epoch && is_same_event(e, event); };
  const bool is_of_another = world_.knows(event.epoch) && !world_.shows(event.epoch);
  if (is_of_another || std::ranges::any_of(heard_, is_known)) return;
  const auto has_taken_over = [&](const auto& server) { return takes_over(server.first, event.epoch); };
  if (event.kind == kScoreTold && std::ranges::any_of(world_.body_counts(), has_taken_over))
    return;  // a former try had it
  heard_.push_back(event);
  if (heard_.size() > kMostHeard) heard_.pop_front();
  if (event.text.empty()) return;
  if (event.kind != kScoreTold) return tell(event);
  if (scored_at_ != std::pair(event.epoch, event.step)) score_.clear();
  scored_at_ = {event.epoch, event.step};
  if (score_.size() < kMostScoreLines) score_.push_back(event.text);
  ++score_lines_heard_;
}

void LiveSession::tell(const SessionEvent& event) {
  const auto words = std::ranges::find(kWords, event.kind, &Words::kind);
  std::string text = words == std::end(kWords) ? event.text : words->before + event.text;
  const Replica* replica = world_.replica_of(event.epoch);
  std::optional<double> time_s;
  if (replica) {
    const SceneInfo& scene = *replica->scene();
    time_s = static_cast<double>(event.step) * scene.step_s;
    const bool names_tool = words != std::end(kWords) && words->names_tool && event.tool_id < scene.tools.size();
    if (names_tool) text = scene.tools[event.tool_id].name + ", " + text;
  }
  add_line(words != std::end(kWords) && words->is_state ? words->before : text, text, time_s);
}

bool LiveSession::frame(double now_s, Frame& frame) {
  const bool fresh = world_.frame(now_s, frame);
  if (world_.session_end()) world_.catch_up();
  for (const KeyframeRequest& request : world_.take_requests(now_s)) send(LiveKind::keyframe_request, request);
  equality_.compare(world_);
  if (fresh) say_who_serves();
  return fresh;
}

// A server that takes the session over, or begins it anew, goes on with it; another one begins at its own beginning.
void LiveSession::say_who_serves() {
  std::vector<std::uint64_t> servers;
  for (const auto& [epoch, body_count] : world_.body_counts()) servers.push_back(epoch);
  for (const std::uint64_t gone : served_by_)
    if (!std::ranges::any_of(servers, [&](std::uint64_t epoch) { return same_session(epoch, gone); }))
      note("a server has gone, and another has begun in its place");
  served_by_ = std::move(servers);
}

void LiveSession::add_line(const std::string& topic, const std::string& text, std::optional<double> time_s) {
  Line line{++line_count_, topic, text, 1, time_s};
  if (const auto before = std::ranges::find(lines_, topic, &Line::topic); before != lines_.end()) {
    line.count += before->count;
    lines_.erase(before);
  }
  lines_.push_back(line);
  if (lines_.size() > kMaxLines) lines_.pop_front();
}

std::vector<const ServerStatus*> LiveSession::statuses() const {
  std::vector<const ServerStatus*> known;
  for (const auto& [epoch, body_count] : world_.body_counts())
    if (const auto status = statuses_.find(epoch); status != statuses_.end()) known.push_back(&status->second);
  return known;
}

void LiveSession::claim(const ToolClaim& claim) {
  send(LiveKind::claim, claim);
}

void LiveSession::order(const SessionOrder& order) {
  send(LiveKind::order, order);
}

void LiveSession::wish(std::uint32_t tool_id, const JointPose& pose_world) {
  send(LiveKind::wish, ToolWish{0, tool_id, ++wish_sequence_, pose_world, true});
}

std::vector<std::uint8_t> LiveSession::take_outgoing() {
  return std::exchange(outgoing_, {});
}

std::optional<std::uint32_t> LiveSession::held_tool() const {
  if (roster_.you == kNobody) return std::nullopt;
  for (std::uint32_t t = 0; t < roster_.holders.size(); ++t)
    if (roster_.holders[t] == roster_.you) return t;
  return std::nullopt;
}

std::optional<LiveSession::Silence> LiveSession::silence(double now_s) const {
  const std::vector<std::pair<std::uint64_t, std::size_t>> servers = world_.body_counts();
  std::optional<std::uint64_t> mute;
  for (const auto& [epoch, body_count] : servers)
    if (heard_s_.contains(epoch) && !world_.has_ended(epoch) && (!mute || heard_s_.at(epoch) < heard_s_.at(*mute)))
      mute = epoch;
  if (!mute) return std::nullopt;
  return Silence{now_s - heard_s_.at(*mute), servers.size() > 1 ? body_names(*world_.replica_of(*mute)) : ""};
}

}  // namespace sectio
