#include "render_client/net/tip_forces.h"

#include "common/dds/endpoints.h"
#include "common/messages/contact.h"
#include "render_client/replica/fading_forces.h"

namespace sectio {

struct TipForces::Wire {
  Endpoints<Reads<SceneInfo, ContactMessage>, Writes<>> endpoints;
  FadingForces forces = {};
};

TipForces::TipForces(const NetworkOptions& options) : wire_(new Wire{{options, "render_client forces"}}) {}

TipForces::~TipForces() = default;

void TipForces::poll(double now_s) {
  wire_->endpoints.renew_after_sleep();
  while (wire_->endpoints.take<SceneInfo>()) {
    // the endpoints learn from it whose contacts to believe
  }
  while (const auto contact = wire_->endpoints.take<ContactMessage>()) wire_->forces.hear(contact->model, now_s);
}

std::optional<double> TipForces::force_n(std::uint32_t tool_id, double now_s) const {
  return wire_->forces.force_n(tool_id, now_s);
}

}  // namespace sectio
