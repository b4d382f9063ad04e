// Progress for pipelines: lines of JSON on stderr.
#pragma once

#include <app/say.h>
#include <bake/progress.h>

#include <chrono>
#include <mutex>
#include <string>

namespace dimmer::cook {

// {"stage": "bake", "done": 12, "total": 100, "seconds_left": 3.5}: one when a stage begins, up to five a second, and
// one with done = total when it ends. `seconds_left` is of the stage, null until a hundredth of it is done.
class JsonProgress final : public Progress {
   public:
    void stage(std::string_view name, uint64_t total) override;
    void advance(uint64_t steps) override;
    void warn(std::string_view warning) override;
    void finish() override;

   private:
    using Clock = std::chrono::steady_clock;
    void print(uint64_t done);

    std::mutex mutex_;
    WarningsOnce warnings_;
    std::string name_;
    uint64_t done_ = 0, total_ = 0;
    Clock::time_point started_, printed_;
};

}  // namespace dimmer::cook
