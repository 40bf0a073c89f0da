// The number of a program among those of its host in a domain. From it follow the UDP ports at which peers look for the
// program, so that no two programs may have the same one.
//
// A port that is free now may be taken by another program before Fast DDS opens it. A number is therefore reserved, by
// a name that only one program of a host can hold, from when it is chosen until its program ends, however it ends.
#pragma once

#include <cstdint>

#include "common/dds/participant.h"

namespace sectio {

// The programs of a host whose discovery ports are tried: on this host, and on each peer. Two programs meet when one of
// them finds the other, and each try is a packet on the link: off this host, a program beyond the first 16 meets those
// of another host that are among its first 16.
constexpr std::uint32_t kProgramsOnHost = 64;
constexpr std::uint32_t kProgramsTriedOffHost = 16;

class ProgramNumber {
 public:
  // Reserves a number whose discovery port is free, among those that peers try. Fast DDS would take a higher one, at
  // which nobody looks for this program. Throws InputError when all are taken. Any thread.
  explicit ProgramNumber(const NetworkOptions& options);
  ~ProgramNumber();
  ProgramNumber(const ProgramNumber&) = delete;
  ProgramNumber& operator=(const ProgramNumber&) = delete;

  std::int32_t value() const { return value_; }

 private:
  std::int32_t value_ = 0;
  int reservation_ = -1;  // a socket with the name of the number; -1: none, where programs may not have one
};

}  // namespace sectio
