#include "progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <string>

namespace dimmer::sample {

Progress::Progress(std::string what, uint32_t total)
    : what_(std::move(what)), total_(total), terminal_(isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() {
    if (terminal_) std::fputs("\n", stderr);
}

void Progress::update(uint32_t done) {
    const auto now = Clock::now();
    const auto tenths = static_cast<uint32_t>(uint64_t(done) * 10 / total_);
    const bool due =
        terminal_ ? done == total_ || now - shown_ > std::chrono::milliseconds(100) : tenths > tenths_shown_;
    if (!due) return;
    shown_ = now;
    tenths_shown_ = tenths;
    const double spent_s = std::chrono::duration<double>(now - start_).count();
    const double left_s = spent_s * (total_ - done) / done;
    const std::string line = fmt::format("{}{} of {} {}, {:.0f} s left{}", terminal_ ? "\r\033[K" : "", done, total_,
                                         what_, std::ceil(left_s), terminal_ ? "" : "\n");
    std::fputs(line.c_str(), stderr);  // where stderr is full the frames go on; fmt::print() would throw
}

}  // namespace dimmer::sample
