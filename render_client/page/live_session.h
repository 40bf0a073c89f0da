// A page's knowledge of the session: the replica of the bodies, the people, the last events. Neither socket nor
// canvas: it is fed with frames of the WebSocket and gives back the bytes to send. One thread; time is passed in.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/messages/contact.h"
#include "common/messages/live.h"
#include "common/messages/live_frame.h"
#include "common/messages/tool.h"
#include "render_client/replica/equality.h"
#include "render_client/replica/fading_forces.h"
#include "render_client/replica/world.h"

namespace sectio {

class LiveSession {
 public:
  static constexpr std::size_t kMaxLines = 8;
  static constexpr std::size_t kMostScoreLines = 64;
  static constexpr std::size_t kMostHeard = 256;

  // A new connection: the replica stays as it is, until the session says that it is out of date.
  void connected(const Hello& hello);
  // Nobody at this page holds anything any more.
  void disconnected();
  void receive(std::span<const std::uint8_t> frame, double now_s);
  // Fills `frame` with the newest state; false when there is none newer.
  bool frame(double now_s, Frame& frame);

  void claim(const ToolClaim& claim);
  void order(const SessionOrder& order);
  void wish(std::uint32_t tool_id, const JointPose& pose_world);
  // Messages to be sent, since the last call.
  std::vector<std::uint8_t> take_outgoing();

  // The instrument that this page holds; the first one, if it holds several.
  std::optional<std::uint32_t> held_tool() const;
  const Roster& roster() const { return roster_; }
  const World& world() const { return world_; }
  // The newest of each server that is shown, in the order of their bodies.
  std::vector<const ServerStatus*> statuses() const;
  double force_n(std::uint32_t tool_id, double now_s) const { return forces_.force_n(tool_id, now_s).value_or(0); }
  // The time since the last word of the server that has been silent for longest; nothing before the first word.
  struct Silence {
    double for_s = 0;
    std::string of;  // its bodies, where there are several servers
  };
  std::optional<Silence> silence(double now_s) const;
  // A line for a person. Something that is said again stays one line.
  struct Line {
    std::uint64_t number = 0;  // ascending, so that a reader knows which are new
    std::string topic;         // there is one line for each
    std::string text;
    std::uint32_t count = 1;
    std::optional<double> time_s;  // simulated, when it was last said; nothing: in a time that nobody here knows of
  };
  // Newest last.
  const std::deque<Line>& lines() const { return lines_; }
  // Something that the page knows by itself.
  void note(const std::string& topic, const std::string& text) { add_line(topic, text, time_s_); }
  void note(const std::string& text) { note(text, text); }
  // The score that was told last, line by line.
  const std::vector<std::string>& score() const { return score_; }
  std::uint64_t score_lines_heard() const { return score_lines_heard_; }
  // The exercise, line by line: what to do, and what is expected.
  const std::vector<std::string>& task() const { return task_; }
  std::uint64_t damaged() const { return damaged_; }

  std::vector<Equality::OfBody> equality() const { return equality_.of_bodies(world_); }

 private:
  template <class Message, class Use>
  void with(const LiveFrameReader::Message& message, const Use& use);
  void take(const LiveFrameReader::Message& message, double now_s);
  void add_line(const std::string& topic, const std::string& text, std::optional<double> time_s);
  void say_who_serves();
  void take(const SessionEvent& event);
  void tell(const SessionEvent& event);
  template <class Message>
  void send(LiveKind kind, const Message& message);

  World world_;
  Roster roster_;
  std::map<std::uint64_t, ServerStatus> statuses_;  // by epoch: the newest
  std::vector<std::uint64_t> served_by_;            // epochs
  Equality equality_;
  FadingForces forces_;
  std::map<std::uint64_t, double> heard_s_;  // by epoch
  double time_s_ = 0;                        // simulated
  std::deque<Line> lines_;
  std::deque<SessionEvent> heard_;  // the kept events are said again to a page that joins anew
  std::uint64_t line_count_ = 0;
  std::vector<std::string> score_, task_;
  std::pair<std::uint64_t, std::uint64_t> scored_at_{0, 0};  // epoch and step
  std::uint64_t score_lines_heard_ = 0;
  std::uint64_t wish_sequence_ = 0;
  std::uint64_t damaged_ = 0;
  std::vector<std::uint8_t> outgoing_;
};

}  // namespace sectio
