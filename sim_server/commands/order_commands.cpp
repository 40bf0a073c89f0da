#include <cstdio>

#include "common/core/error.h"
#include "common/dds/network_arguments.h"
#include "sim_server/commands/commands.h"
#include "sim_server/net/tilt.h"

namespace sectio {
namespace {

Vec3 gravity_of(const std::string& text) {
  Vec3 gravity;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%lf,%lf,%lf%c", &gravity.x(), &gravity.y(), &gravity.z(), &rest) != 3 ||
      !gravity.allFinite())
    throw InputError("--gravity: expected x,y,z in m/s2, got " + text);
  return gravity;
}

}  // namespace

Arguments::Action tilt_command(Arguments& arguments) {
  struct Flags {
    NetworkOptions network;
    std::string gravity;
    double patience_s = 5;
  };
  const auto flags = std::make_shared<Flags>();
  arguments.option("--gravity", flags->gravity, "where to: x,y,z in m/s2", Need::required);
  add_network_arguments(arguments, flags->network, "session; empty: the only one of the domain");
  arguments.option("--patience-s", flags->patience_s, "how long to wait for an answer of the servers");
  return [flags] {
    const Vec3 gravity = gravity_of(flags->gravity);
    check_network_options(flags->network);
    request_gravity(flags->network, gravity, flags->patience_s);
    return 0;
  };
}

}  // namespace sectio
