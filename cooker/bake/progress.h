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
    // Ends the last stage.
    virtual void finish() = 0;
};

class SilentProgress final : public Progress {
   public:
    void stage(std::string_view, uint64_t) override {}
    void advance(uint64_t) override {}
    void finish() override {}
};

}  // namespace dimmer::cook
