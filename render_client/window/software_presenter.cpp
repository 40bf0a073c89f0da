#include <SDL2/SDL.h>
#include <imgui.h>

#include <algorithm>
#include <string>

#include "common/core/error.h"
#include "render_client/window/presenter.h"

namespace sectio {

namespace {

class SoftwarePresenter final : public Presenter {
 public:
  explicit SoftwarePresenter(SDL_Window& window) : renderer_(SDL_CreateRenderer(&window, -1, SDL_RENDERER_SOFTWARE)) {
    if (!renderer_) throw InputError(std::string("--window: no window can be opened: ") + SDL_GetError());
    unsigned char* rgba = nullptr;
    int width_px = 0, height_px = 0;
    ImFontAtlas& fonts = *ImGui::GetIO().Fonts;
    fonts.GetTexDataAsRGBA32(&rgba, &width_px, &height_px);
    font_ = SDL_CreateTexture(renderer_, SDL_PIXELFORMAT_RGBA32, SDL_TEXTUREACCESS_STATIC, width_px, height_px);
    SDL_UpdateTexture(font_, nullptr, rgba, 4 * width_px);
    SDL_SetTextureBlendMode(font_, SDL_BLENDMODE_BLEND);
    fonts.SetTexID(font_);
  }
  ~SoftwarePresenter() override {
    ImGui::GetIO().Fonts->SetTexID(nullptr);
    SDL_DestroyRenderer(renderer_);  // and its textures
  }
  SoftwarePresenter(const SoftwarePresenter&) = delete;
  SoftwarePresenter& operator=(const SoftwarePresenter&) = delete;

  void show(const Image& image, ImDrawData& widgets) override {
    if (picture_width_px_ != image.width_px || picture_height_px_ != image.height_px) {
      if (picture_) SDL_DestroyTexture(picture_);
      picture_ = SDL_CreateTexture(renderer_, SDL_PIXELFORMAT_RGBA32, SDL_TEXTUREACCESS_STREAMING, image.width_px,
                                   image.height_px);
      SDL_SetTextureBlendMode(picture_, SDL_BLENDMODE_NONE);
      picture_width_px_ = image.width_px;
      picture_height_px_ = image.height_px;
    }
    SDL_UpdateTexture(picture_, nullptr, image.rgba.data(), 4 * image.width_px);
    SDL_SetRenderDrawColor(renderer_, 0, 0, 0, 255);
    SDL_RenderClear(renderer_);
    const SDL_Rect place = place_of(image);
    SDL_RenderCopy(renderer_, picture_, nullptr, &place);
    draw(widgets);
    SDL_RenderPresent(renderer_);
  }

 private:
  SDL_Rect place_of(const Image& image) const {
    int width_px = 0, height_px = 0;
    SDL_GetRendererOutputSize(renderer_, &width_px, &height_px);
    const double scale =
        std::min(static_cast<double>(width_px) / image.width_px, static_cast<double>(height_px) / image.height_px);
    const int wide_px = static_cast<int>(scale * image.width_px + 0.5),
              high_px = static_cast<int>(scale * image.height_px + 0.5);
    return {(width_px - wide_px) / 2, (height_px - high_px) / 2, wide_px, high_px};
  }
  void draw(const ImDrawData& widgets) {
    for (int l = 0; l < widgets.CmdListsCount; ++l) {
      const ImDrawList& list = *widgets.CmdLists[l];
      for (const ImDrawCmd& command : list.CmdBuffer) {
        const ImVec4& c = command.ClipRect;
        const SDL_Rect clip{static_cast<int>(c.x), static_cast<int>(c.y), static_cast<int>(c.z - c.x),
                            static_cast<int>(c.w - c.y)};
        SDL_RenderSetClipRect(renderer_, &clip);
        const ImDrawVert* first = list.VtxBuffer.Data + command.VtxOffset;
        SDL_RenderGeometryRaw(renderer_, static_cast<SDL_Texture*>(command.GetTexID()), &first->pos.x, sizeof *first,
                              reinterpret_cast<const SDL_Color*>(&first->col), sizeof *first, &first->uv.x,
                              sizeof *first, list.VtxBuffer.Size - static_cast<int>(command.VtxOffset),
                              list.IdxBuffer.Data + command.IdxOffset, static_cast<int>(command.ElemCount),
                              sizeof(ImDrawIdx));
      }
    }
    SDL_RenderSetClipRect(renderer_, nullptr);
  }

  SDL_Renderer* renderer_;
  SDL_Texture* font_ = nullptr;
  SDL_Texture* picture_ = nullptr;
  int picture_width_px_ = 0, picture_height_px_ = 0;
};

}  // namespace

std::unique_ptr<Presenter> make_software_presenter(SDL_Window& window) {
  return std::make_unique<SoftwarePresenter>(window);
}

}  // namespace sectio
