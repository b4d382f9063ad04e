// `dimmer bench`: what updates of a pack cost on this machine.
#pragma once

#include <dimmer/error.h>
#include <dimmer/light_state.h>

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace dimmer::cook {

struct BenchOptions {
    std::filesystem::path pack{};
    uint32_t frames = 100;          // updates measured per case, 1 or more
    std::string mode = "worklist";  // "worklist", "per-combination", "gather", "scatter", "cpu" or "all"
    std::string only{};             // cases whose names contain this; empty: all
    // Where to write the figures as JSON; empty: nowhere; "-": to `out`, in the table's place.
    std::filesystem::path json{};
    std::filesystem::path plot{};  // where to draw them as SVG; empty: nowhere
    std::string command{};         // the command line, quoted in the output
};

// Measures: nothing changed; each light set and each door toggled alone; 1, 2, 4, ... sets changed; five sets
// flickering; all sets changed. In mode worklist, each is held against a copy kernel that moves as many bytes, run turn
// about. Prints a table to `out`.
Expected<void> benchPack(const BenchOptions& options, std::ostream& out);

struct Spread {
    double min = 0, median = 0, max = 0;
};
// Of at least one value.
Spread spreadOf(std::vector<double> values);

// Times in microseconds.
struct CaseResult {
    std::string name, mode;
    uint32_t sets = 0;    // BenchCase::sets
    UpdateStats largest;  // of the update that moved the most bytes
    Spread gpu_us;        // on the GPU's clock; nothing for the mode "cpu"
    Spread host_us;       // of planning and recording
    // Of the whole process over the number of processors: on a Vulkan device that is a CPU, the time an update takes
    // where nothing else runs, and steady where something does. What one thread does alone, as planning, counts for a
    // fraction of its time.
    Spread process_us;
    // Copies of as many bytes, on the clock that BenchReport::clock names: into a buffer, and into pages.
    std::optional<Spread> roof_us, roof_pages_us;
    double efficiency = 0, efficiency_pages = 0;  // roof over update, medians
};

struct BenchReport {
    std::string device = "none (CPU only)", driver = "none";
    std::string clock = "host";  // of what is compared: "gpu", "process" on a Vulkan device that is a CPU
    std::vector<CaseResult> results;
};

uint64_t bytesOf(const UpdateStats& stats);
void printTable(const BenchOptions& options, const BenchReport& report, std::ostream& out);
std::string reportJson(const BenchOptions& options, const BenchReport& report);
// An SVG of two diagrams: cost against receivers changed, and against the number of sets changed.
std::string plotSvg(const BenchReport& report);

}  // namespace dimmer::cook
