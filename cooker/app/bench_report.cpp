#include <app/bench.h>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <ostream>

namespace dimmer::cook {
namespace {

std::string cell(const Spread& spread) {
    return fmt::format("{:.1f} ({:.1f}..{:.1f})", spread.median, spread.min, spread.max);
}

nlohmann::ordered_json toJson(const Spread& spread) {
    return {{"min", spread.min}, {"median", spread.median}, {"max", spread.max}};
}

nlohmann::ordered_json toJson(const std::optional<Spread>& spread) {
    return spread ? toJson(*spread) : nlohmann::ordered_json(nullptr);
}

nlohmann::ordered_json toJson(const CaseResult& r) {
    const auto share = [&](double efficiency) {
        return r.roof_us ? nlohmann::ordered_json(efficiency) : nlohmann::ordered_json(nullptr);
    };
    return {{"name", r.name},
            {"mode", r.mode},
            {"receivers", r.largest.receivers},
            {"batches", r.largest.batches},
            {"dispatches", r.largest.dispatches},
            {"bytes", bytesOf(r.largest)},
            {"gpu_us", r.mode == "cpu" ? nlohmann::ordered_json(nullptr) : toJson(r.gpu_us)},
            {"host_us", toJson(r.host_us)},
            {"process_us", toJson(r.process_us)},
            {"roof_us", toJson(r.roof_us)},
            {"efficiency", share(r.efficiency)},
            {"roof_pages_us", toJson(r.roof_pages_us)},
            {"efficiency_pages", share(r.efficiency_pages)}};
}

}  // namespace

Spread spreadOf(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    const size_t middle = values.size() / 2;
    const double median = values.size() % 2 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
    return {values.front(), median, values.back()};
}

uint64_t bytesOf(const UpdateStats& stats) {
    return stats.bytes_read + stats.bytes_written;
}

void printTable(const BenchOptions& options, const BenchReport& report, std::ostream& out) {
    fmt::print(out, "device   {}\ndriver   {}\npack     {}\n", report.device, report.driver, options.pack.string());
    if (!options.command.empty()) fmt::print(out, "command  {}\n", options.command);
    fmt::print(out,
               "frames   {} per case; times in microseconds, median (min..max)\nclock    {}: efficiency is the roof's "
               "time over the update's, for copies of as many bytes into a buffer / into pages\n\n",
               options.frames, report.clock);
    size_t width = 4;
    for (const CaseResult& r : report.results) width = std::max(width, r.name.size());
    constexpr std::string_view row = "{:<{}}  {:<15} {:>9} {:>7} {:>10} {:>10}  {:>28}  {:>28}  {:>28}  {:>11}\n";
    fmt::print(out, row, "case", width, "mode", "receivers", "batches", "dispatches", "bytes", "GPU us", "host us",
               "process us", "efficiency");
    for (const CaseResult& r : report.results)
        fmt::print(out, row, r.name, width, r.mode, r.largest.receivers, r.largest.batches, r.largest.dispatches,
                   bytesOf(r.largest), r.mode == "cpu" ? "-" : cell(r.gpu_us), cell(r.host_us), cell(r.process_us),
                   r.roof_us ? fmt::format("{:.2f} / {:.2f}", r.efficiency, r.efficiency_pages) : "-");
}

std::string reportJson(const BenchOptions& options, const BenchReport& report) {
    nlohmann::ordered_json json{{"device", report.device},
                                {"driver", report.driver},
                                {"clock", report.clock},
                                {"pack", options.pack.string()},
                                {"command", options.command},
                                {"frames", options.frames},
                                {"cases", nlohmann::ordered_json::array()}};
    for (const CaseResult& r : report.results) json["cases"].push_back(toJson(r));
    // Names come from files: what is not UTF-8 in them is replaced, not thrown about.
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace dimmer::cook
