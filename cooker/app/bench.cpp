#include <app/bench.h>

#include <app/bench_cases.h>
#include <app/say.h>

#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pack/pack_data.h>
#include <probes/model_slots.h>
#include <tools/copy_roof.h>
#include <tools/headless_device.h>
#include <write/pack_writer.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <functional>
#include <ostream>
#include <thread>

namespace dimmer::cook {
namespace {

struct Mode {
    std::string_view name;
    std::optional<UpdateMode> vulkan;  // empty: the CPU runtime
};
constexpr std::array<Mode, 5> modes = {{
    {"worklist", UpdateMode::WorkList},
    {"per-combination", UpdateMode::PerCombination},
    {"gather", UpdateMode::Gather},
    {"scatter", UpdateMode::Scatter},
    {"cpu", std::nullopt},
}};

// CPU time of all threads over the number of processors.
double processMicroseconds() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    const double processors = std::max(1u, std::thread::hardware_concurrency());
    return (static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3) / processors;
}

// One update, finished.
using Update = std::function<Expected<UpdateStats>()>;

// Copies against which a case is held; null members where there is nothing to hold it against.
struct Roof {
    CopyRoof* copies = nullptr;
    bool on_process_clock = false;

    Expected<double> run(CopyTarget target, const UpdateStats& stats) const {
        const double start = processMicroseconds();
        auto us = copies->run(target, stats.bytes_read, stats.bytes_written);
        if (us && on_process_clock) *us = processMicroseconds() - start;
        return us;
    }
};

// Every set at 1 and every door closed, with nothing left to do.
Expected<void> settle(LightState& state, const Update& update) {
    if (auto ok = resetElements(state); !ok) return ok;
    if (auto stats = update(); !stats) return std::unexpected(std::move(stats.error()));
    return {};
}

struct Samples {
    std::vector<double> gpu_us, host_us, process_us, roof_us, roof_pages_us;
};

Expected<UpdateStats> sampleFrame(const Update& update, const Roof& roof, Samples& samples) {
    const double start = processMicroseconds();
    auto stats = update();
    if (!stats) return stats;
    samples.process_us.push_back(processMicroseconds() - start);
    samples.gpu_us.push_back(stats->gpu_us);
    samples.host_us.push_back(stats->host_us);
    if (!roof.copies || stats->bytes_written == 0) return stats;
    const auto buffer_us = roof.run(CopyTarget::Buffer, *stats);
    if (!buffer_us) return std::unexpected(buffer_us.error());
    const auto pages_us = roof.run(CopyTarget::Pages, *stats);
    if (!pages_us) return std::unexpected(pages_us.error());
    samples.roof_us.push_back(*buffer_us);
    samples.roof_pages_us.push_back(*pages_us);
    return stats;
}

void summarise(const Samples& samples, bool on_process_clock, CaseResult& result) {
    result.gpu_us = spreadOf(samples.gpu_us);
    result.host_us = spreadOf(samples.host_us);
    result.process_us = spreadOf(samples.process_us);
    if (samples.roof_us.empty()) return;
    const double update_us = (on_process_clock ? result.process_us : result.gpu_us).median;
    result.roof_us = spreadOf(samples.roof_us);
    result.roof_pages_us = spreadOf(samples.roof_pages_us);
    result.efficiency = result.roof_us->median / update_us;
    result.efficiency_pages = result.roof_pages_us->median / update_us;
}

Expected<CaseResult> measure(const BenchCase& one, LightState& state, const Update& update, const Roof& roof,
                             uint32_t frames, std::string_view mode) {
    CaseResult result{.name = one.name,
                      .mode = std::string(mode),
                      .sets = one.sets,
                      .largest = {},
                      .gpu_us = {},
                      .host_us = {},
                      .process_us = {},
                      .roof_us = {},
                      .roof_pages_us = {}};
    // Two frames first, unmeasured: drivers compile and page in on first use.
    constexpr uint32_t warm_up = 2;
    if (auto ok = settle(state, update); !ok) return std::unexpected(std::move(ok.error()));
    Samples samples;
    for (uint32_t frame = 0; frame < warm_up + frames; ++frame) {
        if (frame == warm_up) samples = {};
        if (auto ok = one.change(state, frame); !ok) return std::unexpected(std::move(ok.error()));
        const auto stats = sampleFrame(update, roof, samples);
        if (!stats) return std::unexpected(stats.error());
        if (frame == warm_up || (frame > warm_up && bytesOf(*stats) > bytesOf(result.largest))) result.largest = *stats;
    }
    summarise(samples, roof.on_process_clock, result);
    return result;
}

bool isChosen(const BenchCase& one, const BenchOptions& options) {
    return one.name.find(options.only) != std::string::npos;
}

Expected<void> measureAll(LightState& state, const Update& update, const Roof& roof, const BenchOptions& options,
                          std::string_view mode, std::vector<CaseResult>& results) {
    for (const BenchCase& one : casesOf(state.pack())) {
        if (!isChosen(one, options)) continue;
        auto result = measure(one, state, update, roof, options.frames, mode);
        if (!result) return std::unexpected(std::move(result.error()));
        results.push_back(std::move(*result));
    }
    return {};
}

uint32_t movingProbes(const PackData& data) {
    return data.probes.global.empty() ? 0 : bench_probes;
}

// More than any update of the pack moves.
Expected<CopyRoof> roofFor(const VulkanContext& vulkan, const PackData& data) {
    const ProbeData& probes = data.probes;
    const uint64_t receivers = data.addresses.size() + probes.numbers.size();
    const uint64_t written = data.addresses.size() * sizeof(TexelRecord) + probes.numbers.size() * sizeof(ProbeRecord);
    const uint64_t payload = data.payload.size() * sizeof(TexelRecord) + probes.payload.size() * sizeof(ProbeRecord);
    const uint64_t moving = movingProbes(data);
    return CopyRoof::create(vulkan, written + receivers * sizeof(uint32_t) + payload + moving * resample_bytes_read,
                            written + moving * resample_bytes_written);
}

Expected<void> measureVulkan(const Pack& pack, const HeadlessDevice& device, const Mode& mode,
                             const BenchOptions& options, BenchReport& report) {
    auto runtime =
        Runtime::create(device.context(), pack, {.mode = *mode.vulkan, .moving_probes_max = movingProbes(pack.data())});
    if (!runtime) return std::unexpected(std::move(runtime.error()));
    const Update update = [&]() -> Expected<UpdateStats> {
        auto sent = runtime->submit();
        if (!sent || sent->dispatches == 0) return sent;
        return runtime->wait();
    };
    Roof roof;
    roof.on_process_clock = report.clock == "process";
    std::optional<CopyRoof> copies;
    if (mode.vulkan == UpdateMode::WorkList && !pack.data().addresses.empty()) {
        auto made = roofFor(device.context(), pack.data());
        // The runtime's tables are buffers of their own: it may run where their sum is too much for one.
        if (!made && made.error().code != ErrorCode::Unsupported) return std::unexpected(std::move(made.error()));
        if (made) {
            copies = std::move(*made);
            roof.copies = &*copies;
        } else {
            sayMessage("measured without the copy roof: " + made.error().message);
        }
    }
    return measureAll(*runtime, update, roof, options, mode.name, report.results);
}

Expected<void> measureCpu(const Pack& pack, const Mode& mode, const BenchOptions& options, BenchReport& report) {
    CpuRuntime runtime(pack, std::max(1u, std::thread::hardware_concurrency()), movingProbes(pack.data()));
    const Update update = [&]() -> Expected<UpdateStats> { return runtime.update(); };
    return measureAll(runtime, update, {}, options, mode.name, report.results);
}

Expected<void> measureModes(const Pack& pack, std::span<const Mode> chosen, const BenchOptions& options,
                            BenchReport& report) {
    std::optional<HeadlessDevice> device;
    for (const Mode& mode : chosen) {
        if (!mode.vulkan) {
            if (auto ok = measureCpu(pack, mode, options, report); !ok) return ok;
            continue;
        }
        if (!device) {
            auto made = HeadlessDevice::create();
            if (!made) return std::unexpected(std::move(made.error()));
            device = std::move(*made);
            report.device = device->name();
            report.driver = device->driver();
            VkPhysicalDeviceProperties properties;
            vkGetPhysicalDeviceProperties(device->context().physical_device, &properties);
            report.clock = properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU ? "process" : "gpu";
        }
        auto measured = measureVulkan(pack, *device, mode, options, report);
        // The naive modes cannot hold what large packs have; what the others measured stands.
        if (!measured && chosen.size() > 1 && measured.error().code == ErrorCode::Unsupported)
            sayMessage(fmt::format("mode {} is left out: {}", mode.name, measured.error().message));
        else if (!measured)
            return measured;
    }
    return {};
}

// That there is something to measure.
Expected<void> checkChoice(const Pack& pack, const BenchOptions& options) {
    std::vector<std::string> names;
    for (const BenchCase& one : casesOf(pack)) {
        if (isChosen(one, options)) return {};
        names.push_back(one.name);
    }
    return fail(ErrorCode::InvalidArgument, fmt::format("--only {}: no case's name contains that; there are: {}.",
                                                        options.only, fmt::join(names, ", ")));
}

Expected<void> writeText(const std::filesystem::path& path, const std::string& text) {
    return writeFileAtomically(path, std::as_bytes(std::span(text)));
}

}  // namespace

Expected<void> benchPack(const BenchOptions& options, std::ostream& out) {
    std::vector<Mode> chosen;
    for (const Mode& mode : modes)
        if (options.mode == "all" || options.mode == mode.name) chosen.push_back(mode);
    if (chosen.empty())
        return fail(ErrorCode::InvalidArgument, fmt::format("Mode \"{}\" is unknown; use worklist, per-combination, "
                                                            "gather, scatter, cpu or all.",
                                                            options.mode));
    if (options.frames == 0) return fail(ErrorCode::InvalidArgument, "A benchmark of 0 frames measures nothing.");

    const auto pack = Pack::open(options.pack);
    if (!pack) return std::unexpected(pack.error());
    if (auto ok = checkChoice(*pack, options); !ok) return ok;
    BenchReport report;
    if (auto ok = measureModes(*pack, chosen, options, report); !ok) return ok;

    const std::string json = reportJson(options, report);
    if (!options.plot.empty())
        if (auto ok = writeText(options.plot, plotSvg(report)); !ok) return ok;
    if (options.json == "-") {
        out << json;
        return {};
    }
    printTable(options, report, out);
    if (options.json.empty()) return {};
    return writeText(options.json, json);
}

}  // namespace dimmer::cook
