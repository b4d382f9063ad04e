#include <app/command.h>
#include <app/files.h>
#include <app/say.h>
#include <dimmer/cpu_runtime.h>
#include <dimmer/runtime.h>
#include <pack/pack_data.h>
#include <pipeline/sample_points.h>
#include <tools/headless_device.h>

#include <fmt/format.h>

#include <memory>

namespace dimmer::cook {
namespace {

struct SampleArguments {
    std::string pack, points, state, from = "surface", backend = "cpu", output = "-";
};

Expected<LightPages> pagesOnCpu(const Pack& pack, const std::string& state) {
    CpuRuntime runtime(pack);
    if (auto ok = runtime.apply(state); !ok) return std::unexpected(ok.error());
    runtime.update();
    return LightPages{{runtime.irradiancePages().begin(), runtime.irradiancePages().end()},
                      {runtime.directionPages().begin(), runtime.directionPages().end()},
                      {runtime.probes().begin(), runtime.probes().end()}};
}

Expected<LightPages> pagesOnGpu(const Pack& pack, const std::string& state) {
    auto device = HeadlessDevice::create({});
    if (!device) return std::unexpected(device.error());
    auto runtime = Runtime::create(device->context(), pack);
    if (!runtime) return std::unexpected(runtime.error());
    if (auto ok = runtime->apply(state); !ok) return std::unexpected(ok.error());
    if (auto ok = runtime->submit(); !ok) return std::unexpected(ok.error());
    auto pages = runtime->readPages();
    if (!pages) return std::unexpected(pages.error());
    return LightPages{std::move(pages->irradiance), std::move(pages->direction), std::move(pages->probes)};
}

int run(const SampleArguments& a) {
    if (auto ok = checkFiles({{"PACK", a.pack}, {"--points", a.points}}, {printed("--output", a.output)}); !ok)
        return reportError(ok.error());
    const auto pack = Pack::open(a.pack);
    if (!pack) return reportError(pack.error());
    const auto points = readPoints(a.points);
    if (!points) return reportError(points.error());
    const auto pages = a.backend == "gpu" ? pagesOnGpu(*pack, a.state) : pagesOnCpu(*pack, a.state);
    if (!pages) return reportError(pages.error());
    if (a.from == "grid" && pack->data().probes.global.empty())
        return reportError({ErrorCode::BadInput, a.pack + ": the pack has no global grid; cook it with --set "
                                                          "grids.global=on, or take --from surface."});
    const auto samples = a.from == "grid" ? sampleGrid(*pack, *pages, *points) : sampleSurface(*pack, *pages, *points);
    if (auto ok = writeSamples(a.output, *points, samples); !ok) return reportError(ok.error());
    size_t missed = 0;
    for (const auto& s : samples) missed += !s;
    if (missed > 0)
        sayMessage(fmt::format("note: {} of {} points have no lightmapped surface within {:.0f} cm; they are nan",
                               missed, samples.size(), 100.0 * static_cast<double>(surface_reach_m)));
    return exit_done;
}

}  // namespace

void addSampleCommand(CLI::App& app, int& exit_code) {
    auto a = std::make_shared<SampleArguments>();
    auto* c = app.add_subcommand("sample", "Irradiance in lux at points, from the pages that the runtime blends");
    c->add_option("PACK", a->pack, "a cooked pack")->required();
    c->add_option("--points", a->points, "CSV with the header x,y,z,nx,ny,nz (metres, glTF axes); - for stdin")
        ->required();
    c->add_option("--state", a->state,
                  "weights: a light set's name = scalar or r/g/b (1: as baked), door:NAME = 0 closed .. 1 open; e.g. "
                  "\"hall=0.5,alarm=1/0.2/0.2,door:front=1\". What is not named: sets 1 (their maximum where that is "
                  "less), doors 0. "
                  "all=0 turns every set "
                  "off first");
    c->add_option("--from", a->from,
                  "surface: the lightmap at the nearest surface within 10 cm; grid: the light probes, anywhere")
        ->check(CLI::IsMember({"surface", "grid"}))
        ->capture_default_str();
    c->add_option("--backend", a->backend, "who blends the pages: cpu or gpu (Vulkan)")
        ->check(CLI::IsMember({"cpu", "gpu"}))
        ->capture_default_str();
    c->add_option("-o,--output", a->output, "CSV to write, with Er,Eg,Eb in lux added; - for stdout")
        ->capture_default_str();
    c->footer(
        "Points without a lightmapped surface within 10 cm that faces along their normal get nan; the grid has light\n"
        "everywhere.\n"
        "Example: dimmer sample house.dimmer --points in.csv --state \"all=0,hall=1\" > out.csv");
    c->callback([a, &exit_code] { exit_code = run(*a); });
}

}  // namespace dimmer::cook
