// A line on stderr that says how far we are and how long it will take.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace dimmer::sample {

// On a terminal one line that rewrites itself, at most ten times a second; elsewhere a plain line every tenth.
class Progress {
   public:
    Progress(std::string what, uint32_t total);
    ~Progress();  // leaves the terminal's line
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    void update(uint32_t done);

   private:
    using Clock = std::chrono::steady_clock;
    std::string what_;
    uint32_t total_;
    bool terminal_;
    Clock::time_point start_ = Clock::now(), shown_{};
    uint32_t tenths_shown_ = 0;
};

}  // namespace dimmer::sample
