// A long run of a random game on every runtime at once, held against fresh blends: do pages ever drift, does memory
// ever grow?
#pragma once

#include <bake/progress.h>
#include <tools/headless_device.h>

#include <string>
#include <vector>

namespace dimmer::cook {

struct StressOptions {
    uint64_t frames = 1'000'000;  // at most, 1 or more; the one that settles before each check is among them
    double seconds_max = 600;     // ends sooner when this is over; 0: never
    uint32_t check_every = 1000;  // frames, then one that settles
    uint32_t seed = 1;
};

// Of one executor, over all checks.
struct StressTally {
    std::string name;
    uint64_t words = 0;  // compared: texels' two words, probes' seven
    uint64_t words_different = 0;
    uint64_t not_numbers = 0;  // texel codes that hold an infinity or a NaN
};

struct StressReport {
    uint64_t frames = 0, events = 0, checks = 0;
    double seconds = 0;
    std::vector<StressTally> executors;
    // Resident memory of the process after the first tenth of the checks, at most after it, and at the end; 0 where the
    // system does not say. Device bytes by all runtimes' own count, at the same times.
    uint64_t resident_start_bytes = 0, resident_most_bytes = 0, resident_end_bytes = 0;
    uint64_t device_start_bytes = 0, device_end_bytes = 0;

    bool exact() const;
    // Within 1 % at the end of what it was at the start. Not judged after fewer than 100 checks: memory that a driver
    // gave out is resident only once it is touched, and it takes a while until every set was loaded everywhere.
    bool memoryFlat() const;
    bool memoryJudged() const { return checks >= 100; }
};

// `device` null: CPU runtimes alone. An error is one that a runtime returned to a call that it should have taken; it
// names the frame and the runtime.
Expected<StressReport> stress(const Pack& pack, const HeadlessDevice* device, const StressOptions& options,
                              Progress& progress);

}  // namespace dimmer::cook
