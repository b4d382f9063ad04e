#include <app/json_progress.h>
#include <app/say.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

constexpr auto print_every = std::chrono::milliseconds(200);

}  // namespace

void JsonProgress::stage(std::string_view name, uint64_t total) {
    const std::scoped_lock lock(mutex_);
    if (!name_.empty()) print(total_);
    name_ = name;
    total_ = total;
    done_ = 0;
    started_ = Clock::now();
    print(0);
}

void JsonProgress::advance(uint64_t steps) {
    const std::scoped_lock lock(mutex_);
    done_ = std::min(total_, done_ + steps);
    if (Clock::now() - printed_ >= print_every) print(done_);
}

void JsonProgress::warn(std::string_view warning) {
    const std::scoped_lock lock(mutex_);
    if (warnings_.isNew(warning)) sayWarning(warning);
}

void JsonProgress::finish() {
    const std::scoped_lock lock(mutex_);
    if (!name_.empty()) print(total_);
    name_.clear();
}

void JsonProgress::print(uint64_t done) {
    printed_ = Clock::now();
    const double seconds = std::chrono::duration<double>(printed_ - started_).count();
    const double share = total_ > 0 ? static_cast<double>(done) / static_cast<double>(total_) : 0;
    nlohmann::ordered_json line = {{"stage", name_}, {"done", done}, {"total", total_}, {"seconds_left", nullptr}};
    // Thousandths are more than anyone knows.
    if (share >= 0.01) line["seconds_left"] = std::round(1000 * seconds * (1 - share) / share) / 1000;
    say(line.dump() + "\n");
}

}  // namespace dimmer::cook
