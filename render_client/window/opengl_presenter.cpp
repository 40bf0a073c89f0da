#include <SDL2/SDL.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <cstdlib>
#include <string>

#include "common/core/error.h"
#include "common/core/log.h"
#include "render_client/draw/gl_canvas.h"
#include "render_client/draw/gl_functions.h"
#include "render_client/window/presenter.h"

namespace sectio {

namespace {

class WindowContext final : public GlContext {
 public:
  explicit WindowContext(SDL_Window& window) : window_(window), context_(SDL_GL_CreateContext(&window)) {
    if (!context_) throw InputError(std::string("--canvas window: this display has no OpenGL 3.3: ") + SDL_GetError());
    functions_ = std::make_unique<GlFunctions>(SDL_GL_GetProcAddress);
    log_info("the window draws by " + std::string(reinterpret_cast<const char*>(functions_->GetString(GL_RENDERER))));
    SDL_GL_SetSwapInterval(0);  // the program has a pace of its own
    fit();
  }
  ~WindowContext() override { SDL_GL_DeleteContext(context_); }
  WindowContext(const WindowContext&) = delete;
  WindowContext& operator=(const WindowContext&) = delete;

  void fit() {
    const int before_px = picture_.width_px * picture_.height_px;
    SDL_GL_GetDrawableSize(&window_, &picture_.width_px, &picture_.height_px);
    if (before_px != picture_.width_px * picture_.height_px) want_pixels(!picture_.rgba.empty());
  }
  void want_pixels(bool wanted) {
    const std::size_t bytes =
        wanted ? 4 * static_cast<std::size_t>(picture_.width_px) * static_cast<std::size_t>(picture_.height_px) : 0;
    if (picture_.rgba.size() != bytes) picture_.rgba.resize(bytes);
  }
  void make_current() override {
    if (SDL_GL_GetCurrentContext() != context_) SDL_GL_MakeCurrent(&window_, context_);
  }
  const GlFunctions& functions() const override { return *functions_; }
  Image& picture() override { return picture_; }
  void finish(const GlTarget& part) override { read_pixels(*functions_, part, picture_); }

 private:
  SDL_Window& window_;
  SDL_GLContext context_;
  std::unique_ptr<GlFunctions> functions_;
  Image picture_;
};

class OpenGlWindow final : public Presenter {
 public:
  OpenGlWindow(SDL_Window& window, WindowContext& context) : window_(window), context_(context) {
    ImGui_ImplOpenGL3_Init("#version 330 core");
    ImGui_ImplOpenGL3_NewFrame();  // makes the texture of letters
  }
  ~OpenGlWindow() override { ImGui_ImplOpenGL3_Shutdown(); }
  OpenGlWindow(const OpenGlWindow&) = delete;
  OpenGlWindow& operator=(const OpenGlWindow&) = delete;

  void fit() override { context_.fit(); }
  void want_pixels(bool wanted) override { context_.want_pixels(wanted); }
  void show(const Image&, ImDrawData& widgets) override {
    context_.functions().BindFramebuffer(GL_FRAMEBUFFER, 0);
    ImGui_ImplOpenGL3_RenderDrawData(&widgets);
    SDL_GL_SwapWindow(&window_);
  }

 private:
  SDL_Window& window_;
  WindowContext& context_;
};

}  // namespace

void ask_for_opengl() {
  setenv("LP_NUM_THREADS", "1", 0);
  for (const auto& [attribute, value] : {std::pair{SDL_GL_CONTEXT_MAJOR_VERSION, 3},
                                         {SDL_GL_CONTEXT_MINOR_VERSION, 3},
                                         {SDL_GL_CONTEXT_PROFILE_MASK, static_cast<int>(SDL_GL_CONTEXT_PROFILE_CORE)},
                                         {SDL_GL_DEPTH_SIZE, 24},
                                         {SDL_GL_DOUBLEBUFFER, 1}})
    SDL_GL_SetAttribute(attribute, value);
}

OpenGlPresenter make_opengl_presenter(SDL_Window& window, int samples_per_pixel) {
  auto context = std::make_unique<WindowContext>(window);
  WindowContext& c = *context;
  check_canvas(c.picture().width_px, c.picture().height_px, samples_per_pixel);
  OpenGlPresenter made;
  made.canvas = make_gl_canvas(std::move(context), samples_per_pixel);
  made.presenter = std::make_unique<OpenGlWindow>(window, c);
  return made;
}

}  // namespace sectio
