#include <app/command.h>
#include <app/files.h>
#include <app/say.h>
#include <app/terminal_progress.h>
#include <pipeline/level_files.h>
#include <pipeline/reference_state.h>
#include <pipeline/sample_points.h>
#include <write/pack_writer.h>

#include <fmt/format.h>

#include <memory>

namespace dimmer::cook {
namespace {

struct ReferenceArguments {
    std::string level, points, state, output = "-";
    uint32_t paths = 4096, seed = 1;
};

Expected<void> writeValues(const std::string& file, std::span<const QueryPoint> points,
                           std::span<const ReferenceEstimate> estimates) {
    std::string text = "x,y,z,nx,ny,nz,Er,Eg,Eb,SEr,SEg,SEb\n";
    for (size_t i = 0; i < points.size(); ++i) {
        const auto& [p, n] = points[i];
        const ReferenceValue v = estimates[i].value();
        const glm::vec3 e = v.irradiance_lux, s = v.standard_error_lux;
        text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", p.x, p.y, p.z, n.x, n.y, n.z, e.x, e.y, e.z, s.x,
                            s.y, s.z);
    }
    if (file != "-") return writeFileAtomically(file, std::as_bytes(std::span(text)));
    fmt::print("{}", text);
    return {};
}

int run(const ReferenceArguments& a) {
    std::vector<NamedFile> inputs = {{"LEVEL", a.level}, {"--points", a.points}};
    addFilesOf("LEVEL", filesNamedBy(a.level), inputs);
    if (auto ok = checkFiles(inputs, {printed("--output", a.output)}); !ok) return reportError(ok.error());
    const auto scene = importLevel(a.level);
    if (!scene) return reportError(scene.error());
    sayWarnings(scene->warnings);
    const auto state = readReferenceState(*scene, a.state);
    if (!state) return reportError(state.error());
    const auto points = readPoints(a.points);
    if (!points) return reportError(points.error());
    std::vector<ReferencePoint> where;
    for (const QueryPoint& q : *points) where.push_back({q.position_m, q.normal});
    const Scene as_it_stands = sceneInState(*scene, *state);
    const RayScene rays(as_it_stands);
    const ReferenceTracer tracer(rays, state->options(a.seed));
    std::vector<ReferenceEstimate> estimates(points->size());
    TerminalProgress progress;
    progress.stage("paths", points->size());
    refineAll(tracer, where, {.paths_min = a.paths, .paths_max = a.paths}, estimates, progress);
    progress.finish();
    if (auto ok = writeValues(a.output, *points, estimates); !ok) return reportError(ok.error());
    return exit_done;
}

}  // namespace

void addReferenceCommand(CLI::App& app, int& exit_code) {
    auto a = std::make_shared<ReferenceArguments>();
    auto* c = app.add_subcommand("reference", "Irradiance at points, by the reference path tracer (no pack needed)");
    c->add_option("LEVEL", a->level, "the level, .glb or .gltf")->required();
    c->add_option("--points", a->points, "CSV with the header x,y,z,nx,ny,nz (metres, glTF axes); - for stdin")
        ->required();
    c->add_option("--state", a->state,
                  "weights, e.g. \"hall=0.5,alarm=1/0.2/0.2,door:front=1\"; what is not named: sets 1 (their "
                  "maximum where that is less), doors 0; a door "
                  "is 0 or 1");
    c->add_option("--paths", a->paths, "paths per point; the standard error falls with their square root")
        ->check(CLI::Range(2u, 1u << 24))
        ->capture_default_str();
    c->add_option("--seed", a->seed, "of the random numbers")->capture_default_str();
    c->add_option("-o,--output", a->output,
                  "CSV to write: what a pack stores (lux; direct light of `indirect` lights left out) and its standard "
                  "error; - for stdout")
        ->capture_default_str();
    c->footer("Example: dimmer reference house.gltf --points in.csv --state \"all=0,hall=1\" > truth.csv");
    c->callback([a, &exit_code] { exit_code = run(*a); });
}

}  // namespace dimmer::cook
