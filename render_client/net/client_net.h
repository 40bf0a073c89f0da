// A viewer's end of the wire: takes the messages that have arrived, feeds the replicas, and asks for keyframes.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "common/dds/participant.h"
#include "common/messages/session.h"
#include "render_client/net/heard_record.h"
#include "render_client/net/link_meter.h"
#include "render_client/replica/equality.h"
#include "render_client/replica/world.h"

namespace sectio {

struct ClientNetCounts {
  std::uint64_t messages = 0;  // valid ones
  std::uint64_t damaged = 0;   // dropped
};

// One thread; nothing blocks.
class ClientNet {
 public:
  static constexpr std::size_t kMaxEvents = 64;

  // Throws InputError for bad options.
  explicit ClientNet(const NetworkOptions& options, std::string name = "viewer");
  ~ClientNet();

  // Takes everything that has arrived since the last call, from every server of the session. A program that was asleep
  // joins the session anew here; the world keeps what it has.
  void poll(double now_s, World& world);

  // Records everything that is heard from now on, too; the program that draws calls HeardRecord::keep(). The record
  // outlives the net.
  void record(HeardRecord& record);

  bool connected() const;
  const std::deque<SessionEvent>& events() const { return events_; }  // the newest kMaxEvents
  ClientNetCounts counts() const;
  // The age of states when they are taken; empty before the server's clock is known.
  std::optional<double> state_age_s() const;
  const Equality& equality() const { return equality_; }
  // The speed of the session as a server last told it: 0 in a pause, 1 before it is known.
  double speed() const { return speed_; }

 private:
  struct Wire;
  void choose_channels(double now_s, const World& world, bool pulls);
  void hear_channels();
  void report(double now_s);
  template <class Message, class Use>
  void drain(const Use& use);

  std::uint64_t client_;  // tells viewers apart
  std::unique_ptr<Wire> wire_;
  HeardRecord* record_ = nullptr;
  std::deque<SessionEvent> events_;
  Equality equality_;
  std::uint64_t messages_ = 0;
  double speed_ = 1;

  std::string name_;
  LinkMeter meter_;
  LinkClock clock_;
  const bool off_host_;
  struct Channels {
    std::size_t level = 0;  // index into kStateRates_hz
    bool states = true, keyframes = true, deltas = true;
    bool operator==(const Channels&) const = default;
  };
  Channels channels_;     // channels that are heard now
  double joined_s_ = -1;  // when the scene was heard
  double pull_began_s_ = -1;
  double pulled_s_ = -1e300;  // when a keyframe was last wanted
  double next_report_s_ = -1e300;
};

}  // namespace sectio
