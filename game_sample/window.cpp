#include "window.h"

#define SDL_MAIN_HANDLED
#include <SDL.h>
#include <backends/imgui_impl_sdl.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <string_view>

namespace dimmer::sample {
namespace {

constexpr float radians_per_pixel = 0.003f;
constexpr float hurry = 3;  // with Shift
constexpr std::string_view no_display =
    "There is no display to open a window on; add --headless to write pictures instead";

std::unexpected<Error> sdlError(ErrorCode code, std::string_view what) {
    const std::string_view why = SDL_GetError();
    return fail(code, why.empty() ? fmt::format("{}.", what) : fmt::format("{} (SDL: {}).", what, why));
}

float axis(const Uint8* keys, SDL_Scancode more, SDL_Scancode less) {
    return static_cast<float>(keys[more]) - static_cast<float>(keys[less]);
}

// The largest of the picture's shape in the middle of the window.
SDL_Rect fitted(int window_width, int window_height, int width, int height) {
    const float scale = std::min(static_cast<float>(window_width) / static_cast<float>(width),
                                 static_cast<float>(window_height) / static_cast<float>(height));
    const int w = std::max(1, static_cast<int>(static_cast<float>(width) * scale)),
              h = std::max(1, static_cast<int>(static_cast<float>(height) * scale));
    return {(window_width - w) / 2, (window_height - h) / 2, w, h};
}

}  // namespace

struct Window::Impl {
    template <auto destroy>
    struct Deleter {
        void operator()(auto* handle) const { destroy(handle); }
    };
    struct Library {
        bool video = false;
        ~Library() {
            if (video) SDL_Quit();
        }
    };
    struct ImGuiPart {
        bool context = false, platform = false;
        ~ImGuiPart() {
            if (platform) ImGui_ImplSDL2_Shutdown();
            if (context) ImGui::DestroyContext();
        }
    };
    // In the order in which they are made.
    Library library;
    std::unique_ptr<SDL_Window, Deleter<SDL_DestroyWindow>> window;
    std::unique_ptr<SDL_Renderer, Deleter<SDL_DestroyRenderer>> renderer;
    std::unique_ptr<SDL_Texture, Deleter<SDL_DestroyTexture>> picture, font;
    ImGuiPart imgui;
    int width = 0, height = 0;  // of the picture

    Expected<void> create(const std::string& title);
    Expected<void> createFont();
    void drawImGui(const ImDrawData& data);
};

Window::Window(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Window::~Window() = default;

Expected<std::unique_ptr<Window>> Window::create(const std::string& title, uint32_t width, uint32_t height) {
    auto impl = std::make_unique<Impl>();
    impl->width = static_cast<int>(width);
    impl->height = static_cast<int>(height);
    if (auto done = impl->create(title); !done) return std::unexpected(done.error());
    return std::unique_ptr<Window>(new Window(std::move(impl)));
}

Expected<void> Window::Impl::create(const std::string& title) {
    SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");  // Ctrl-C ends the sample at once, whatever it is at
    if (SDL_Init(SDL_INIT_VIDEO) != 0) return sdlError(ErrorCode::InvalidArgument, no_display);
    library.video = true;
    // What SDL falls back on where there is no display shows nothing, and nobody could close it.
    constexpr std::array unseen = {"offscreen", "dummy", "evdev"};
    if (!SDL_GetHint(SDL_HINT_VIDEODRIVER) && std::ranges::count(unseen, std::string_view(SDL_GetCurrentVideoDriver())))
        return fail(ErrorCode::InvalidArgument, fmt::format("{}.", no_display));
    SDL_SetHint(SDL_HINT_RENDER_SCALE_QUALITY, "linear");
    window.reset(SDL_CreateWindow(title.c_str(), SDL_WINDOWPOS_CENTERED, SDL_WINDOWPOS_CENTERED, width, height,
                                  SDL_WINDOW_RESIZABLE));
    if (!window) return sdlError(ErrorCode::InvalidArgument, "No window could be opened; add --headless");
    renderer.reset(SDL_CreateRenderer(window.get(), -1, SDL_RENDERER_PRESENTVSYNC));
    if (!renderer) return sdlError(ErrorCode::InvalidArgument, "Nothing can be drawn in a window; add --headless");
    picture.reset(SDL_CreateTexture(renderer.get(), SDL_PIXELFORMAT_RGB24, SDL_TEXTUREACCESS_STREAMING, width, height));
    if (!picture) return sdlError(ErrorCode::InvalidArgument, "The picture is too large for a window; lower --size");

    ImGui::CreateContext();
    imgui.context = true;
    ImGui::GetIO().IniFilename = nullptr;  // leaves no file behind
    imgui.platform = ImGui_ImplSDL2_InitForSDLRenderer(window.get());
    return createFont();
}

Expected<void> Window::Impl::createFont() {
    unsigned char* pixels = nullptr;
    int w = 0, h = 0;
    ImGui::GetIO().Fonts->GetTexDataAsRGBA32(&pixels, &w, &h);
    font.reset(SDL_CreateTexture(renderer.get(), SDL_PIXELFORMAT_RGBA32, SDL_TEXTUREACCESS_STATIC, w, h));
    if (!font || SDL_UpdateTexture(font.get(), nullptr, pixels, 4 * w) != 0)
        return sdlError(ErrorCode::Internal, "The panel's font could not be made");
    SDL_SetTextureBlendMode(font.get(), SDL_BLENDMODE_BLEND);
    ImGui::GetIO().Fonts->SetTexID(font.get());
    return {};
}

WindowInput Window::begin() {
    WindowInput input;
    const ImGuiIO& io = ImGui::GetIO();
    for (SDL_Event event; SDL_PollEvent(&event);) {
        ImGui_ImplSDL2_ProcessEvent(&event);
        const bool key = event.type == SDL_KEYDOWN && event.key.repeat == 0 && !io.WantTextInput;
        // A picker that is open takes Esc for itself.
        const bool popup = ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopup);
        if (event.type == SDL_QUIT || (key && event.key.keysym.sym == SDLK_ESCAPE && !popup)) input.quit = true;
        if (key && event.key.keysym.sym == SDLK_F1) input.toggle_panel = true;
        if (key && event.key.keysym.sym == SDLK_F12) input.picture = true;
        if (event.type == SDL_MOUSEBUTTONDOWN && event.button.button == SDL_BUTTON_RIGHT && !io.WantCaptureMouse)
            SDL_SetRelativeMouseMode(SDL_TRUE);
        if (event.type == SDL_MOUSEBUTTONUP && event.button.button == SDL_BUTTON_RIGHT)
            SDL_SetRelativeMouseMode(SDL_FALSE);
        if (event.type == SDL_MOUSEMOTION && SDL_GetRelativeMouseMode())
            input.fly.turn_rad += radians_per_pixel * glm::vec2(event.motion.xrel, -event.motion.yrel);
    }
    if (!io.WantTextInput) {
        const Uint8* keys = SDL_GetKeyboardState(nullptr);
        input.fly.move = {axis(keys, SDL_SCANCODE_D, SDL_SCANCODE_A), axis(keys, SDL_SCANCODE_E, SDL_SCANCODE_Q),
                          axis(keys, SDL_SCANCODE_W, SDL_SCANCODE_S)};
        if (keys[SDL_SCANCODE_LSHIFT]) input.fly.faster = hurry;
    }
    ImGui_ImplSDL2_NewFrame();
    ImGui::NewFrame();
    return input;
}

Expected<void> Window::show(std::span<const uint8_t> rgb, Picture* shown) {
    SDL_Renderer* const to = impl_->renderer.get();
    int window_width = 0, window_height = 0;
    SDL_GetRendererOutputSize(to, &window_width, &window_height);
    const SDL_Rect place = fitted(window_width, window_height, impl_->width, impl_->height);
    SDL_SetRenderDrawColor(to, 0, 0, 0, 255);
    SDL_RenderClear(to);
    if (SDL_UpdateTexture(impl_->picture.get(), nullptr, rgb.data(), 3 * impl_->width) != 0 ||
        SDL_RenderCopy(to, impl_->picture.get(), nullptr, &place) != 0)
        return sdlError(ErrorCode::Internal, "The picture could not be shown");
    ImGui::Render();
    impl_->drawImGui(*ImGui::GetDrawData());
    if (shown) {
        shown->width = static_cast<uint32_t>(window_width);
        shown->height = static_cast<uint32_t>(window_height);
        shown->rgb.resize(size_t{3} * shown->width * shown->height);
        if (SDL_RenderReadPixels(to, nullptr, SDL_PIXELFORMAT_RGB24, shown->rgb.data(), 3 * window_width) != 0)
            return sdlError(ErrorCode::Internal, "What the window shows could not be read");
    }
    SDL_RenderPresent(to);
    return {};
}

// Debian's Dear ImGui has no backend for this renderer; its lists of triangles are what SDL_RenderGeometryRaw takes.
void Window::Impl::drawImGui(const ImDrawData& data) {
    for (int l = 0; l < data.CmdListsCount; ++l) {
        const ImDrawList& list = *data.CmdLists[l];
        for (const ImDrawCmd& command : list.CmdBuffer) {
            const glm::vec2 low(command.ClipRect.x - data.DisplayPos.x, command.ClipRect.y - data.DisplayPos.y),
                high(command.ClipRect.z - data.DisplayPos.x, command.ClipRect.w - data.DisplayPos.y);
            if (!(high.x > low.x && high.y > low.y)) continue;
            const SDL_Rect clip = {static_cast<int>(low.x), static_cast<int>(low.y), static_cast<int>(high.x - low.x),
                                   static_cast<int>(high.y - low.y)};
            SDL_RenderSetClipRect(renderer.get(), &clip);
            const ImDrawVert* const vertices = list.VtxBuffer.Data + command.VtxOffset;
            SDL_RenderGeometryRaw(
                renderer.get(), static_cast<SDL_Texture*>(command.GetTexID()), &vertices->pos.x, sizeof(ImDrawVert),
                reinterpret_cast<const SDL_Color*>(&vertices->col), sizeof(ImDrawVert), &vertices->uv.x,
                sizeof(ImDrawVert), list.VtxBuffer.Size - static_cast<int>(command.VtxOffset),
                list.IdxBuffer.Data + command.IdxOffset, static_cast<int>(command.ElemCount), sizeof(ImDrawIdx));
        }
    }
    SDL_RenderSetClipRect(renderer.get(), nullptr);
}

}  // namespace dimmer::sample
