#include "common/dds/network_arguments.h"

namespace sectio {

void add_network_arguments(Arguments& arguments, NetworkOptions& options, const std::string& session_help) {
  arguments.option("--session", options.session, session_help);
  arguments.option("--domain", options.domain, "DDS domain, 0 to 231");
  arguments.option("--peer", options.peers, "IPv4 address or name of another host; may be repeated");
  arguments.option("--interface", options.interfaces, "IPv4 address of a network interface to use; may be repeated");
  arguments.option("--keys", options.keys,
                   "directory with the keys of this program (deploy/keys, or sectio_keys, makes them); empty: the one "
                   "that SECTIO_KEYS names, if any");
  arguments.toggle("--insecure", options.insecure,
                   "lets an open session leave this machine: whoever reaches it sees, moves and orders everything");
}

}  // namespace sectio
