// A program's place in a DDS domain. By default it speaks UDP on loopback only: no multicast, no shared memory.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/sleep_watch.h"
#include "common/dds/announcement.h"
#include "common/messages/epoch_owners.h"
#include "common/messages/protocol.h"

namespace sectio {

constexpr std::uint32_t kMaxDomain = 231;  // RTPS has 232, where 64 programs on a host need ports beyond 65535
constexpr const char* kServerName = "sim_server";

struct NetworkOptions {
  std::uint32_t domain = 0;
  std::string session;  // sessions of one domain don't see each other; empty: find_session() fills it in
  // For several machines: IPv4 addresses or names of the other hosts, addresses of the interfaces to use (none: all).
  std::vector<std::string> peers;
  std::vector<std::string> interfaces;
  // A directory that deploy/keys has made; empty: the one of SECTIO_KEYS in the environment, if any (keys.h).
  std::string keys = {};
  bool insecure = false;                      // the session may leave this machine without keys
  std::uint32_t protocol = kProtocolVersion;  // another one in tests only

  bool off_host() const { return !peers.empty() || !interfaces.empty(); }
};

// Throws InputError, naming the flag, for options with which no participant can be made: off this host, a session has
// keys, unless somebody has said that it is to be open.
void check_network_options(const NetworkOptions& options);

// The partition of all endpoints of a session: "theatre/3" for version 3 of the wire. Endpoints in different partitions
// don't match, so that programs of different versions never decode each other's messages.
std::string partition_of(const NetworkOptions& options);

struct Peer {
  std::string name;
  std::optional<Announcement> announcement;  // nothing: a program of somebody else
};

class Participant {
 public:
  // By its name, other programs recognise a program that has made a new participant. Throws InputError for bad options,
  // and when no socket can be opened.
  Participant(const NetworkOptions& options, const std::string& name);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  bool off_host() const;
  bool secured() const;

  // The programs of this project in the domain, whatever their session; with keys, those with good
  // keys of their own. Any thread.
  std::vector<Peer> peers() const;

  // The id by which samples of this participant name their sender.
  ProgramId id() const;
  // Whether a program is in the domain and has not been dropped. Any thread.
  bool is_there(const ProgramId& program) const;

  // The program slept until its lease had run out. The other programs have dropped it, and Fast DDS takes seconds to
  // make up for that, or never does. A new participant is there at once.
  bool overslept() const { return sleep_watch_.overslept(); }

  // The readers of this participant hear these channels from now on, in the topics that have channels (qos.h); before
  // the first call they hear the first channel of each topic. For the thread that reads.
  void hear(const std::vector<std::string>& channels);

  struct Parts;  // parts.h
  Parts& parts() { return *parts_; }

 private:
  std::unique_ptr<Parts> parts_;
  SleepWatch sleep_watch_;
};

}  // namespace sectio
