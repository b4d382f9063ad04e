// A window that shows a picture and, above it, what Dear ImGui draws; by SDL's own renderer, so that it opens wherever
// SDL draws, whichever Vulkan device made the picture.
#pragma once

#include "fly_camera.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace dimmer::sample {

// What the person did since the last frame.
struct WindowInput {
    FlyInput fly;
    bool quit = false, toggle_panel = false, picture = false;
};

class Window {
   public:
    // Of the picture's size at first. Not there: InvalidArgument, as the mend is another argument.
    static Expected<std::unique_ptr<Window>> create(const std::string& title, uint32_t width, uint32_t height);
    ~Window();
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;

    // Begins a frame of Dear ImGui.
    WindowInput begin();
    // 8-bit RGB, rows from the top.
    struct Picture {
        uint32_t width = 0, height = 0;
        std::vector<uint8_t> rgb;
    };
    // Shows a picture of the size given to create(), as large as fits, and ImGui's frame above it. `shown`, where it is
    // given, takes what the window shows.
    Expected<void> show(std::span<const uint8_t> rgb, Picture* shown = nullptr);

   private:
    struct Impl;
    explicit Window(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace dimmer::sample
