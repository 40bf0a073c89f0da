#include "sim_server/world/step_io.h"

namespace sectio {

const char* to_string(EventKind kind) {
  switch (kind) {
    case EventKind::contact_began:
      return "contact began";
    case EventKind::contact_ended:
      return "contact ended";
    case EventKind::penetrated:
      return "penetrated";
    case EventKind::cut_ended:
      return "cut ended";
    case EventKind::joined:
      return "joined";
    case EventKind::island_freed:
      return "island freed";
    case EventKind::cut_refused:
      return "cut refused";
    case EventKind::did_not_cut:
      return "did not cut";
    case EventKind::step_overrun:
      return "step overrun";
    case EventKind::driver_taken_over:
      return "driver_taken_over";
    case EventKind::driver_handed_back:
      return "driver_handed_back";
    case EventKind::paused:
      return "paused";
    case EventKind::went_on:
      return "went on";
    case EventKind::speed_set:
      return "speed set";
    case EventKind::begun_anew:
      return "begun anew";
    case EventKind::score_told:
      return "score told";
    case EventKind::sought:
      return "sought";
    case EventKind::gravity_turned:
      return "gravity turned";
    case EventKind::body_frozen:
      return "body frozen";
    case EventKind::body_recovered:
      return "body recovered";
    case EventKind::left_world:
      return "left the world";
    case EventKind::body_thawed:
      return "body thawed";
    case EventKind::mass_added:
      return "mass added";
    case EventKind::force_capped:
      return "force capped";
    case EventKind::body_split:
      return "body split";
    case EventKind::fragment_removed:
      return "fragment removed";
    case EventKind::grasped:
      return "grasped";
    case EventKind::released:
      return "released";
    case EventKind::instrument_withdrawn:
      return "instrument withdrawn";
    case EventKind::instrument_frozen:
      return "instrument frozen";
    case EventKind::instrument_thawed:
      return "instrument thawed";
    case EventKind::order_refused:
      return "order refused";
    case EventKind::island_kept:
      return "island kept";
    case EventKind::recording_stopped:
      return "recording stopped";
  }
  return "?";
}

void begin_step(StepOutput& output, double step_s) {
  ++output.step;
  output.sim_time_s = static_cast<double>(output.step) * step_s;
  output.deltas.clear();
  output.new_bodies.clear();
  output.contacts.clear();
  output.events.clear();
  output.publish_now = false;
}

}  // namespace sectio
