#include "render_client/net/session_leader.h"

#include "common/core/log.h"
#include "common/core/unique_id.h"
#include "common/dds/endpoints.h"

namespace sectio {

struct SessionLeader::Wire {
  Endpoints<Reads<>, Writes<SessionOrder>> endpoints;
};

SessionLeader::SessionLeader(const NetworkOptions& options) : wire_(new Wire{{options, "render_client orders"}}) {}

SessionLeader::~SessionLeader() = default;

void SessionLeader::poll() {
  wire_->endpoints.renew_after_sleep();
}

void SessionLeader::give(SessionOrder order) {
  order.source = unique_id(kProgramIdBits);
  if (wire_->endpoints.writer<SessionOrder>().readers() == 0)
    log_warning("no server hears the order");
  else if (!wire_->endpoints.write(order))
    log_warning("DDS refused to send the order");
}

}  // namespace sectio
