#include <app/command.h>
#include <app/files.h>
#include <app/pack_id.h>
#include <app/say.h>
#include <app/terminal_progress.h>
#include <pipeline/heat_map.h>
#include <pipeline/level_files.h>
#include <pipeline/level_meshes.h>
#include <pipeline/profile.h>
#include <pipeline/verify.h>
#include <write/pack_writer.h>

#include <fmt/format.h>

#include <cmath>
#include <memory>

namespace dimmer::cook {
namespace {

struct VerifyArguments {
    std::string level, pack, json, heatmap, csv;
    VerifyOptions options;
    double max_error = -1;  // below 0: no limit
    bool no_sets = false;
};

std::string_view lightOf(const DoorReport& d) {
    switch (d.light) {
        case DoorReport::Light::All:
            return "all";
        case DoorReport::Light::AlwaysOn:
            return "always on";
        case DoorReport::Light::Set:
            return d.light_set;
    }
    return "";
}

std::string shareWithError(const EffectFigures& f) {
    return f.points == 0 ? "-" : fmt::format("{:.2f} +- {:.2f} %", 100 * f.error, 100 * f.sampling_error);
}

void printReport(const VerifyReport& r, const VerifyOptions& options) {
    fmt::print("{:<22} {:>8} {:>8} {:>8} {:>8} {:>16}\n", "points", "mean", "p95", "RMSE", "bias", "reference error");
    auto row = [](std::string_view name, const ErrorFigures& f) {
        fmt::print("{:<22} {:>6.2f} % {:>6.2f} % {:>6.2f} % {:>+6.2f} % {:>14.2f} %\n",
                   fmt::format("{} {}", f.points, name), 100 * f.mean, 100 * f.p95, 100 * f.rmse, 100 * f.bias,
                   100 * f.reference_error_mean);
    };
    row("surface", r.surface);
    row("tilted", r.tilted);
    if (r.grid.points > 0)
        row("grid", r.grid);
    else
        fmt::print("{:<22} the pack has none, or its places are black\n", "grid");
    if (r.models.shadowed.points > 0) {
        row("models", r.models.shadowed);
        row("- without self-visibility", r.models.plain);
    }
    fmt::print(
        "\nerror = |E - E_ref| / (E_ref + {:.4g} lux); tilted: normals within {:.0f} degrees of the surface's; "
        "grid: anywhere in the open\n",
        r.floor_lux, static_cast<double>(tilt_max_deg));
    fmt::print("{:.1f} M paths: {}\n", static_cast<double>(r.paths) / 1e6,
               r.converged ? "converged (the reference's error is at most a tenth of what is measured)"
                           : fmt::format("not converged within {} paths per point; what the noise adds is taken off",
                                         options.paths_max));
    for (const auto& [name, mean] : r.causes) fmt::print("cause {:<20} {:>6.2f} %\n", name, 100 * mean);
    if (!r.formats.empty()) fmt::print("\n{:<12} {:<8} {:>6} {:>8} {:>8}\n", "format", "model", "sets", "mean", "p95");
    for (const FormatError& f : r.formats)
        fmt::print("{:<12} {:<8} {:>6} {:>6.2f} % {:>6.2f} %\n", nameOf(f.color_format), nameOf(f.direction_model),
                   f.sets, 100 * f.mean, 100 * f.p95);
    if (!r.sets.empty())
        fmt::print("\n{:<26} {:>8} {:>8} {:>8} {:>10} {:>14}\n", "light set, alone", "error", "bias", "points",
                   "ref. noise", "energy dropped");
    for (const SetReport& s : r.sets)
        fmt::print("{:<26} {:>8} {:>+6.2f} % {:>8} {:>8.2f} % {:>12.2f} %\n", s.name,
                   s.effect.points == 0 ? "-" : fmt::format("{:.2f} %", 100 * s.effect.error), 100 * s.effect.bias,
                   s.effect.points, 100 * s.effect.reference_noise, 100 * s.energy_dropped);
    if (!r.sets.empty() && r.doors.empty())
        fmt::print("error: sum |dE - dE_ref| / sum |dE_ref|, dE what the set adds: places count by their light\n");
    if (options.doors && r.doors.empty()) fmt::print("\ndoors: the level has none that the state leaves closed\n");
    if (!r.doors.empty())
        fmt::print("\n{:<16} {:<20} {:>17} {:>8} {:>8} {:>10} {:>10} {:>18}\n", "door, opened", "light", "error",
                   "bias", "points", "ref. noise", "elsewhere", "light there, error");
    for (const DoorReport& d : r.doors)
        fmt::print("{:<16} {:<20} {:>17} {:>+6.2f} % {:>8} {:>8.2f} % {:>8.2f} % {:>18}\n", d.door, lightOf(d),
                   shareWithError(d.effect), 100 * d.effect.bias, d.effect.points, 100 * d.effect.reference_noise,
                   100 * d.effect.elsewhere, d.light_there ? shareWithError(*d.light_there) : "");
    if (!r.doors.empty())
        fmt::print(
            "error: sum |dE - dE_ref| / sum |dE_ref| where dE_ref is surely not 0, and its standard error by the "
            "choice of places;\nelsewhere: the same sum where dE_ref may be 0 and the pack is surely wrong\n");
}

nlohmann::ordered_json toJson(const ErrorFigures& f) {
    return {{"mean", f.mean},
            {"p95", f.p95},
            {"rmse", f.rmse},
            {"bias", f.bias},
            {"measured_mean", f.measured_mean},
            {"reference_relative_standard_error", f.reference_error_mean},
            {"points", f.points}};
}

nlohmann::ordered_json toJson(const EffectFigures& f) {
    return {{"error", f.error},
            {"bias", f.bias},
            {"points", f.points},
            {"reference_noise", f.reference_noise},
            {"sampling_error", f.sampling_error},
            {"elsewhere", f.elsewhere}};
}

nlohmann::ordered_json toJson(const VerifyReport& r, const VerifyArguments& a) {
    const VerifyOptions& options = a.options;
    nlohmann::ordered_json j;
    j["pack_id"] = packId(a.pack);
    j["level"] = a.level;
    j["state"] = options.state;
    j["seed"] = options.seed;
    j["paths_per_point_max"] = options.paths_max;
    j["paths"] = r.paths;
    j["converged"] = r.converged;
    j["reference_relative_standard_error"] = r.surface.reference_error_mean;
    j["floor_lux"] = r.floor_lux;
    j["surface"] = toJson(r.surface);
    j["tilted"] = toJson(r.tilted);
    j["grid"] = toJson(r.grid);
    if (r.models.shadowed.points > 0) {
        j["models"] = toJson(r.models.shadowed);
        j["models_without_self_visibility"] = toJson(r.models.plain);
    }
    j["causes"] = r.causes;
    j["sets"] = nlohmann::ordered_json::array();
    for (const FormatError& f : r.formats)
        j["formats"].push_back({{"color", nameOf(f.color_format)},
                                {"model", nameOf(f.direction_model)},
                                {"sets", f.sets},
                                {"mean", f.mean},
                                {"p95", f.p95}});
    for (const SetReport& s : r.sets) {
        nlohmann::ordered_json set = {{"name", s.name}};
        set.update(toJson(s.effect));
        set["energy_dropped"] = s.energy_dropped;
        j["sets"].push_back(set);
    }
    if (options.doors) j["doors"] = nlohmann::ordered_json::array();
    for (const DoorReport& d : r.doors) {
        nlohmann::ordered_json door = {
            {"door", d.door}, {"light", lightOf(d)}, {"is_light_set", d.light == DoorReport::Light::Set}};
        door.update(toJson(d.effect));
        if (d.light_there) door["light_there"] = toJson(*d.light_there);
        j["doors"].push_back(door);
    }
    return j;
}

// What was measured everywhere, for tools that look further.
Expected<void> writeCsv(const VerifyReport& report, const std::string& file) {
    std::string text = "x,y,z,nx,ny,nz,lux,reference_lux,reference_error_lux,kind\n";
    for (const auto& [kind, p, n, l] : report.places)
        text += fmt::format("{},{},{},{},{},{},{:.6g},{:.6g},{:.3g},{}\n", p.x, p.y, p.z, n.x, n.y, n.z, l.value_lux,
                            l.reference_lux, l.reference_error_lux, kind);
    return writeFileAtomically(file, std::as_bytes(std::span(text)));
}

// Noise adds to what is measured, at most itself. Where it is small against the limit, taking it off leaves the error;
// where it is not, that leaves anything, and what is above the limit with it may be below.
int judge(const ErrorFigures& f, double max_error, uint32_t paths) {
    const double noise = f.reference_error_mean, noise_max = max_error / 2;
    if (f.measured_mean <= max_error || (noise <= noise_max && f.mean <= max_error)) return exit_done;
    const bool hidden = noise_max > 0 && noise > noise_max && f.measured_mean - noise <= max_error;
    sayMessage(hidden ? fmt::format("the reference's noise, {:.4f}, hides whether the mean error is above {}: it takes "
                                    "some --paths {:.0f}",
                                    noise, max_error, std::ceil(paths * std::pow(noise / noise_max, 2)))
                      : fmt::format("the mean error, {:.4f}, is above {}",
                                    f.mean > max_error ? f.mean : f.measured_mean, max_error));
    return exit_above_max_error;
}

int run(VerifyArguments a) {
    std::vector<NamedFile> inputs = {{"LEVEL", a.level}, {"PACK", a.pack}};
    addFilesOf("LEVEL", filesNamedBy(a.level), inputs);
    std::vector<NamedFile> outputs = {printed("--json", a.json), {"--csv", a.csv}, {"--heatmap", a.heatmap, true}};
    addFilesOf("--heatmap", filesIn(a.heatmap, isHeatMapName), outputs);
    if (auto ok = checkFiles(inputs, outputs); !ok) return reportError(ok.error());
    if (auto ok = removeEarlierJson(a.json, {"surface", "floor_lux"}); !ok) return reportError(ok.error());
    const auto scene = importLevel(a.level);
    if (!scene) return reportError(scene.error());
    const auto pack = Pack::open(a.pack);
    if (!pack) return reportError(pack.error());
    if (!scene->warnings.empty())
        sayMessage(
            fmt::format("warning: {}: what was mended or left out of the level, in {} places as `dimmer cook` "
                        "says, is so for the reference too; the figures know nothing of it",
                        a.level, scene->warnings.size()));
    if (const std::string node = nodeThatDiffers(*scene, pack->meshes()); !node.empty())
        sayMessage(
            fmt::format("warning: {}: its node '{}' is not where {} has it, or is not there: the pack is of "
                        "another level, or the level was changed since; the figures hold one against the other",
                        a.level, node, a.pack));
    TerminalProgress progress;
    a.options.sets = !a.no_sets;
    const auto report = verify(*scene, *pack, a.options, progress);
    if (!report) return reportError(report.error());
    if (!a.heatmap.empty())
        if (auto ok = writeHeatMaps(a.heatmap, *pack, packId(a.pack), *report, a.options.state); !ok)
            return reportError(ok.error());
    if (!a.csv.empty())
        if (auto ok = writeCsv(*report, a.csv); !ok) return reportError(ok.error());
    if (!a.json.empty())
        if (auto ok = writeJson(toJson(*report, a), a.json); !ok) return reportError(ok.error());
    if (a.json != "-") printReport(*report, a.options);
    return a.max_error < 0 ? exit_done : judge(report->surface, a.max_error, a.options.paths_max);
}

}  // namespace

void addVerifyCommand(CLI::App& app, int& exit_code) {
    auto a = std::make_shared<VerifyArguments>();
    auto* c = app.add_subcommand("verify", "A pack's error against the reference path tracer");
    c->add_option("LEVEL", a->level, "the level that the pack was cooked from")->required();
    c->add_option("PACK", a->pack, "a cooked pack")->required();
    c->add_option("--state", a->options.state,
                  "weights, e.g. \"hall=0.5,alarm=1/0.2/0.2,door:front=1\"; what is not named: sets 1 (their "
                  "maximum where that is less), doors 0; a door "
                  "is 0 or 1");
    c->add_option("--points", a->options.points, "random places on lightmapped surfaces")
        ->check(CLI::Range(1u, 1000000u))
        ->capture_default_str();
    c->add_option("--paths", a->options.paths_max, "paths per point at most; fewer where they do")
        ->check(CLI::Range(2u, 1u << 24))
        ->capture_default_str();
    c->add_option("--seed", a->options.seed, "of points and paths")->capture_default_str();
    c->add_flag("--no-sets", a->no_sets, "leave out what each light set does alone");
    c->add_flag("--doors", a->options.doors,
                "also what opening each door does: to all light, to what is always on, and to each light set alone");
    c->add_flag("--causes", a->options.causes,
                "tell the error's causes apart, by baking the first passes again (doors closed)");
    c->add_flag("--formats", a->options.formats, "what each colour format and directional model would cost here");
    c->add_option(
         "--max-error", a->max_error,
         "exit with 4 when the mean error at surfaces is above, e.g. 0.1 for 10 %, or the reference's noise hides "
         "whether it is")
        ->check(refuseNoShare);
    c->add_option("--heatmap", a->heatmap,
                  "write the pages as PNGs there, points in blue (too dark) to red (too bright)");
    c->add_option("--csv", a->csv,
                  "write the light at every place of every kind there: the pack's and the reference's luminance, lux");
    c->add_option("--json", a->json, "write the report there; - for stdout");
    c->footer("Example: dimmer verify house.gltf house.dimmer --state \"alarm=0\" --max-error 0.1 --heatmap error");
    c->callback([a, &exit_code] { exit_code = run(*a); });
}

}  // namespace dimmer::cook
