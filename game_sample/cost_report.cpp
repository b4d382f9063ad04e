#include "cost_report.h"

#include "output_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace dimmer::sample {
namespace {

// Nobody touched a light, and no page was blended: all that may have happened is that things moved.
bool lightsRest(const FrameCost& cost) {
    return cost.changes.empty() && cost.stats.contributions_changed == 0 && cost.stats.batches == 0;
}
bool unchanged(const FrameCost& cost) {
    return lightsRest(cost) && cost.stats.dispatches == 0;
}
bool movedOnly(const FrameCost& cost) {
    return lightsRest(cost) && cost.stats.dispatches > 0;
}

template <class Value>
Value medianOf(const std::vector<UpdateStats>& all, Value UpdateStats::*member) {
    std::vector<Value> values;
    for (const UpdateStats& stats : all) values.push_back(stats.*member);
    if (values.empty()) return {};
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

UpdateStats median(const std::vector<UpdateStats>& all) {
    UpdateStats result;
    result.contributions_changed = medianOf(all, &UpdateStats::contributions_changed);
    result.clusters = medianOf(all, &UpdateStats::clusters);
    result.batches = medianOf(all, &UpdateStats::batches);
    result.receivers = medianOf(all, &UpdateStats::receivers);
    result.dispatches = medianOf(all, &UpdateStats::dispatches);
    result.bytes_read = medianOf(all, &UpdateStats::bytes_read);
    result.bytes_written = medianOf(all, &UpdateStats::bytes_written);
    result.host_us = medianOf(all, &UpdateStats::host_us);
    result.gpu_us = medianOf(all, &UpdateStats::gpu_us);
    return result;
}

double kibibytes(const UpdateStats& stats) {
    return static_cast<double>(stats.bytes_read + stats.bytes_written) / 1024;
}

std::string row(const std::string& frames, std::string what, const UpdateStats& stats) {
    constexpr size_t what_width = 46;
    if (what.size() > what_width) what = what.substr(0, what_width - 3) + "...";
    return fmt::format("{:>9}  {:<46} {:>9} {:>7} {:>5} {:>9.1f} {:>9.1f} {:>9.1f}\n", frames, what, stats.receivers,
                       stats.batches, stats.dispatches, kibibytes(stats), stats.gpu_us, stats.host_us);
}

nlohmann::ordered_json toJson(const UpdateStats& stats) {
    return {{"receivers", stats.receivers},
            {"clusters", stats.clusters},
            {"batches", stats.batches},
            {"dispatches", stats.dispatches},
            {"bytes", stats.bytes_read + stats.bytes_written},
            {"bytes_read", stats.bytes_read},
            {"bytes_written", stats.bytes_written},
            {"gpu_us", stats.gpu_us},
            {"host_us", stats.host_us}};
}

}  // namespace

std::vector<CostEvent> CostReport::events() const {
    std::vector<CostEvent> events;
    std::vector<UpdateStats> run;
    const auto endRun = [&] {
        if (!events.empty()) events.back().median = median(run);
        run.clear();
    };
    for (const FrameCost& cost : frames_) {
        if (lightsRest(cost)) continue;
        const std::string what = cost.changes.empty() ? "start" : fmt::format("{}", fmt::join(cost.changes, " + "));
        const bool continues = !events.empty() && events.back().what == what &&
                               events.back().first_frame + events.back().frames == cost.frame;
        if (continues) {
            ++events.back().frames;
        } else {
            endRun();
            events.push_back({cost.frame, 1, what, {}});
        }
        run.push_back(cost.stats);
    }
    endRun();
    return events;
}

QuietFrames CostReport::quiet(bool (*is)(const FrameCost&)) const {
    std::vector<UpdateStats> all;
    for (const FrameCost& cost : frames_)
        if (is(cost)) all.push_back(cost.stats);
    return {static_cast<uint32_t>(all.size()), median(all)};
}
QuietFrames CostReport::unchangedFrames() const {
    return quiet(unchanged);
}
QuietFrames CostReport::movingFrames() const {
    return quiet(movedOnly);
}

UpdateStats CostReport::total() const {
    UpdateStats sum;
    for (const auto& [frame, changes, stats] : frames_) {
        sum.contributions_changed += stats.contributions_changed;
        sum.clusters += stats.clusters;
        sum.batches += stats.batches;
        sum.receivers += stats.receivers;
        sum.dispatches += stats.dispatches;
        sum.bytes_read += stats.bytes_read;
        sum.bytes_written += stats.bytes_written;
        sum.host_us += stats.host_us;
        sum.gpu_us += stats.gpu_us;
    }
    return sum;
}

std::string CostReport::table(const std::string& device, const std::string& driver) const {
    std::string text = fmt::format("Lighting updates on {} ({})\n", device, driver);
    text += fmt::format("{:>9}  {:<46} {:>9} {:>7} {:>5} {:>9} {:>9} {:>9}\n", "frame", "what changed", "receivers",
                        "batches", "disp.", "KiB", "GPU us", "host us");
    for (const CostEvent& event : events()) {
        const std::string frames = event.frames == 1
                                       ? fmt::format("{}", event.first_frame)
                                       : fmt::format("{}-{}", event.first_frame, event.first_frame + event.frames - 1);
        text += row(frames, event.what, event.median);
    }
    for (const auto& [what, quiet] :
         {std::pair{"nothing changed", unchangedFrames()}, {"things moved", movingFrames()}})
        if (quiet.frames > 0) text += row("", fmt::format("{}: median of {} frames", what, quiet.frames), quiet.median);
    text += row("", fmt::format("total of {} frames", frames_.size()), total());
    return text +
           "Rows of several frames show the median frame. Measured after one rehearsal: no shader compilation in it.\n";
}

Expected<void> CostReport::writeJson(const std::filesystem::path& path, const std::string& pack,
                                     const std::string& device, const std::string& driver) const {
    nlohmann::ordered_json json{{"device", device}, {"driver", driver}, {"pack", pack}, {"frames", frames_.size()}};
    json["events"] = nlohmann::ordered_json::array();
    for (const CostEvent& event : events()) {
        nlohmann::ordered_json entry{{"frame", event.first_frame}, {"frames", event.frames}, {"what", event.what}};
        entry.update(toJson(event.median));
        json["events"].push_back(std::move(entry));
    }
    for (const auto& [key, quiet] : {std::pair{"unchanged", unchangedFrames()}, {"moved", movingFrames()}}) {
        json[key] = toJson(quiet.median);
        json[key]["frames"] = quiet.frames;
    }
    json["total"] = toJson(total());

    return writeFile(path, json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n');
}

}  // namespace dimmer::sample
