#include <app/command.h>
#include <app/files.h>
#include <app/pack_id.h>
#include <pipeline/heat_map.h>
#include <report/report.h>
#include <write/pack_writer.h>

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <memory>

namespace dimmer::cook {
namespace {

struct ReportArguments {
    std::string pack, output, cook_json, verify_json, heat_maps;
};

Expected<nlohmann::json> readJson(const std::string& file) {
    std::error_code ignored;
    std::ifstream in(file);
    if (!in || !std::filesystem::is_regular_file(file, ignored))
        return fail(ErrorCode::Io, fmt::format("{}: it cannot be opened", file));
    auto json = nlohmann::json::parse(in, nullptr, false);
    if (json.is_discarded()) return fail(ErrorCode::BadInput, fmt::format("{}: it is no JSON", file));
    return json;
}

// Figures of another pack would be shown as this one's. Those of a version that named none are taken on trust.
Expected<void> checkPackOf(const nlohmann::json& json, const std::string& file, const std::string& command,
                           const std::string& pack) {
    const auto id = json.is_object() ? json.find("pack_id") : json.end();
    if (id == json.end() || *id == packId(pack)) return {};
    return fail(ErrorCode::BadInput,
                fmt::format("{}: it is of another pack than {}; run `dimmer {}` anew", file, pack, command));
}

// What `cook --json` wrote.
Expected<void> addCook(const std::string& file, const std::string& pack, ReportInput& input) {
    const auto json = readJson(file);
    if (!json) return std::unexpected(json.error());
    if (auto ok = checkPackOf(*json, file, "cook --json", pack); !ok) return ok;
    try {
        if (json->value("result", "cooked") != "cooked")
            return fail(ErrorCode::BadInput,
                        fmt::format("{}: it is of a cook that ended over its budgets, from which no pack came", file));
        input.seconds = json->at("seconds").get<std::map<std::string, double>>();
        if (const auto of_bake = json->find("bake_seconds"); of_bake != json->end())
            for (const auto& [stage, seconds] : of_bake->items())
                input.bake_seconds.emplace_back(stage, seconds.get<double>());
        input.warnings = json->at("warnings").get<std::vector<std::string>>();
    } catch (const nlohmann::json::exception&) {
        return fail(ErrorCode::BadInput, fmt::format("{}: it is not what `dimmer cook --json` writes", file));
    }
    return {};
}

// Whether all that the report shows of `verify --json` is there.
bool isVerifyReport(const nlohmann::json& json) {
    // A figure that is no number, such as an error of no points, is written as null.
    const auto isFigure = [](const nlohmann::json& v) { return v.is_number() || v.is_null(); };
    try {
        for (const char* where : {"surface", "tilted"})
            for (const char* figure : {"mean", "p95", "bias"})
                if (!isFigure(json.at(where).at(figure))) return false;
        for (const nlohmann::json& set : json.at("sets"))
            if (!set.at("name").is_string()) return false;
        return json.at("state").is_string() && json.at("converged").is_boolean() && json.at("sets").is_array();
    } catch (const nlohmann::json::exception&) {
        return false;
    }
}

Expected<void> addVerify(const std::string& file, const std::string& pack, ReportInput& input) {
    auto json = readJson(file);
    if (!json) return std::unexpected(json.error());
    if (!isVerifyReport(*json))
        return fail(ErrorCode::BadInput, fmt::format("{}: it is not what `dimmer verify --json` writes", file));
    if (auto ok = checkPackOf(*json, file, "verify --json", pack); !ok) return ok;
    input.verify = std::move(*json);
    return {};
}

// Pictures of another pack may have pages of the same size. Those of a version that did not say are taken on trust.
Expected<void> addHeatMaps(const std::string& folder, const std::string& pack, ReportInput& input) {
    input.heat_maps = folder;
    const auto index = input.heat_maps / heat_map_index;
    std::error_code ignored;
    if (folder.empty() || !std::filesystem::exists(index, ignored)) return {};
    const auto json = readJson(index.string());
    if (!json) return std::unexpected(json.error());
    if (auto ok = checkPackOf(*json, index.string(), "verify --heatmap", pack); !ok) return ok;
    if (input.verify.is_object() && json->contains("state") && json->at("state") != input.verify.at("state"))
        return fail(ErrorCode::BadInput,
                    fmt::format("{}: its pictures are of the state {}, the figures of --verify of {}; run `dimmer "
                                "verify` with both --json and --heatmap",
                                index.string(), json->at("state").dump(), input.verify.at("state").dump()));
    return {};
}

int run(const ReportArguments& a) {
    std::vector<NamedFile> inputs = {{"PACK", a.pack}, {"--cook", a.cook_json}, {"--verify", a.verify_json}};
    addFilesOf("--heatmap", filesIn(a.heat_maps, isHeatMapName), inputs);
    if (auto ok = checkFiles(inputs, {{"--output", a.output}}); !ok) return reportError(ok.error());
    const auto pack = Pack::open(a.pack);
    if (!pack) return reportError(pack.error());
    ReportInput input;
    input.title = std::filesystem::path(a.pack).filename().string();
    std::error_code ignored;
    input.file_bytes = std::filesystem::file_size(a.pack, ignored);
    if (!a.cook_json.empty())
        if (auto ok = addCook(a.cook_json, a.pack, input); !ok) return reportError(ok.error());
    if (!a.verify_json.empty())
        if (auto ok = addVerify(a.verify_json, a.pack, input); !ok) return reportError(ok.error());
    if (auto ok = addHeatMaps(a.heat_maps, a.pack, input); !ok) return reportError(ok.error());
    if (auto ok = writeReport(*pack, input, a.output); !ok) return reportError(ok.error());
    return exit_done;
}

}  // namespace

Expected<void> writeReport(const Pack& pack, const ReportInput& input, const std::string& file) {
    const auto html = reportHtml(pack, input);
    if (!html) return std::unexpected(html.error());
    return writeFileAtomically(file, std::as_bytes(std::span(*html)));
}

void addReportCommand(CLI::App& app, int& exit_code) {
    auto a = std::make_shared<ReportArguments>();
    auto* c = app.add_subcommand("report", "A pack as one HTML page: what costs what, and where");
    c->add_option("PACK", a->pack, "a cooked pack")->required();
    c->add_option("-o,--output", a->output, "the file to write, e.g. house.html")->required();
    c->add_option("--cook", a->cook_json, "what `dimmer cook --json` wrote: adds seconds per stage, and warnings");
    c->add_option("--verify", a->verify_json, "what `dimmer verify --json` wrote: adds errors");
    c->add_option("--heatmap", a->heat_maps, "the folder that `dimmer verify --heatmap` wrote: adds its pictures");
    c->footer(
        "Sizes are in bytes (kB, MB: 1000 and 1000000 of them). The page needs no network.\n"
        "Example: dimmer report house.dimmer --verify error.json --heatmap error -o house.html");
    c->callback([a, &exit_code] { exit_code = run(*a); });
}

}  // namespace dimmer::cook
