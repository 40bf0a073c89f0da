#include "sim_server/net/serve.h"

#include "sim_server/net/live_server.h"

namespace sectio {

RunResult serve(const Scene& scene, const ServeOptions& options) {
  catch_stop_signals();
  return LiveServer(scene, options).run();
}

}  // namespace sectio
