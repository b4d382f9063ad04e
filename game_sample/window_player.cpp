#include "window_player.h"

#include "exposure.h"
#include "image_file.h"
#include "panel.h"
#include "stage.h"
#include "timeline.h"
#include "window.h"

#include <fmt/format.h>
#include <gpu/vk_result.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

namespace dimmer::sample {
namespace {

using Clock = std::chrono::steady_clock;

class WindowPlayer {
   public:
    WindowPlayer(const Script& script, const WindowOptions& options, Stage& stage, Window& window,
                 const std::string& device)
        : script_(script),
          options_(options),
          stage_(stage),
          window_(window),
          controls_(stage.lights()),
          timeline_(std::in_place, script),
          camera_(script.camera),
          eye_(script.adaptation_s, script.fps) {
        panels_.device = device;
        panels_.level = options.pack.filename().string();
        panels_.has_script = panels_.script_runs = options.has_script;
    }

    Expected<void> run() {
        for (uint32_t shown = 0; options_.frames == 0 || shown < options_.frames; ++shown) {
            const WindowInput input = window_.begin();
            if (input.quit) return {};
            if (input.toggle_panel) panels_shown_ = !panels_shown_;
            const PanelRequests asked =
                panels_shown_ ? drawPanels(panels_, controls_, stage_.lights()) : PanelRequests{};
            if (asked.restart) DIMMER_TRY(restart());
            const Passed passed = timePassed(shown == 0);
            DIMMER_TRY(advance(passed.frames));
            moveCamera(input.fly, asked.look_from, passed.seconds);
            controls_.step(passed.seconds);
            DIMMER_TRY(draw(passed.frames, input.picture, shown + 1 == options_.frames));
        }
        return {};
    }

   private:
    // Since the last frame that was shown.
    struct Passed {
        uint32_t frames;  // of the script
        float seconds;
    };
    // By the clock; where the window closes by itself, a frame of the script each time. Somebody who stopped the sample
    // for a while finds it where it was.
    Passed timePassed(bool first) {
        constexpr double longest_s = 0.25;
        const double now_s = std::chrono::duration<double>(Clock::now() - started_).count();
        const double passed_s = std::min(now_s - std::exchange(now_s_, now_s), longest_s);
        if (first) return {1, 0};
        if (options_.frames > 0) return {1, 1 / script_.fps};
        frames_due_ += passed_s * static_cast<double>(script_.fps);
        const auto frames = static_cast<uint32_t>(frames_due_);
        frames_due_ -= frames;
        return {frames, static_cast<float>(passed_s)};
    }

    // What the script does in these frames; at its end it begins anew.
    Expected<void> advance(uint32_t frames) {
        frames_played_ += frames;
        if (!panels_.script_runs) return {};
        for (uint32_t i = 0; i < frames; ++i) {
            if (script_frame_ == script_.frames) {
                DIMMER_TRY(restart());
                frames_played_ = frames - i;
            }
            const auto changes = timeline_->advance(script_frame_++, stage_.lights());
            if (!changes) return std::unexpected(changes.error());
            cut_ = cut_ || timeline_->cut();
        }
        // The script leads the camera where it moves it; else the person has it.
        const CameraPose& led = timeline_->camera();
        if (!led_ || led.position_m != led_->position_m || led.forward != led_->forward) {
            led_ = led;
            camera_ = led;
        }
        return {};
    }

    // The script, the lights and what moves.
    Expected<void> restart() {
        timeline_.emplace(script_);
        script_frame_ = frames_played_ = 0;
        led_.reset();
        cut_ = true;
        return resetWeights(stage_.lights());
    }

    void moveCamera(const FlyInput& input, const std::optional<CameraPose>& look_from, float seconds) {
        if (look_from) {
            camera_ = *look_from;
            cut_ = true;
        }
        FlyInput fast = input;
        fast.faster *= panels_.faster;
        if (fast.move != glm::vec3(0) || fast.turn_rad != glm::vec2(0)) camera_ = fly(camera_, fast, seconds);
    }

    Expected<void> draw(uint32_t frames, bool take_picture, bool last) {
        const auto stats = stage_.draw(std::max(frames_played_, 1u) - 1, camera_);
        if (!stats) return std::unexpected(stats.error());
        panels_.costs.add(*stats);
        const RadianceFrame radiance = stage_.read();
        const float median = medianLuminance(radiance);
        if (cut_ && frames == 0) frames = 1;
        for (uint32_t i = 0; i < frames; ++i) exposure_ = eye_.update(median, std::exchange(cut_, false));
        const std::vector<uint8_t> picture = developPicture(radiance, exposure_);
        if (take_picture) {
            const auto kept = keep(picture);
            panels_.message = kept ? "picture: " + kept->string() : kept.error().message;
        }
        const bool wanted = last && !options_.picture.empty();
        Window::Picture shown;
        DIMMER_TRY(window_.show(picture, wanted ? &shown : nullptr));
        return wanted ? writePng(options_.picture, shown.width, shown.height, shown.rgb) : Expected<void>{};
    }

    // The level without the panel, under the next free number.
    Expected<std::filesystem::path> keep(std::span<const uint8_t> picture) {
        std::error_code failed;
        std::filesystem::create_directories(options_.out, failed);
        if (failed) return fail(ErrorCode::Io, fmt::format("{}: {}.", options_.out.string(), failed.message()));
        std::filesystem::path file;
        do file = options_.out / fmt::format("picture_{:04}.png", pictures_++);
        while (std::filesystem::exists(file, failed));
        DIMMER_TRY(writePng(file, script_.width, script_.height, picture));
        return file;
    }

    const Script& script_;
    const WindowOptions& options_;
    Stage& stage_;
    Window& window_;
    Panels panels_;
    Controls controls_;
    std::optional<Timeline> timeline_;  // anew when the script begins anew
    CameraPose camera_;
    std::optional<CameraPose> led_;  // where the script had it last
    AutoExposure eye_;
    const Clock::time_point started_ = Clock::now();
    double now_s_ = 0, frames_due_ = 0;
    uint32_t frames_played_ = 0, script_frame_ = 0, pictures_ = 0;
    float exposure_ = 1;
    bool panels_shown_ = true, cut_ = true;
};

}  // namespace

Expected<std::vector<std::string>> playInWindow(const Pack& pack, const Script& script, const WindowOptions& options) {
    // The window first: without a display there is nothing to set up for.
    auto window =
        Window::create(fmt::format("{} - Dimmer", options.pack.filename().string()), script.width, script.height);
    if (!window) return std::unexpected(window.error());
    const auto device = HeadlessDevice::create({.validation = options.validate, .graphics = true});
    if (!device) return std::unexpected(device.error());
    {
        auto stage = Stage::create(*device, pack, script, options.self_visibility);
        if (!stage) return std::unexpected(stage.error());
        DIMMER_TRY((*stage)->rehearse(1));  // what compiles at first
        WindowPlayer player(script, options, **stage, **window, device->name());
        DIMMER_TRY(player.run());
    }
    return device->validationMessages();
}

}  // namespace dimmer::sample
