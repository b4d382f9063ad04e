#include <app/bench.h>

#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>
#include <fmt/format.h>
#include <fmt/ostream.h>
#include <gpu/headless_device.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <ostream>

namespace dimmer::cook {
namespace {

struct Spread {
    double min = 0, median = 0, max = 0;
};

Spread spreadOf(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    const size_t middle = values.size() / 2;
    const double median = values.size() % 2 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
    return {values.front(), median, values.back()};
}

struct CaseResult {
    std::string name, mode;
    UpdateStats largest;  // of the update that moved the most bytes
    Spread gpu_us, host_us;
};

uint64_t bytesOf(const UpdateStats& stats) {
    return stats.bytes_read + stats.bytes_written;
}

// Changes the state for a frame; frames are counted from 0.
using Change = std::function<Expected<void>(LightState&, uint32_t frame)>;

struct Case {
    std::string name;
    Change change;
};

bool isSet(const Element& element) {
    return element.kind == ElementKind::LightSet;
}

Expected<void> setElement(LightState& state, uint32_t index, float weight) {
    const Element& element = state.pack().elements()[index];
    const float in_range = std::min(weight, element.max_weight);
    return isSet(element) ? state.setWeight(LightSet{index}, in_range) : state.setDoor(Door{index}, in_range);
}

std::vector<Case> casesOf(const Pack& pack) {
    std::vector<Case> cases;
    cases.push_back({"nothing changed", [](LightState&, uint32_t) { return Expected<void>(); }});
    const auto elements = pack.elements();
    for (uint32_t i = 0; i < elements.size(); ++i) {
        const float start = isSet(elements[i]) ? 1.0f : 0.0f;
        cases.push_back({fmt::format("{} {} toggled", isSet(elements[i]) ? "set" : "door", elements[i].name),
                         [=](LightState& state, uint32_t frame) {
                             return setElement(state, i, frame % 2 == 0 ? 1 - start : start);
                         }});
    }
    cases.push_back({"all sets changed", [](LightState& state, uint32_t frame) -> Expected<void> {
                         for (uint32_t i = 0; i < state.pack().elements().size(); ++i) {
                             if (!isSet(state.pack().elements()[i])) continue;
                             // Halves of the range a set surely has, so that every frame changes every set.
                             const float full = std::min(1.0f, state.pack().elements()[i].max_weight);
                             if (auto ok = setElement(state, i, frame % 2 == 0 ? full / 2 : full); !ok) return ok;
                         }
                         return {};
                     }});
    return cases;
}

// One update, finished.
using Update = std::function<Expected<UpdateStats>()>;

// Every set at 1 and every door closed, with nothing left to do.
Expected<void> settle(LightState& state, const Update& update) {
    for (uint32_t i = 0; i < state.pack().elements().size(); ++i)
        if (auto ok = setElement(state, i, isSet(state.pack().elements()[i]) ? 1.0f : 0.0f); !ok) return ok;
    if (auto stats = update(); !stats) return std::unexpected(std::move(stats.error()));
    return {};
}

Expected<CaseResult> measure(const Case& one, LightState& state, const Update& update, uint32_t frames,
                             const std::string& mode) {
    CaseResult result{one.name, mode, {}, {}, {}};
    // Two frames first, unmeasured: drivers compile and page in on first use.
    constexpr uint32_t warm_up = 2;
    if (auto ok = settle(state, update); !ok) return std::unexpected(std::move(ok.error()));
    std::vector<double> gpu_us, host_us;
    for (uint32_t frame = 0; frame < warm_up + frames; ++frame) {
        if (auto ok = one.change(state, frame); !ok) return std::unexpected(std::move(ok.error()));
        const auto stats = update();
        if (!stats) return std::unexpected(stats.error());
        if (frame < warm_up) continue;
        gpu_us.push_back(stats->gpu_us);
        host_us.push_back(stats->host_us);
        if (frame == warm_up || bytesOf(*stats) > bytesOf(result.largest)) result.largest = *stats;
    }
    result.gpu_us = spreadOf(std::move(gpu_us));
    result.host_us = spreadOf(std::move(host_us));
    return result;
}

Expected<void> measureAll(const Pack& pack, LightState& state, const Update& update, const BenchOptions& options,
                          const std::string& mode, std::vector<CaseResult>& results) {
    for (const Case& one : casesOf(pack)) {
        auto result = measure(one, state, update, options.frames, mode);
        if (!result) return std::unexpected(std::move(result.error()));
        results.push_back(std::move(*result));
    }
    return {};
}

struct Report {
    std::string device = "none (CPU only)", driver = "none";
    std::vector<CaseResult> results;
};

Expected<void> measureVulkan(const Pack& pack, const BenchOptions& options, Report& report) {
    const auto device = HeadlessDevice::create();
    if (!device) return std::unexpected(device.error());
    report.device = device->name();
    report.driver = device->driver();
    auto runtime = Runtime::create(device->context(), pack);
    if (!runtime) return std::unexpected(std::move(runtime.error()));
    const Update update = [&]() -> Expected<UpdateStats> {
        if (auto sent = runtime->submit(); !sent) return sent;
        return runtime->wait();
    };
    return measureAll(pack, *runtime, update, options, "worklist", report.results);
}

Expected<void> measureCpu(const Pack& pack, const BenchOptions& options, Report& report) {
    CpuRuntime runtime(pack);
    const Update update = [&]() -> Expected<UpdateStats> { return runtime.update(); };
    return measureAll(pack, runtime, update, options, "cpu", report.results);
}

std::string cell(const Spread& spread) {
    return fmt::format("{:.1f} ({:.1f}..{:.1f})", spread.median, spread.min, spread.max);
}

void printTable(const BenchOptions& options, const Report& report, std::ostream& out) {
    fmt::print(out, "device   {}\ndriver   {}\npack     {}\n", report.device, report.driver, options.pack.string());
    if (!options.command.empty()) fmt::print(out, "command  {}\n", options.command);
    fmt::print(out, "frames   {} per case; times in microseconds, median (min..max)\n\n", options.frames);
    size_t width = 4;
    for (const CaseResult& r : report.results) width = std::max(width, r.name.size());
    fmt::print(out, "{:<{}}  {:<8} {:>10} {:>8} {:>10} {:>12}  {:>26}  {:>26}\n", "case", width, "mode", "receivers",
               "batches", "dispatches", "bytes", "GPU us", "host us");
    for (const CaseResult& r : report.results)
        fmt::print(out, "{:<{}}  {:<8} {:>10} {:>8} {:>10} {:>12}  {:>26}  {:>26}\n", r.name, width, r.mode,
                   r.largest.receivers, r.largest.batches, r.largest.dispatches, bytesOf(r.largest),
                   r.mode == "cpu" ? "-" : cell(r.gpu_us), cell(r.host_us));
}

nlohmann::ordered_json toJson(const Spread& spread) {
    return {{"min", spread.min}, {"median", spread.median}, {"max", spread.max}};
}

nlohmann::ordered_json toJson(const BenchOptions& options, const Report& report) {
    nlohmann::ordered_json json{{"device", report.device},       {"driver", report.driver},
                                {"pack", options.pack.string()}, {"command", options.command},
                                {"frames", options.frames},      {"cases", nlohmann::ordered_json::array()}};
    for (const CaseResult& r : report.results) {
        json["cases"].push_back({{"name", r.name},
                                 {"mode", r.mode},
                                 {"receivers", r.largest.receivers},
                                 {"batches", r.largest.batches},
                                 {"dispatches", r.largest.dispatches},
                                 {"bytes", bytesOf(r.largest)},
                                 {"gpu_us", toJson(r.gpu_us)},
                                 {"host_us", toJson(r.host_us)},
                                 // The copy kernel that these compare with is not measured yet.
                                 {"roof_us", nullptr},
                                 {"efficiency", nullptr}});
    }
    return json;
}

// Names come from files: what is not UTF-8 in them is replaced, not thrown about.
std::string dump(const nlohmann::ordered_json& json) {
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

Expected<void> writeFile(const std::filesystem::path& path, const std::string& text) {
    std::ofstream file(path, std::ios::binary);
    file << text;
    file.close();
    if (!file) return fail(ErrorCode::Io, fmt::format("{}: the figures cannot be written there.", path.string()));
    return {};
}

}  // namespace

Expected<void> benchPack(const BenchOptions& options, std::ostream& out) {
    const bool vulkan = options.mode == "worklist" || options.mode == "all";
    const bool cpu = options.mode == "cpu" || options.mode == "all";
    if (!vulkan && !cpu)
        return fail(ErrorCode::InvalidArgument,
                    fmt::format("Mode \"{}\" is unknown; use worklist, cpu or all.", options.mode));
    if (options.frames == 0) return fail(ErrorCode::InvalidArgument, "A benchmark of 0 frames measures nothing.");

    const auto pack = Pack::open(options.pack);
    if (!pack) return std::unexpected(pack.error());
    Report report;
    if (vulkan)
        if (auto ok = measureVulkan(*pack, options, report); !ok) return ok;
    if (cpu)
        if (auto ok = measureCpu(*pack, options, report); !ok) return ok;

    const std::string json = dump(toJson(options, report));
    if (options.json == "-") {
        out << json;
        return {};
    }
    printTable(options, report, out);
    if (options.json.empty()) return {};
    return writeFile(options.json, json);
}

}  // namespace dimmer::cook
