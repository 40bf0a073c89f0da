// The readers and writers of a program, together with its participant:
//
//   Endpoints<Reads<SceneInfo, StateHeader>, Writes<KeyframeRequest>> endpoints(options, "render_client");
//   while (auto header = endpoints.take<StateHeader>()) ...
//   if (!endpoints.write(request)) ...
#pragma once

#include <exception>
#include <memory>
#include <string>
#include <tuple>
#include <utility>

#include "common/core/log.h"
#include "common/dds/endpoint.h"

namespace sectio {

template <class... Messages>
struct Reads {};
template <class... Messages>
struct Writes {};

template <class Reading, class Writing>
class Endpoints;

// Threads: as those of the single endpoints; renew_after_sleep() and a call of another thread exclude each other.
template <class... R, class... W>
class Endpoints<Reads<R...>, Writes<W...>> {
 public:
  // Throws as Participant does.
  Endpoints(NetworkOptions options, std::string name)
      : options_(std::move(options)), name_(std::move(name)), now_(std::make_unique<Set>(options_, name_)) {}

  template <class Message>
  std::optional<Message> take() {
    return std::get<Reader<Message>>(now_->readers).take();
  }
  template <class Message>
  [[nodiscard]] bool write(const Message& message) {
    return writer<Message>().write(message);
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

  // Whether any endpoint of another program has been found.
  bool met() const {
    return ((std::get<Reader<R>>(now_->readers).writers() > 0) || ...) ||
           ((std::get<Writer<W>>(now_->writers).readers() > 0) || ...);
  }
  // Damaged messages that were dropped: of one kind, and all.
  template <class Message>
  std::uint64_t damaged() const {
    return std::get<Reader<Message>>(now_->readers).damaged();
  }
  std::uint64_t damaged() const { return damaged_before_ + (std::uint64_t{0} + ... + damaged<R>()); }

  bool overslept() const { return now_->participant.overslept(); }

  // Joins the session anew when the program has slept for longer than its lease; true when it has done so. The former
  // participant stays until the new one has met somebody: if it left sooner, others would believe that the program has
  // left. When no participant can be made, the next call tries again.
  bool renew_after_sleep() {
    if (former_ && met()) former_.reset();
    if (!overslept()) return false;
    try {
      auto fresh = std::make_unique<Set>(options_, name_);
      damaged_before_ = damaged();
      former_ = std::exchange(now_, std::move(fresh));
    } catch (const std::exception& error) {
      log_limited(LogLevel::warning, "renew",
                  std::string("was asleep, and can't join the session anew: ") + error.what());
      return false;
    }
    log_info("was asleep: joining the session anew");
    return true;
  }

 private:
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
  std::uint64_t damaged_before_ = 0;
};

}  // namespace sectio
