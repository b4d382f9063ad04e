// What every switch cost, as a table and as JSON.
#pragma once

#include <dimmer/light_state.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace dimmer::sample {

// One frame's update of the lighting.
struct FrameCost {
    uint32_t frame = 0;
    std::vector<std::string> changes;  // the script's steps behind it, as written; empty: nobody touched a light
    UpdateStats stats;
};

// Frames in a row behind which stand the same steps: a switch is one frame, a fade many. Medians over its frames.
struct CostEvent {
    uint32_t first_frame = 0, frames = 1;
    std::string what;
    UpdateStats median;
};

// Frames in which no light was touched and no page blended.
struct QuietFrames {
    uint32_t frames = 0;
    UpdateStats median;
};

class CostReport {
   public:
    void add(FrameCost cost) { frames_.push_back(std::move(cost)); }

    std::vector<CostEvent> events() const;
    QuietFrames unchangedFrames() const;  // the runtime had nothing to do
    QuietFrames movingFrames() const;     // things moved among lights that rest, and were lit anew
    // Sums over all frames.
    UpdateStats total() const;

    std::string table(const std::string& device, const std::string& driver) const;
    Expected<void> writeJson(const std::filesystem::path& path, const std::string& pack, const std::string& device,
                             const std::string& driver) const;

   private:
    QuietFrames quiet(bool (*is)(const FrameCost&)) const;

    std::vector<FrameCost> frames_;
};

}  // namespace dimmer::sample
