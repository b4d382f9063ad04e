#include <app/say.h>
#include <app/terminal_progress.h>

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

namespace dimmer::cook {
namespace {

constexpr auto redraw_every = std::chrono::milliseconds(200);
constexpr int bar_width = 28;

}  // namespace

TerminalProgress::TerminalProgress() : terminal_(isatty(STDERR_FILENO) == 1) {}

void TerminalProgress::stage(std::string_view name, uint64_t total) {
    const std::scoped_lock lock(mutex_);
    endStage();
    name_ = name;
    total_ = total;
    done_ = 0;
    started_ = drawn_ = Clock::now();
    if (terminal_) draw();
}

void TerminalProgress::advance(uint64_t steps) {
    const std::scoped_lock lock(mutex_);
    done_ += steps;
    if (!terminal_ || Clock::now() - drawn_ < redraw_every) return;
    drawn_ = Clock::now();
    draw();
}

void TerminalProgress::warn(std::string_view warning) {
    const std::scoped_lock lock(mutex_);
    if (!warnings_.isNew(warning)) return;
    if (terminal_) say("\r\x1b[K");
    sayWarning(warning);
    if (terminal_ && !name_.empty()) draw();
}

void TerminalProgress::finish() {
    const std::scoped_lock lock(mutex_);
    endStage();
    name_.clear();
}

void TerminalProgress::draw() {
    const double share = total_ > 0 ? std::min(1.0, static_cast<double>(done_) / static_cast<double>(total_)) : 0;
    const double seconds = std::chrono::duration<double>(Clock::now() - started_).count();
    const int filled = static_cast<int>(share * bar_width);
    const std::string left = share > 0.01 ? fmt::format("{:.0f} s left", seconds * (1 - share) / share) : "";
    say(fmt::format("\r\x1b[K{:<24} [{:#<{}}{:.<{}}] {:3.0f} % {}", name_, "", filled, "", bar_width - filled,
                    100 * share, left));
}

void TerminalProgress::endStage() {
    if (name_.empty()) return;
    const double seconds = std::chrono::duration<double>(Clock::now() - started_).count();
    say(fmt::format("{}{:<24} {:.1f} s\n", terminal_ ? "\r\x1b[K" : "", name_, seconds));
}

}  // namespace dimmer::cook
