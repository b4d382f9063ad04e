#include <stress/stress.h>

#include <pipeline/free_memory.h>
#include <stress/executors.h>

#include <fmt/format.h>
#include <format/probe.h>

#include <algorithm>
#include <chrono>

namespace dimmer::cook {
namespace {

constexpr int updates_to_rest_max = 4;

// What the allocator merely keeps from the last check's fresh blend does not count.
uint64_t bytesInUse() {
    giveBackFreeMemory();
    return residentBytes();
}

// A channel with the exponent 31 is an infinity or a NaN in R11G11B10F; E5B9G9R9 has neither.
bool notANumber(ColorFormat format, uint32_t code) {
    if (format != ColorFormat::R11G11B10F) return false;
    return (code >> 6 & 31) == 31 || (code >> 17 & 31) == 31 || (code >> 27 & 31) == 31;
}

uint64_t bytesMoved(const UpdateStats& stats) {
    return stats.bytes_read + stats.bytes_written;
}

uint64_t differences(std::span<const uint32_t> a, std::span<const uint32_t> b) {
    uint64_t count = a.size() > b.size() ? a.size() - b.size() : b.size() - a.size();
    for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) count += a[i] != b[i];
    return count;
}

class StressRun {
   public:
    StressRun(const Pack& pack, const StressOptions& options, std::vector<std::unique_ptr<StressExecutor>> executors)
        : pack_(pack), options_(options), executors_(std::move(executors)), script_(pack, options.seed) {
        for (const auto& e : executors_) report_.executors.push_back({.name = e->name()});
    }

    Expected<StressReport> run(Progress& progress) {
        const auto begin = std::chrono::steady_clock::now();
        // Before each check comes one more frame, which settles.
        const uint64_t frames = std::max<uint64_t>(1, options_.frames), per_check = uint64_t{options_.check_every} + 1;
        const uint64_t checks = (frames + per_check - 1) / per_check;
        progress.stage("frames", checks);
        while (report_.checks < checks) {
            const uint64_t changing = std::min(per_check, frames - report_.frames) - 1;
            for (uint64_t i = 0; i < changing; ++i)
                if (auto ok = frame(script_.next()); !ok) return std::unexpected(std::move(ok.error()));
            if (auto ok = frame(script_.settle()); !ok) return std::unexpected(std::move(ok.error()));
            if (auto ok = comeToRest(); !ok) return std::unexpected(std::move(ok.error()));
            if (auto ok = check(); !ok) return std::unexpected(std::move(ok.error()));
            ++report_.checks;
            report_.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
            const double done = std::max(static_cast<double>(report_.checks) / static_cast<double>(checks),
                                         options_.seconds_max > 0 ? report_.seconds / options_.seconds_max : 0);
            weigh(done);
            progress.advance(1);
            if (done >= 1) break;
        }
        progress.finish();
        return std::move(report_);
    }

   private:
    Expected<void> frame(const std::vector<StressEvent>& events) {
        report_.events += events.size();
        for (const auto& e : executors_) {
            for (const StressEvent& event : events)
                if (auto ok = e->apply(event); !ok) return failed(*e, ok.error());
            if (auto ok = e->update(); !ok) return failed(*e, ok.error());
        }
        ++report_.frames;
        return {};
    }

    std::unexpected<Error> failed(const StressExecutor& e, const Error& error) const {
        return fail(error.code, fmt::format("{} at frame {} (seed {}): {}", e.name(), report_.frames, options_.seed,
                                            error.message));
    }

    // A budgeted update of hidden pages is finished first, of the state that it began with; then comes the last state.
    Expected<void> comeToRest() {
        for (const auto& e : executors_)
            for (int updates = 0;; ++updates) {
                const auto stats = e->update();
                if (!stats) return failed(*e, stats.error());
                if (bytesMoved(*stats) == 0) break;
                if (updates == updates_to_rest_max)
                    return failed(*e, {ErrorCode::Internal, "updates go on although nothing changes any more"});
            }
        return {};
    }

    Expected<void> check() {
        const auto fresh = freshBlend(pack_, script_.state());
        if (!fresh) return std::unexpected(fresh.error());
        for (size_t i = 0; i < executors_.size(); ++i) {
            const auto pages = executors_[i]->pages();
            if (!pages) return failed(*executors_[i], pages.error());
            if (auto ok = compare(*executors_[i], *pages, *fresh, report_.executors[i]); !ok) return ok;
        }
        return {};
    }

    Expected<void> compare(StressExecutor& executor, const StressPages& pages, const FreshBlend& fresh,
                           StressTally& tally) const {
        const auto both = [&](std::span<const uint32_t> a, std::span<const uint32_t> b) {
            tally.words += b.size();
            tally.words_different += differences(a, b);
        };
        both(pages.irradiance, fresh.pages.irradiance);
        both(pages.direction, fresh.pages.direction);
        for (const uint32_t code : pages.irradiance) tally.not_numbers += notANumber(pack_.colorFormat(), code);
        // Behind the pack's probes are those of movers, each where its runtime put them.
        const size_t own = pack_.data().probes.base.size();
        if (own == 0) return {};
        const auto probes = [](const StressPages& p, size_t first, size_t count) {
            return std::span(p.probes).subspan(first * words_per_probe, count * words_per_probe);
        };
        both(probes(pages, 0, own), probes(fresh.pages, 0, own));
        for (size_t i = 0; i < own; ++i)
            tally.not_numbers += notANumber(pack_.colorFormat(), pages.probes[i * words_per_probe]);
        for (uint32_t m = 0; m < StressScript::movers_max; ++m) {
            const ModelSlot& expected = fresh.slots[m];
            const uint32_t count = expected.counts[0] * expected.counts[1] * expected.counts[2];
            if (count == 0) continue;
            const auto slot = executor.slotOf(m);
            if (!slot) return failed(executor, slot.error());
            both(probes(pages, slot->first_probe, count), probes(fresh.pages, expected.first_probe, count));
        }
        return {};
    }

    void weigh(double done) {
        const uint64_t resident = bytesInUse();
        uint64_t device = 0;
        for (const auto& e : executors_) device += e->deviceBytes();
        if (report_.resident_start_bytes == 0 && done >= 0.1) {
            report_.resident_start_bytes = resident;
            report_.device_start_bytes = device;
        }
        if (report_.resident_start_bytes == 0) return;
        report_.resident_most_bytes = std::max(report_.resident_most_bytes, resident);
        report_.resident_end_bytes = resident;
        report_.device_end_bytes = device;
    }

    const Pack& pack_;
    const StressOptions& options_;
    std::vector<std::unique_ptr<StressExecutor>> executors_;
    StressScript script_;
    StressReport report_;
};

bool within1Percent(uint64_t start, uint64_t end) {
    return 100 * std::max(start, end) <= 101 * std::min(start, end) || start == end;
}

}  // namespace

bool StressReport::exact() const {
    return std::ranges::all_of(executors,
                               [](const StressTally& t) { return t.words_different == 0 && t.not_numbers == 0; });
}

bool StressReport::memoryFlat() const {
    if (!memoryJudged()) return true;
    return within1Percent(resident_start_bytes, resident_end_bytes) &&
           within1Percent(device_start_bytes, device_end_bytes);
}

Expected<StressReport> stress(const Pack& pack, const HeadlessDevice* device, const StressOptions& options,
                              Progress& progress) {
    auto executors = stressExecutors(pack, device);
    if (!executors) return std::unexpected(std::move(executors.error()));
    return StressRun(pack, options, std::move(*executors)).run(progress);
}

}  // namespace dimmer::cook
