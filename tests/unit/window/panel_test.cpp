// The panel without a screen: its widgets are laid out, read as text, and clicked.
#include "render_client/window/panel.h"

#include <gtest/gtest.h>
#include <imgui.h>

#include <map>
#include <optional>
#include <string>

namespace sectio::window_test {
namespace {

class Panel : public testing::Test {
 protected:
  Panel() {
    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.DisplaySize = {800, 900};
    unsigned char* letters = nullptr;
    int width_px = 0, height_px = 0;
    io.Fonts->GetTexDataAsRGBA32(&letters, &width_px, &height_px);
    io.ClipboardUserData = &text_;
    io.SetClipboardTextFn = [](void* text, const char* shown) { *static_cast<std::string*>(text) = shown; };
    view.session = "ward";
    view.instruments = {{"scalpel", true, 1.25}, {"hook", false}};
    for (int i = 0; i < 3; ++i) frame();  // sizes are known after two
  }
  ~Panel() override { ImGui::DestroyContext(); }

  WindowInput frame(bool read = false) {
    ImGui::GetIO().DeltaTime = 0.02f;
    ImGui::NewFrame();
    if (read) ImGui::LogToClipboard();
    const PanelShown shown = show_panel(view);
    if (read) ImGui::LogFinish();
    ImGui::Render();
    place = shown.place;
    return shown.input;
  }
  std::string text() {
    frame(true);
    return text_;
  }
  bool says(const std::string& words) { return text().find(words) != std::string::npos; }

  WindowInput click(float x_px, float y_px) {
    ImGuiIO& io = ImGui::GetIO();
    io.MousePos = {x_px, y_px};
    WindowInput all = frame();
    for (const bool down : {true, false}) {
      io.MouseDown[0] = down;
      all.add(frame());
    }
    return all;
  }
  // How often clicks here and there beneath the title lead to something.
  std::map<std::string, int> click_everywhere() {
    std::map<std::string, int> times;
    for (float y_px = 45; y_px < 900; y_px += 5)
      for (const float x_px : {30.0f, 200.0f}) {
        const WindowInput input = click(x_px, y_px);
        const std::pair<const char*, bool> done[] = {
            {"halt", input.halts},         {"wireframe", input.wireframe},        {"section", input.section},
            {"stereo", input.stereo},      {"keep", input.keeps_picture},         {"full screen", input.full_screen},
            {"home", input.home},          {"follow 0", input.follows == 0u},     {"follow 1", input.follows == 1u},
            {"tissue", input.field == ""}, {"wetness", input.field == "wetness"}, {"close", input.closes}};
        for (const auto& [name, is_done] : done)
          if (is_done) ++times[name];
      }
    return times;
  }

  PanelView view;
  Rect place;

 private:
  std::string text_;
};

TEST_F(Panel, tells_what_it_is_given) {
  view.sim_time_s = 1.5;
  view.pictures_per_s = 31;
  view.state_age_s = 0.012;
  view.bodies = {{"liver", 7, true}, {"kidney", 3, false}, {"vessel", 1, std::nullopt}};
  view.events = {"cut through", "let go"};
  EXPECT_TRUE(says("ward"));
  for (const char* words :
       {"1.500 s", "31 pictures/s", "states 12 ms old", "liver r7 equals server: yes", "kidney r3 equals server: NO",
        "vessel r1 not compared yet", "scalpel", "1.25 N", "hook", "not there", "cut through", "let go"})
    EXPECT_TRUE(says(words)) << words << " in\n" << text();
  EXPECT_FALSE(says("Colours")) << "no body has a field";
}

TEST_F(Panel, offers_by_clicks_what_keys_do) {
  view.fields = {"wetness"};
  const std::map<std::string, int> times = click_everywhere();
  for (const char* name : {"halt", "wireframe", "section", "stereo", "keep", "full screen", "home", "follow 0",
                           "follow 1", "tissue", "wetness"})
    EXPECT_TRUE(times.contains(name)) << name;
  EXPECT_FALSE(times.contains("close"));
}

TEST_F(Panel, a_slider_moves_the_section_nearer_and_deeper) {
  EXPECT_FALSE(says("depth"));
  view.section_depth_m = 0;
  view.most_section_depth_m = 0.1;
  EXPECT_TRUE(says("depth"));
  double nearest_m = 0, deepest_m = 0;
  for (float y_px = 45; y_px < 900; y_px += 5)
    for (const float x_px : {30.0f, 190.0f}) {
      const double nearer_m = click(x_px, y_px).section_nearer_m;
      nearest_m = std::max(nearest_m, nearer_m);
      deepest_m = std::min(deepest_m, nearer_m);
    }
  EXPECT_GT(nearest_m, 0.05) << "at its left";
  EXPECT_LT(deepest_m, -0.05) << "at its right";
}

TEST_F(Panel, offers_time_to_those_who_lead_alone) {
  EXPECT_FALSE(says("go to"));
  view.lead = PanelView::Lead{42.5, false};
  for (const char* words : {"42.5 s", "go to", "10 s back", "Pause"}) EXPECT_TRUE(says(words)) << words;
  view.lead->is_paused = true;
  EXPECT_TRUE(says("Go on"));
  int back = 0, pauses = 0;
  for (float y_px = 45; y_px < 900; y_px += 5)
    for (const float x_px : {30.0f, 220.0f}) {
      const WindowInput input = click(x_px, y_px);
      back += input.goes_back;
      pauses += input.pauses;
    }
  EXPECT_GT(back, 0);
  EXPECT_GT(pauses, 0);
}

TEST_F(Panel, a_slider_that_is_let_go_names_the_time_to_go_to_once_however_the_session_goes_on) {
  view.lead = PanelView::Lead{100, false};
  frame();
  ImGuiIO& io = ImGui::GetIO();
  io.ConfigWindowsMoveFromTitleBarOnly = true;  // a drag beside the slider leaves the panel in its place
  std::optional<double> gone_s;
  for (float y_px = 45; y_px < 300 && !gone_s; y_px += 5) {
    io.MousePos = {180, y_px};
    frame();
    io.MouseDown[0] = true;
    int orders = frame().goes_to_s.has_value();
    for (const float x_px : {150.0f, 90.0f, 75.0f, 75.0f}) {
      io.MousePos.x = x_px;
      view.lead->sim_time_s += 0.02;
      orders += frame().goes_to_s.has_value();
    }
    EXPECT_EQ(orders, 0) << "the button is down";
    io.MouseDown[0] = false;
    gone_s = frame().goes_to_s;
    EXPECT_FALSE(frame().goes_to_s);
  }
  ASSERT_TRUE(gone_s);
  EXPECT_GT(*gone_s, 15) << "a third of the way";
  EXPECT_LT(*gone_s, 45);
  EXPECT_TRUE(says(std::to_string(view.lead->sim_time_s).substr(0, 5) + " s")) << "it follows the session again";
}

TEST_F(Panel, tells_where_it_is_and_takes_no_keys) {
  click(static_cast<float>(place.x_px + place.width_px - 3), static_cast<float>(place.y_px + place.height_px - 3));
  EXPECT_TRUE(ImGui::GetIO().WantCaptureMouse);
  click(static_cast<float>(place.x_px + place.width_px + 3), 60);
  EXPECT_FALSE(ImGui::GetIO().WantCaptureMouse);
  EXPECT_FALSE(ImGui::GetIO().WantCaptureKeyboard);
}

TEST_F(Panel, shows_the_colours_of_a_field_and_its_range) {
  view.fields = {"wetness"};
  view.field = "wetness";
  view.field_range = FieldRange{0, 0.75f};
  EXPECT_TRUE(says("0 to 0.75"));
  view.field.clear();
  EXPECT_FALSE(says("0 to 0.75"));
}

}  // namespace
}  // namespace sectio::window_test
