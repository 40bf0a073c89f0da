// The gateway between a session and browsers: what it passes on to whom, and what it lets through. Neither socket nor
// DDS nor clock: a shell feeds it messages of the session and frames of clients, and takes away what is to be sent.
// One thread.
//
//   session ── scene, deltas, states, events, contacts ──▶ a mailbox a client ──▶ page
//   page ── hello, claims, wishes, orders, keyframe requests ──▶ roles, limits ──▶ bridges, servers
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/core/token_bucket.h"
#include "common/math/trace.h"
#include "common/messages/contact.h"
#include "common/messages/live.h"
#include "common/messages/state.h"
#include "common/messages/tool.h"
#include "render_client/gateway/conduct.h"
#include "render_client/gateway/mailbox.h"
#include "render_client/gateway/roles.h"
#include "render_client/gateway/session_copy.h"
#include "render_client/gateway/try_book.h"

namespace sectio {

struct GatewayLimits {
  std::size_t max_clients = 64;
  double max_speed_m_per_s =
      kUsualMaxSpeed_m_per_s;  // limit of wishes; faster ones are passed on, counted, and followed at the limit
};

struct GatewayCounts {
  std::uint64_t clients_refused = 0;  // refused because there were too many
  std::uint64_t clients_cut = 0;      // cut because of their conduct
  std::uint64_t wishes = 0;           // passed on
  std::uint64_t wishes_too_fast = 0;
  std::uint64_t refused_garbage = 0;     // frames that are no messages
  std::uint64_t refused_not_holder = 0;  // wishes for an instrument that another one holds, or nobody
  std::uint64_t refused_claims = 0;
  std::uint64_t orders = 0;  // passed on
  std::uint64_t refused_orders = 0;
  std::uint64_t refused_tokens = 0;
  std::uint64_t keyframes = 0;
};

class Gateway {
 public:
  static constexpr std::size_t kMaxMessageBytes = 4096;  // from a page; longer ones end its connection
  static constexpr std::size_t kEventsKept = 16;         // for those who come later
  static constexpr std::size_t kEventsHeard = 256;       // a server's writer keeps so many
  static constexpr double kKeyframeInterval_s = 0.2;     // between keyframes of one body for one client

  Gateway(Roles::Tokens tokens, const GatewayLimits& limits, std::uint64_t source)
      : limits_(limits), source_(source), roles_(std::move(tokens)) {}

  // Validated messages of the session.
  void feed(const SceneInfo& message);
  void feed(const DeltaMessage& message);
  void feed(KeyframeChunk message);
  void feed(const StateHeader& message);
  void feed(const StatePiece& message);
  void feed(const ScalarPiece& message);
  void feed(const SessionEvent& message);
  void feed(const ServerStatus& message);
  void feed(const ContactMessage& message);
  void feed(const SessionEnd& message);

  // Scored tries of an exercise, as files.
  TryBook& tries() { return tries_; }

  // Connects a client. Nothing when there are too many.
  std::optional<std::uint32_t> connect();
  // The gateway's own viewer, which is nobody that people see or that counts.
  std::uint32_t connect_inside();
  void disconnect(std::uint32_t client);
  // Takes the data of a client, as one frame. False: the connection has to end (see take_guilty()).
  bool receive(std::uint32_t client, std::span<const std::uint8_t> frame, double now_s);
  // The next frame for a client; false when there is none.
  bool next_frame(std::uint32_t client, std::vector<std::uint8_t>& frame);
  // "browser 7 (Eve)"
  std::string title(std::uint32_t client) const;
  bool has_mail(std::uint32_t client) const;

  // Call again and again: for hands and clients that are silent, for notices, and for the roster.
  void tick(double now_s);
  // Clients whose connections have to end, each named once, and why.
  struct Guilty {
    std::uint32_t client;
    const char* fault;  // conduct.h
  };
  std::vector<Guilty> take_guilty() { return std::exchange(guilty_, {}); }

  // The messages for the session since the last call.
  std::vector<ToolWish> take_wishes();
  std::vector<SessionOrder> take_orders();
  std::vector<KeyframeRequest> take_requests(double now_s) { return copy_.take_requests(now_s); }

  // For Prometheus: a line a number.
  std::string metrics() const;
  const GatewayCounts& counts() const { return counts_; }
  std::size_t clients() const { return clients_.size() - clients_.count(kInside); }

 private:
  static constexpr std::uint32_t kInside = 0xffffffff;
  static constexpr double kAsleep_s = 1;

  // A server hears 10 a second of a gateway, and none of one that gives more.
  static constexpr double kOrders_per_s = 3, kMostOrders = 8;
  struct Client {
    Mailbox mailbox;
    Conduct conduct;
    TokenBucket orders{kOrders_per_s, kMostOrders};
    bool is_guilty = false;
    std::map<std::pair<std::uint64_t, std::uint32_t>, double> keyframe_sent_s;  // by epoch and body
  };
  struct Hand {  // the newest wish for an instrument
    std::uint64_t sequence = 0;
    Vec3 position_m = Vec3::Zero();
    double heard_s = -1;
  };

  template <class Message>
  void post_all(LiveKind kind, const Message& message);
  template <class Message>
  void post_all_newest(const Subject& subject, const Message& message);
  std::vector<SharedBytes> events_of_late() const;
  void welcome(Mailbox& mailbox) const;
  bool may_stay(std::uint32_t client, Client& who);
  void notify(std::uint32_t client, const std::string& text);
  bool take_message(std::uint32_t client, const LiveFrameReader::Message& message, double now_s);
  void take_hello(std::uint32_t client, const Hello& hello, double now_s);
  void take_claim(std::uint32_t client, const ToolClaim& claim, double now_s);
  void take_wish(std::uint32_t client, ToolWish wish, double now_s);
  void take_order(std::uint32_t client, SessionOrder order, double now_s);
  void send_keyframe(Client& client, const KeyframeRequest& request, double now_s);

  GatewayLimits limits_;
  std::uint64_t source_;
  Roles roles_;
  SessionCopy copy_;
  std::uint64_t tools_epoch_ = 0;
  std::map<std::uint32_t, Client> clients_;  // by person
  std::map<std::uint32_t, Hand> hands_;      // by tool
  // For those who come later: a server repeats what doesn't move once a second only.
  std::map<Subject, SharedBytes> newest_;
  std::deque<SessionEvent> heard_;  // the newest
  TryBook tries_;
  std::vector<ToolWish> wishes_;
  std::vector<SessionOrder> orders_;
  std::vector<Guilty> guilty_;
  double ticked_s_ = 1e300;
  std::uint64_t order_count_ = 0;
  GatewayCounts counts_;
  std::uint64_t replaced_before_ = 0, dropped_before_ = 0;  // by clients that have left
};

}  // namespace sectio
