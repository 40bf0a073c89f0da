#include <cstdio>

#include "common/core/error.h"
#include "common/core/formatted.h"
#include "common/dds/network_arguments.h"
#include "sim_server/commands/commands.h"
#include "sim_server/net/status.h"

namespace sectio {

Arguments::Action status_command(Arguments& arguments) {
  struct Flags {
    NetworkOptions network;
    double patience_s = 5;
    bool every_field = false;
    std::string body;
  };
  const auto flags = std::make_shared<Flags>();
  add_network_arguments(arguments, flags->network, "session; empty: the only one of the domain");
  arguments.option("--patience-s", flags->patience_s, "how long to wait for an answer of the servers");
  arguments.toggle("--every-field", flags->every_field, "print all that the servers say of themselves, as it comes");
  arguments.option("--body", flags->body, "a server of this body must answer; empty: any one");
  return [flags] {
    if (!(flags->patience_s > 0)) throw InputError(formatted("--patience-s: expected > 0, got %g", flags->patience_s));
    check_network_options(flags->network);
    std::fputs(status_of_session(flags->network, flags->patience_s, flags->every_field, flags->body).c_str(), stdout);
    return 0;
  };
}

}  // namespace sectio
