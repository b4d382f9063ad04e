// Progress for people: a bar with the time left on a terminal, a line per stage otherwise.
#pragma once

#include <app/say.h>
#include <bake/progress.h>

#include <chrono>
#include <mutex>
#include <string>

namespace dimmer::cook {

class TerminalProgress final : public Progress {
   public:
    TerminalProgress();
    void stage(std::string_view name, uint64_t total) override;
    void advance(uint64_t steps) override;
    void warn(std::string_view warning) override;
    void finish() override;

   private:
    using Clock = std::chrono::steady_clock;
    void draw();
    void endStage();

    bool terminal_;
    std::mutex mutex_;
    WarningsOnce warnings_;
    std::string name_;
    uint64_t done_ = 0, total_ = 0;
    Clock::time_point started_, drawn_;
};

}  // namespace dimmer::cook
