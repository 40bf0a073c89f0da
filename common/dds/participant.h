// One program's seat at the table. By default it speaks UDP on loopback only: no multicast, no shared memory.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/core/sleep_watch.h"

namespace sectio {

constexpr std::uint32_t kMaxDomain = 232;  // by the port formula of RTPS

struct NetworkOptions {
  std::uint32_t domain = 0;
  std::string session = "session";  // sessions in one domain don't see each other
  // For several machines: IPv4 addresses of the other hosts, and of the interfaces to use (none: all).
  std::vector<std::string> peers;
  std::vector<std::string> interfaces;

  bool off_host() const { return !peers.empty() || !interfaces.empty(); }
};

// Throws InputError, naming the flag, for what no participant can be made of.
void check_network_options(const NetworkOptions& options);

class Participant {
 public:
  // Others tell by its name that one which is made anew is the same program. Throws InputError for bad options, and
  // when no socket can be opened.
  Participant(const NetworkOptions& options, const std::string& name);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  bool off_host() const;

  // Its lease has run out while the program slept. Others have given it up and what each knows of the other no longer
  // fits; Fast DDS takes seconds to find out, or does not. A new one is there at once.
  bool overslept() const { return sleep_watch_.overslept(); }

  struct Parts;  // endpoint.cpp
  Parts& parts() { return *parts_; }

 private:
  std::unique_ptr<Parts> parts_;
  SleepWatch sleep_watch_;
};

}  // namespace sectio
