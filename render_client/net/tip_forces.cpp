#include "render_client/net/tip_forces.h"

#include <map>

#include "common/dds/endpoints.h"
#include "common/messages/contact.h"

namespace sectio {

struct TipForces::Wire {
  struct Force {
    double newton = 0, heard_s = 0;
  };
  Endpoints<Reads<SceneInfo, ContactMessage>, Writes<>> endpoints;
  std::map<std::uint32_t, Force> by_tool = {};
};

TipForces::TipForces(const NetworkOptions& options) : wire_(new Wire{{options, "render_client forces"}}) {}

TipForces::~TipForces() = default;

void TipForces::poll(double now_s) {
  wire_->endpoints.renew_after_sleep();
  while (wire_->endpoints.take<SceneInfo>()) {
    // the endpoints learn from it whose contacts to believe
  }
  while (const auto contact = wire_->endpoints.take<ContactMessage>())
    wire_->by_tool[contact->model.tool_id] = {contact->model.force_world_n.norm(), now_s};
}

std::optional<double> TipForces::force_n(std::uint32_t tool_id, double now_s) const {
  const auto force = wire_->by_tool.find(tool_id);
  if (force == wire_->by_tool.end()) return std::nullopt;
  return now_s - force->second.heard_s > kFades_s ? 0 : force->second.newton;
}

}  // namespace sectio
