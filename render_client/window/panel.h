// The panel of a window: the widgets over plain values, drawn by Dear ImGui in whatever context is current.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "render_client/draw/image.h"
#include "render_client/draw/overlay.h"
#include "render_client/window/viewpoint.h"

namespace sectio {

struct PanelView {
  struct Body {
    std::string name;
    std::uint64_t revision = 0;
    std::optional<bool> equals_server = {};  // when both were last at the same revision
  };
  struct Instrument {
    std::string name;
    bool present = false;
    std::optional<double> force_n = {};  // at its tip; empty: nothing has been heard of it
  };

  struct Lead {
    double sim_time_s = 0;  // how far the session has come
    bool is_paused = false;
  };

  std::string session;
  std::optional<Lead> lead = {};  // empty: the person at the window doesn't lead
  double sim_time_s = 0;
  double step_wall_time_s = 0;
  double pictures_per_s = 0;
  std::optional<double> state_age_s = {};  // between the server's clock and this program
  bool in_contact = false;
  std::vector<Body> bodies;
  std::vector<Instrument> instruments;
  std::vector<std::string> events;  // the last ones, newest last

  // The picture as it is now.
  bool halted = false, wireframe = false, stereo = false, full_screen = false;
  std::optional<std::size_t> followed = {};
  std::optional<double> section_depth_m = {};  // empty: no section
  double most_section_depth_m = 0;
  std::vector<std::string> fields;
  std::string field;  // shown in colours; empty: tissue
  std::optional<FieldRange> field_range = {};
};

struct PanelShown {
  WindowInput input;  // done by the person at the panel
  Rect place;         // in the window
};
// Between ImGui::NewFrame() and ImGui::Render().
PanelShown show_panel(const PanelView& view);

}  // namespace sectio
