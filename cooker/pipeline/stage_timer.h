// Times: of a progress's stages, in the order in which they first came, and of blocks.
#pragma once

#include <bake/progress.h>
#include <pipeline/free_memory.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

namespace dimmer::cook {

using StageSeconds = std::vector<std::pair<std::string, double>>;

// Passes everything on, and gives back what the stage before no longer needs. One thread starts stages; any advance
// them.
class StageTimer final : public Progress {
   public:
    StageTimer(Progress& progress, StageSeconds& seconds) : progress_(progress), seconds_(seconds) {}
    ~StageTimer() override { endStage(); }
    StageTimer(const StageTimer&) = delete;
    StageTimer& operator=(const StageTimer&) = delete;

    void stage(std::string_view name, uint64_t total) override {
        endStage();
        giveBackMuchFreeMemory();
        name_ = name;
        progress_.stage(name, total);
    }
    void advance(uint64_t steps) override { progress_.advance(steps); }
    void warn(std::string_view warning) override { progress_.warn(warning); }
    void finish() override { progress_.finish(); }

   private:
    void endStage() {
        const auto now = std::chrono::steady_clock::now();
        const double seconds = std::chrono::duration<double>(now - std::exchange(start_, now)).count();
        if (name_.empty()) return;
        const auto known = std::ranges::find(seconds_, name_, &StageSeconds::value_type::first);
        if (known == seconds_.end())
            seconds_.emplace_back(name_, seconds);
        else
            known->second += seconds;
    }

    Progress& progress_;
    StageSeconds& seconds_;
    std::string name_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// Adds the seconds of its own life.
class Stopwatch {
   public:
    explicit Stopwatch(double& seconds) : seconds_(seconds) {}
    ~Stopwatch() { seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
    Stopwatch(const Stopwatch&) = delete;
    Stopwatch& operator=(const Stopwatch&) = delete;

   private:
    double& seconds_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace dimmer::cook
