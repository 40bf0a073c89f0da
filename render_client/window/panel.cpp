#include "render_client/window/panel.h"

#include <imgui.h>

#include <algorithm>

#include "render_client/draw/colour_map.h"

namespace sectio {

namespace {

constexpr float kMargin_px = 12, kWidth_px = 300;
const ImVec4 kGood{0.45f, 0.85f, 0.5f, 1}, kBad{1, 0.4f, 0.35f, 1}, kFaint{0.62f, 0.66f, 0.7f, 1};

void show_text(const std::string& text) {
  ImGui::TextUnformatted(text.data(), text.data() + text.size());
}

// True when the person has changed it.
bool box(const char* label, bool value) {
  return ImGui::Checkbox(label, &value);
}

void show_session(const PanelView& view) {
  show_text(view.session);
  ImGui::Text("%.3f s   %.2f ms/step%s", view.sim_time_s, 1e3 * view.step_wall_time_s,
              view.in_contact ? "   in contact" : "");
  ImGui::Text("%.0f pictures/s", view.pictures_per_s);
  if (!view.state_age_s) return;
  ImGui::SameLine();
  ImGui::Text("  states %.0f ms old", 1e3 * *view.state_age_s);
}

// The slider follows the session's time until it is dragged, and orders when it is let go.
void show_lead(const PanelView::Lead& lead, WindowInput& input) {
  constexpr float kFollows = -1;
  const auto now_s = static_cast<float>(lead.sim_time_s);
  ImGuiStorage& kept = *ImGui::GetStateStorage();
  const ImGuiID dragged = ImGui::GetID("dragged to, s");
  float to_s = kept.GetFloat(dragged, kFollows);
  if (to_s == kFollows) to_s = now_s;
  ImGui::SliderFloat("go to", &to_s, 0, std::max(1.0f, now_s), "%.1f s",
                     ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_NoInput);
  if (ImGui::IsItemDeactivatedAfterEdit()) input.goes_to_s = static_cast<double>(to_s);
  kept.SetFloat(dragged, ImGui::IsItemActive() ? to_s : kFollows);
  input.goes_back = ImGui::Button("10 s back (Backspace)");
  ImGui::SameLine();
  input.pauses = ImGui::Button(lead.is_paused ? "Go on (Enter)" : "Pause (Enter)");
}

void show_bodies(const PanelView& view) {
  for (const PanelView::Body& body : view.bodies) {
    show_text(body.name + " r" + std::to_string(body.revision));
    ImGui::SameLine();
    if (!body.equals_server)
      ImGui::TextColored(kFaint, "not compared yet");
    else
      ImGui::TextColored(*body.equals_server ? kGood : kBad, "equals server: %s", *body.equals_server ? "yes" : "NO");
  }
}

void show_instruments(const PanelView& view, WindowInput& input) {
  ImGui::TextColored(kFaint, "Follow");
  for (std::size_t i = 0; i < view.instruments.size(); ++i) {
    const PanelView::Instrument& tool = view.instruments[i];
    ImGui::PushID(static_cast<int>(i));
    if (box(tool.name.c_str(), view.followed == i)) input.follows = i;
    ImGui::SameLine(0.6f * kWidth_px);
    if (!tool.present)
      ImGui::TextColored(kFaint, "not there");
    else if (tool.force_n)
      ImGui::Text("%.2f N", *tool.force_n);
    ImGui::PopID();
  }
}

void show_section(const PanelView& view, WindowInput& input) {
  input.section = box("Section (C)", view.section_depth_m.has_value());
  if (!view.section_depth_m) return;
  auto depth_mm = static_cast<float>(1e3 * *view.section_depth_m);
  const auto most_mm = static_cast<float>(1e3 * view.most_section_depth_m);
  if (ImGui::SliderFloat("depth", &depth_mm, -most_mm, most_mm, "%.1f mm"))
    input.section_nearer_m = *view.section_depth_m - 1e-3 * static_cast<double>(depth_mm);
}

// The colours of a field between the ends of its range.
void show_legend(const FieldRange& range) {
  constexpr int kSteps = 32;
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const float step = 0.8f * kWidth_px / kSteps, height = ImGui::GetTextLineHeight();
  for (int i = 0; i < kSteps; ++i) {
    const Colour c = map_colour(static_cast<float>(i) / (kSteps - 1));
    const float left = corner.x + step * static_cast<float>(i);
    ImGui::GetWindowDrawList()->AddRectFilled({left, corner.y}, {left + step, corner.y + height},
                                              IM_COL32(c.r, c.g, c.b, 255));
  }
  ImGui::Dummy({step * kSteps, height});
  ImGui::Text("%.4g to %.4g", static_cast<double>(range.least), static_cast<double>(range.most));
}

void show_fields(const PanelView& view, WindowInput& input) {
  if (view.fields.empty()) return;
  ImGui::TextColored(kFaint, "Colours (V)");
  if (ImGui::RadioButton("tissue", view.field.empty())) input.field = "";
  for (const std::string& name : view.fields)
    if (ImGui::RadioButton(name.c_str(), view.field == name)) input.field = name;
  if (!view.field.empty() && view.field_range) show_legend(*view.field_range);
}

void show_view(const PanelView& view, WindowInput& input) {
  input.halts = box("Halt (Space)", view.halted);
  input.wireframe = box("Wireframe (W)", view.wireframe);
  show_section(view, input);
  input.stereo = box("Stereo (S)", view.stereo);
  input.full_screen = box("Full screen (F)", view.full_screen);
  show_fields(view, input);
  input.keeps_picture = ImGui::Button("Keep picture (P)");
  ImGui::SameLine();
  input.home = ImGui::Button("First view (Home)");
}

}  // namespace

PanelShown show_panel(const PanelView& view) {
  PanelShown shown;
  ImGui::SetNextWindowPos({kMargin_px, kMargin_px}, ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowSize({kWidth_px, 0}, ImGuiCond_Always);
  ImGui::SetNextWindowBgAlpha(0.75f);
  ImGui::Begin("Panel (H hides it)", nullptr, ImGuiWindowFlags_NoResize);
  show_session(view);
  if (view.lead) show_lead(*view.lead, shown.input);
  show_bodies(view);
  ImGui::Separator();
  if (!view.instruments.empty()) {
    show_instruments(view, shown.input);
    ImGui::Separator();
  }
  show_view(view, shown.input);
  if (!view.events.empty()) ImGui::Separator();
  ImGui::PushTextWrapPos(0);
  for (const std::string& event : view.events) show_text(event);
  ImGui::PopTextWrapPos();
  const ImVec2 corner = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
  shown.place = {static_cast<int>(corner.x), static_cast<int>(corner.y), static_cast<int>(size.x),
                 static_cast<int>(size.y)};
  ImGui::End();
  return shown;
}

}  // namespace sectio
