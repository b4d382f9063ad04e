#include <app/budget_json.h>
#include <app/command.h>
#include <app/files.h>
#include <format/layout.h>
#include <pack/pack_data.h>
#include <pipeline/budget.h>
#include <pipeline/contribution_text.h>
#include <pipeline/human_bytes.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <glm/glm.hpp>
#include <memory>

namespace dimmer::cook {
namespace {

struct InspectArguments {
    std::string pack;
    std::string json;
    bool settings = false;
};

// The budgets that the pack was cooked for; none where it does not say.
Profile budgetsOf(const PackData& d) {
    const auto settings = readSettings(d.settings_json);
    return settings ? settings->profile : Profile{};
}

// Per level of refinement.
std::vector<size_t> probesByLevel(const GlobalGrid& grid) {
    std::vector<size_t> counts;
    for (const uint8_t level : grid.levels) {
        if (level >= counts.size()) counts.resize(level + size_t{1});
        ++counts[level];
    }
    return counts;
}

struct Flatness {
    uint32_t tetrahedron;
    double height_share;  // least height over longest edge; 0.82 when regular
};

double flatness(const GlobalGrid& grid, const Tetrahedron& t) {
    std::array<glm::dvec3, 4> p;
    for (size_t i = 0; i < 4; ++i) {
        const ProbePosition& q = grid.positions[t.probes[i]];
        p[i] = {q.x_m, q.y_m, q.z_m};
    }
    double longest = 0, area = 0;
    for (size_t i = 0; i < 4; ++i) {
        const glm::dvec3 a = p[(i + 1) % 4], b = p[(i + 2) % 4], c = p[(i + 3) % 4];
        longest = std::max({longest, glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
        area = std::max(area, glm::length(glm::cross(b - a, c - a)));
    }
    const double volume = std::abs(glm::dot(p[1] - p[0], glm::cross(p[2] - p[0], p[3] - p[0])));
    return area > 0 ? volume / area / longest : 0;
}

// The flattest first: where floats have least to hold on to.
std::vector<Flatness> worstTetrahedra(const GlobalGrid& grid, size_t count) {
    std::vector<Flatness> all;
    for (uint32_t t = 0; t < grid.tetrahedra.size(); ++t) all.push_back({t, flatness(grid, grid.tetrahedra[t])});
    count = std::min(count, all.size());
    std::ranges::partial_sort(all, all.begin() + static_cast<std::ptrdiff_t>(count), {}, &Flatness::height_share);
    all.resize(count);
    return all;
}

void printModels(const PackData& d, const PackCost& cost) {
    if (d.models.empty()) return;
    size_t triangles = 0;
    for (const ModelMesh& m : d.model_meshes) triangles += m.indices.size() / 3;
    fmt::print("\nmodels: {}; {} meshes, {} triangles; {} local grids, {} probes, {}\n", d.models.size(),
               d.model_meshes.size(), triangles, d.probes.local.size(),
               d.probes.base.size() - d.probes.global.positions.size(), humanBytes(cost.local_grids));
    fmt::print("{:<26} {:>12}   meshes\n", "model", "probes");
    for (const PlacedModel& m : d.models)
        fmt::print("{:<26} {:>12}   {}\n", m.node,
                   m.local_grid ? fmt::format("{}", d.probes.local[*m.local_grid].probeCount()) : "moves",
                   m.mesh_count);
}

void printGrid(const PackData& d, const PackCost& cost) {
    const GlobalGrid& grid = d.probes.global;
    if (grid.empty()) return;
    fmt::print("\nglobal grid: {} probes, {} tetrahedra, {}\n", grid.positions.size(), grid.tetrahedra.size(),
               humanBytes(cost.global_grid));
    fmt::print("{:<26} {:>12}\n", "level of refinement", "probes");
    const auto levels = probesByLevel(grid);
    for (size_t n = 0; n < levels.size(); ++n) fmt::print("{:<26} {:>12}\n", n, levels[n]);
    fmt::print("{:<26} {:>12}   at, m\n", "flattest tetrahedra", "height");
    for (const Flatness& f : worstTetrahedra(grid, 3)) {
        const ProbePosition& p = grid.positions[grid.tetrahedra[f.tetrahedron].probes[0]];
        fmt::print("{:<26} {:>10.3f} %   {:.2f}, {:.2f}, {:.2f}\n", f.tetrahedron, 100 * f.height_share, p.x_m, p.y_m,
                   p.z_m);
    }
}

uint64_t probesOf(const PackData& d, size_t contribution) {
    return d.probes.record_counts.empty() ? 0 : d.probes.record_counts[contribution];
}

// At texels and probes.
uint64_t recordBytes(const PackData& d, size_t contribution) {
    return d.contributions[contribution].receivers * sizeof(TexelRecord) +
           probesOf(d, contribution) * sizeof(ProbeRecord);
}

nlohmann::ordered_json toJson(const PackData& d, const PackCost& cost, uint64_t file_bytes) {
    nlohmann::ordered_json j;
    j["format_version"] = format::version;
    j["exposure"] = d.exposure;
    j["bytes"] = bytesJson(cost, file_bytes);
    uint64_t texels = 0;
    for (size_t n = 0; n < cost.overlap_histogram.size(); ++n) texels += cost.overlap_histogram[n];
    const size_t global_probes = d.probes.global.positions.size();
    j["receivers"] = {
        {"texels", texels}, {"local_probes", d.probes.base.size() - global_probes}, {"global_probes", global_probes}};
    j["probe_levels"] = probesByLevel(d.probes.global);
    j["tetrahedra"] = d.probes.global.tetrahedra.size();
    j["models"] = d.models.size();
    j["model_meshes"] = d.model_meshes.size();
    j["pages"] = nlohmann::ordered_json::array();
    for (uint32_t p = 0; p < d.page_count; ++p)
        j["pages"].push_back({{"width", d.page_width}, {"height", d.page_height}});
    j["contributions"] = nlohmann::ordered_json::array();
    for (size_t k = 0; k < d.contributions.size(); ++k) {
        const Contribution& c = d.contributions[k];
        j["contributions"].push_back({{"light", lightName(d, c)},
                                      {"doors_open", elementNames(d, c.doors_open)},
                                      {"doors_closed", elementNames(d, c.doors_closed)},
                                      {"receivers", c.receivers},
                                      {"probes", probesOf(d, k)},
                                      {"bytes", recordBytes(d, k)},
                                      {"energy_dropped", c.energy_dropped}});
    }
    j["elements"] = elementsJson(d, cost);
    j["clusters"] = d.clusters.size();
    j["batches"] = d.batches.size();
    j["overlap_histogram"] = cost.overlap_histogram;
    j["budgets"] = budgetsJson(budgetsOf(d));
    j["settings"] = listedSettings(d.settings_json);
    return j;
}

void printTable(const PackData& d, const PackCost& cost, uint64_t file_bytes) {
    fmt::print("{}", budgetTable(d, cost, budgetsOf(d)));
    fmt::print("\nfile: {}; meshes (host): {}\n", humanBytes(file_bytes), humanBytes(cost.meshes));
    fmt::print(
        "pages: {} of {} x {} texels; exposure {}; {} clusters; {} batches of {:.1f} receivers on average\n",
        d.page_count, d.page_width, d.page_height, d.exposure, d.clusters.size(), d.batches.size(),
        d.batches.empty() ? 0.0 : static_cast<double>(d.addresses.size()) / static_cast<double>(d.batches.size()));
    printGrid(d, cost);
    printModels(d, cost);
    fmt::print("\n{:<40} {:>12} {:>12} {:>12} {:>16}\n", "contribution", "texels", "probes", "bytes", "energy dropped");
    for (size_t k = 0; k < d.contributions.size(); ++k)
        fmt::print("{:<40} {:>12} {:>12} {:>12} {:>14.2f} %\n", describe(d, d.contributions[k]),
                   d.contributions[k].receivers, probesOf(d, k), humanBytes(recordBytes(d, k)),
                   100 * static_cast<double>(d.contributions[k].energy_dropped));
    fmt::print("\n{:<26} {:>12}\n", "overlap", "texels");
    for (size_t n = 0; n < cost.overlap_histogram.size(); ++n)
        fmt::print("{:<26} {:>12}\n", n, cost.overlap_histogram[n]);
}

void printSettings(const PackData& d) {
    fmt::print("{:<32} {:<16} {}\n", "setting", "value", "from");
    const auto settings = listedSettings(d.settings_json);
    for (const auto& [key, setting] : settings.items())
        fmt::print("{:<32} {:<16} {}\n", key, setting["value"].dump(), setting["from"].get<std::string>());
}

int run(const InspectArguments& a) {
    if (auto ok = checkFiles({{"PACK", a.pack}}, {printed("--json", a.json)}); !ok) return reportError(ok.error());
    const auto pack = Pack::open(a.pack);
    if (!pack) return reportError(pack.error());
    std::error_code ignored;
    const uint64_t file_bytes = std::filesystem::file_size(a.pack, ignored);
    const PackCost cost = costOf(pack->data());
    if (!a.json.empty())
        if (auto ok = writeJson(toJson(pack->data(), cost, file_bytes), a.json); !ok) return reportError(ok.error());
    if (a.json == "-") return exit_done;
    if (a.settings)
        printSettings(pack->data());
    else
        printTable(pack->data(), cost, file_bytes);
    return exit_done;
}

}  // namespace

void addInspectCommand(CLI::App& app, int& exit_code) {
    auto a = std::make_shared<InspectArguments>();
    auto* c = app.add_subcommand("inspect", "What a pack holds and what it costs");
    c->add_option("PACK", a->pack, "a cooked pack")->required();
    c->add_option("--json", a->json, "write the same as JSON to a file; alone or with -: to stdout")
        ->expected(0, 1)
        ->default_str("-");
    c->add_flag("--settings", a->settings, "print every setting of the cook and where it came from");
    c->footer(
        "Sizes are in bytes (kB and MB: 1000 and 1000000 of them); energy dropped is the share of a light's energy "
        "that\n"
        "fell below the threshold and is not stored; overlap is the number of contributions stored at a texel, those\n"
        "without light there included that a neighbour in its cluster has.\n"
        "Example: dimmer inspect house.dimmer --json house.json");
    c->callback([a, c, &exit_code] {
        if (c->count("--json") > 0 && a->json.empty()) a->json = "-";
        exit_code = run(*a);
    });
}

}  // namespace dimmer::cook
