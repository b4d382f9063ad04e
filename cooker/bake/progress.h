// What a long run tells its user. Thread-safe; advance() is cheap enough for every block of work.
#pragma once

#include <cstdint>
#include <string_view>

namespace dimmer::cook {

class Progress {
   public:
    virtual ~Progress() = default;
    // Starts a stage of `total` steps and ends the one before it.
    virtual void stage(std::string_view name, uint64_t total) = 0;
    virtual void advance(uint64_t steps) = 0;
    // As early as it is known: who reads it may stop and mend the level. To be said once, however often it comes.
    virtual void warn(std::string_view warning) = 0;
    // Ends the last stage.
    virtual void finish() = 0;
};

class SilentProgress : public Progress {
   public:
    void stage(std::string_view, uint64_t) override {}
    void advance(uint64_t) override {}
    void warn(std::string_view) override {}
    void finish() override {}
};

}  // namespace dimmer::cook
