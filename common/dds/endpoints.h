// The readers and writers of a program, together with its participant:
//
//   Endpoints<Reads<SceneInfo, StateHeader>, Writes<KeyframeRequest>> endpoints(options, "render_client");
//   while (auto header = endpoints.take<StateHeader>()) ...
//   if (!endpoints.write(request)) ...
#pragma once

#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/core/log.h"
#include "common/core/wall_time.h"
#include "common/dds/endpoint.h"
#include "common/messages/epoch_owners.h"
#include "common/messages/inputs.h"
#include "common/messages/session.h"
#include "common/messages/topology.h"

namespace sectio {

template <class... Messages>
struct Reads {};
template <class... Messages>
struct Writes {};

// A message that a server writes, with the epoch of that server. Requests have an epoch, too: that of the server asked.
template <class Message>
concept FromServer = requires(const Message& message) {
  message.epoch;
}
&&!std::is_same_v<Message, KeyframeRequest> && !std::is_same_v<Message, StepRequest>;

template <class Reading, class Writing>
class Endpoints;

// Threads: as for single endpoints; renew_after_sleep() and a call of another thread exclude each other.
template <class... R, class... W>
class Endpoints<Reads<R...>, Writes<W...>> {
 public:
  // Throws as Participant does.
  Endpoints(NetworkOptions options, std::string name)
      : options_(std::move(options)), name_(std::move(name)), now_(std::make_unique<Set>(options_, name_)) {}
  Endpoints(const Endpoints&) = delete;
  Endpoints& operator=(const Endpoints&) = delete;

  // The next message, oldest first. A server's messages come from a program that may speak for their epoch alone
  // (epoch_owners.h), which the program knows when it reads SceneInfo, too; an end that comes before its scene waits.
  template <class Message>
  std::optional<Message> take() {
    if constexpr (kReadsScenes && FromServer<Message>)
      return take_of_server<Message>();
    else
      return std::get<Reader<Message>>(now_->readers).take();
  }
  ProgramId id() const { return now_->participant.id(); }
  // The program that may speak for an epoch; nothing: none has announced it.
  std::optional<ProgramId> owner(std::uint64_t epoch) {
    return with_owners([&] { return owners_.owner(epoch); });
  }
  // The program that wrote the last message of this kind.
  template <class Message>
  const ProgramId& sender() const {
    return std::get<Reader<Message>>(now_->readers).sender();
  }
  template <class Message>
  [[nodiscard]] bool write(const Message& message, std::size_t channel = 0) {
    return writer<Message>().write(message, channel);
  }
  template <class Message>
  Writer<Message>& writer() {
    return std::get<Writer<Message>>(now_->writers);
  }
  template <class Message>
  const Writer<Message>& writer() const {
    return std::get<Writer<Message>>(now_->writers);
  }
  Participant& participant() { return now_->participant; }

  // Participant::hear(), also after a sleep.
  void hear(std::vector<std::string> channels) {
    now_->participant.hear(channels);
    channels_ = std::move(channels);
  }

  // Whether any endpoint of another program has been found.
  bool met() const {
    return ((std::get<Reader<R>>(now_->readers).writers() > 0) || ...) ||
           ((std::get<Writer<W>>(now_->writers).readers() > 0) || ...);
  }
  // Number of damaged messages that were dropped: of one kind, and of all kinds.
  template <class Message>
  std::uint64_t damaged() const {
    return std::get<Reader<Message>>(now_->readers).damaged();
  }
  std::uint64_t damaged() const { return damaged_before_ + (std::uint64_t{0} + ... + damaged<R>()); }

  bool overslept() const { return now_->participant.overslept(); }

  // Joins the session anew when the program has slept for longer than its lease; true when it has done so.
  bool renew_after_sleep() {
    if (former_ && met()) former_.reset();
    return overslept() && renew("was asleep");
  }

  // Joins the session anew; true when it has done so. The former participant stays until the new one has met somebody:
  // if it left sooner, others would believe that the program has left.
  bool renew(const std::string& why) {
    try {
      auto fresh = std::make_unique<Set>(options_, name_);
      damaged_before_ = damaged();
      former_id_ = now_->participant.id();
      former_ = std::exchange(now_, std::move(fresh));
      if (channels_) now_->participant.hear(*channels_);
    } catch (const std::exception& error) {
      log_limited(LogLevel::warning, "renew", why + ", and can't join the session anew: " + error.what());
      return false;
    }
    log_info(why + ": joining the session anew");
    return true;
  }

 private:
  static constexpr bool kReadsScenes = (std::is_same_v<R, SceneInfo> || ...);
  static constexpr std::size_t kMostWaiting = 16;
  template <class Message>
  using Waiting = std::vector<std::pair<ProgramId, Message>>;

  // A program hears itself, and after a sleep under another id than that with which it began.
  bool is_own(const ProgramId& program) const { return program == now_->participant.id() || program == former_id_; }

  // Several threads may read, a kind of message each.
  template <class Call>
  auto with_owners(const Call& call) {
    const std::lock_guard lock(owners_mutex_);
    return call();
  }
  template <class Message>
  bool is_heard(std::uint64_t epoch, const ProgramId& program) {
    return with_owners([&] {
      if (std::is_same_v<Message, SessionEnd> ? !owners_.may_end(epoch, program) : !owners_.owns(epoch, program))
        return false;
      owners_.hear(epoch, program);
      return true;
    });
  }

  template <class Message>
  std::optional<Message> take_of_server() {
    Reader<Message>& reader = std::get<Reader<Message>>(now_->readers);
    constexpr bool kWaits = std::is_same_v<Message, SceneInfo> || std::is_same_v<Message, SessionEnd>;
    if constexpr (kWaits)
      if (auto message = take_waiting(std::get<Waiting<Message>>(waiting_))) return message;
    while (auto message = reader.take()) {
      if constexpr (std::is_same_v<Message, SceneInfo>)
        with_owners([&] { owners_.announce(message->epoch, reader.sender()); });
      if (is_heard<Message>(message->epoch, reader.sender())) return message;
      const auto is_impostor = [&] { return owners_.belongs_to_another(message->epoch, reader.sender()); };
      if (with_owners(is_impostor) && !is_own(reader.sender()))
        log_limited(
            LogLevel::warning, "impostor",
            std::string("a program that didn't begin the session speaks in its server's name, and is not heard: ") +
                qos_of<Message>().name);
      if constexpr (kWaits) {
        auto& waiting = std::get<Waiting<Message>>(waiting_);
        waiting.emplace_back(reader.sender(), std::move(*message));
        if (waiting.size() > kMostWaiting) waiting.erase(waiting.begin());
      }
    }
    return std::nullopt;
  }

  // The first message that may be heard by now, of those that came before their scene, or while another program spoke
  // for their epoch.
  template <class Message>
  std::optional<Message> take_waiting(Waiting<Message>& waiting) {
    for (auto at = waiting.begin(); at != waiting.end(); ++at) {
      if (!is_heard<Message>(at->second.epoch, at->first)) continue;
      Message message = std::move(at->second);
      waiting.erase(at);
      return message;
    }
    return std::nullopt;
  }

  struct Set {
    Set(const NetworkOptions& options, const std::string& name)
        : participant(options, name), readers(Reader<R>(participant)...), writers(Writer<W>(participant)...) {}

    Participant participant;
    std::tuple<Reader<R>...> readers;
    std::tuple<Writer<W>...> writers;
  };

  NetworkOptions options_;
  std::string name_;
  std::unique_ptr<Set> former_, now_;
  std::optional<ProgramId> former_id_;
  std::uint64_t damaged_before_ = 0;
  std::mutex owners_mutex_;
  EpochOwners owners_{[this](const ProgramId& program) { return now_->participant.is_there(program); }, steady_now_s};
  std::tuple<Waiting<SceneInfo>, Waiting<SessionEnd>> waiting_;
  std::optional<std::vector<std::string>> channels_;
};

}  // namespace sectio
