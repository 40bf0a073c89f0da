// Orders to the servers of a running session.

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/core/most_gravity.h"
#include "common/dds/network_arguments.h"
#include "sim_server/commands/commands.h"
#include "sim_server/net/order.h"

namespace sectio {
namespace {

struct OrderFlags {
  NetworkOptions network;
  SessionOrder order;
  std::string flag;  // says what is wanted
  std::string gravity;
  double patience_s = 5;
};

Vec3 gravity_of(const std::string& text) {
  Vec3 gravity;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%lf,%lf,%lf%c", &gravity.x(), &gravity.y(), &gravity.z(), &rest) != 3 ||
      !gravity.allFinite() || !(gravity.cwiseAbs().maxCoeff() <= kMostGravity_m_per_s2))
    throw InputError(formatted("--gravity: expected x,y,z in m/s2, each from -%g to %g, got %s", kMostGravity_m_per_s2,
                               kMostGravity_m_per_s2, text.c_str()));
  return gravity;
}

std::shared_ptr<OrderFlags> order_flags(Arguments& arguments, OrderKind kind) {
  auto flags = std::make_shared<OrderFlags>();
  flags->order.kind = kind;
  add_network_arguments(arguments, flags->network, "session; empty: the only one of the domain");
  arguments.option("--patience-s", flags->patience_s, "how long to wait for an answer of the servers");
  return flags;
}

template <class T>
void want(Arguments& arguments, OrderFlags& flags, const std::string& flag, T& value, const std::string& meaning) {
  flags.flag = flag;
  arguments.option(flag, value, meaning, Need::required);
}

Arguments::Action giving(const std::shared_ptr<OrderFlags>& flags) {
  return [flags] {
    if (!flags->gravity.empty()) flags->order.gravity_m_per_s2 = gravity_of(flags->gravity);
    if (!(flags->patience_s > 0)) throw InputError(formatted("--patience-s: expected > 0, got %g", flags->patience_s));
    check_network_options(flags->network);
    give_order(flags->network, flags->order, flags->patience_s, flags->flag);
    return 0;
  };
}

Arguments::Action tool_command(Arguments& arguments, OrderKind kind) {
  const auto flags = order_flags(arguments, kind);
  want(arguments, *flags, "--tool-id", flags->order.tool_id, "number of the instrument in the scene, from 0");
  return giving(flags);
}

}  // namespace

Arguments::Action tilt_command(Arguments& arguments) {
  const auto flags = order_flags(arguments, OrderKind::tilt);
  want(arguments, *flags, "--gravity", flags->gravity, "where to: x,y,z in m/s2");
  return giving(flags);
}

Arguments::Action pause_command(Arguments& arguments) {
  return giving(order_flags(arguments, OrderKind::pause));
}

Arguments::Action go_on_command(Arguments& arguments) {
  return giving(order_flags(arguments, OrderKind::go_on));
}

Arguments::Action speed_command(Arguments& arguments) {
  const auto flags = order_flags(arguments, OrderKind::set_speed);
  want(arguments, *flags, "--factor", flags->order.speed, "of simulated time, compared with the clock: 0.01 to 10");
  return giving(flags);
}

Arguments::Action anew_command(Arguments& arguments) {
  return giving(order_flags(arguments, OrderKind::begin_anew));
}

Arguments::Action seek_command(Arguments& arguments) {
  const auto flags = order_flags(arguments, OrderKind::seek);
  want(arguments, *flags, "--to-s", flags->order.sim_time_s,
       "simulated time from which a session goes on again, or a record that is played is shown");
  return giving(flags);
}

Arguments::Action freeze_command(Arguments& arguments) {
  return tool_command(arguments, OrderKind::freeze);
}

Arguments::Action thaw_command(Arguments& arguments) {
  return tool_command(arguments, OrderKind::thaw);
}

Arguments::Action score_command(Arguments& arguments) {
  return giving(order_flags(arguments, OrderKind::tell_score));
}

}  // namespace sectio
