// What the final gather costs next to bare Embree calls on the same rays, on all threads, in one run.
//   build/bin/dimmer_bench --benchmark_counters_tabular=true
#include <bake/emitters.h>
#include <bake/final_gather.h>
#include <bake/sampling.h>
#include <charts/texels.h>
#include <charts/wall_cuts.h>

#include <benchmark/benchmark.h>
#include <embree3/rtcore.h>
#include <tbb/parallel_for.h>

#include <cstdlib>
#include <memory>

namespace dimmer::cook {
namespace {

constexpr float texels_per_metre = 4;
constexpr uint32_t rays_per_texel = 4 * rays_per_round;

// The house, or the level that DIMMER_BENCH_LEVEL names, ready to be gathered.
struct Level {
    Scene scene;
    std::unique_ptr<RayScene> rays;
    Unwrap charts;
    Texels texels;
    SparseLight outgoing;
    std::unique_ptr<EmitterSampler> emitters;
    std::unique_ptr<DoorPaths> paths;

    Level() {
        const char* named = std::getenv("DIMMER_BENCH_LEVEL");
        auto imported = importLevel(named ? named : DIMMER_SOURCE_DIR "/game_sample/levels/house.gltf");
        if (!imported) std::abort();
        scene = std::move(*imported);
        cutAtWalls(scene, texels_per_metre);
        rays = std::make_unique<RayScene>(scene);
        charts = *unwrap(*rays, {texels_per_metre, 2048});
        texels = sampleTexels(*rays, charts, 8);
        paths = std::make_unique<DoorPaths>(scene);
        std::vector<uint32_t> mesh_groups(scene.meshes.size(), always_group);
        emitters = std::make_unique<EmitterSampler>(*rays, mesh_groups);
        // One group everywhere: the least that a gather must look up at a hit.
        outgoing = SparseLight::build(texels.size(), [](size_t begin, size_t end, auto emit) {
            const TermLight one(always_group, glm::vec3(1), Rounding(begin, Rounding::Of::Outgoing));
            for (size_t i = begin; i < end; ++i) emit(std::span<const TermLight>(&one, 1));
        });
    }
};

const Level& level() {
    static const Level instance;
    return instance;
}

void setRate(benchmark::State& state) {
    const double rays = static_cast<double>(level().texels.size()) * rays_per_texel;
    state.counters["rays/s"] = benchmark::Counter(rays, benchmark::Counter::kIsIterationInvariantRate);
}

// Rays through rtcIntersect1 and nothing else, in the order of the gather.
void bareEmbree(benchmark::State& state) {
    const Level& l = level();
    RTCDevice device = rtcNewDevice(nullptr);
    RTCScene scene = rtcNewScene(device);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    const size_t triangles = l.rays->triangles().size();
    auto* positions = static_cast<glm::vec3*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(glm::vec3), 3 * triangles));
    auto* indices = static_cast<uint32_t*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(uint32_t), triangles));
    for (uint32_t t = 0; t < triangles; ++t)
        for (int i = 0; i < 3; ++i) {
            const uint32_t vertex = 3 * t + static_cast<uint32_t>(i);
            positions[vertex] = l.rays->corner(t, i);
            indices[vertex] = vertex;
        }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    rtcCommitScene(scene);
    for (auto _ : state) {
        tbb::parallel_for(size_t{0}, l.texels.size(), [&](size_t i) {
            const uint32_t seed = hash(1, static_cast<uint32_t>(i)), count = l.texels.sampleCount(i);
            std::vector<SamplePoint> points;
            for (uint32_t k = 0; k < count; ++k) points.push_back(samplePoint(*l.rays, l.charts, l.texels, i, k));
            float sum = 0;
            for (uint32_t r = 0; r < rays_per_texel; ++r) {
                const SamplePoint& p = points[r % count];
                const TangentFrame& f = l.charts.frames[p.face];
                const glm::vec3 d = cosineDirection(sequence2d(r, seed));
                const glm::vec3 w = f.tangent * d.x + f.bitangent * d.y + f.normal * d.z;
                RTCRayHit hit{};
                hit.ray = {p.position_m.x, p.position_m.y, p.position_m.z, 0, w.x, w.y, w.z, 0, 1e30f, ~0u, 0, 0};
                hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
                RTCIntersectContext context;
                rtcInitIntersectContext(&context);
                rtcIntersect1(scene, &context, &hit);
                sum += hit.ray.tfar;
            }
            benchmark::DoNotOptimize(sum);
        });
    }
    setRate(state);
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
}
BENCHMARK(bareEmbree)->UseRealTime()->Unit(benchmark::kMillisecond);

void finalGather(benchmark::State& state) {
    const Level& l = level();
    const Gatherer gatherer(*l.rays, l.charts, l.texels, *l.emitters, *l.paths);
    const std::vector<float> floors(l.paths->termCount(), 0.0f);
    const FinalGatherOptions options{
        .rays_max = rays_per_texel, .emitter_samples = 0, .noise_max = 0, .seed = 1, .floor_lux = floors};
    for (auto _ : state)
        forEachBlock(l.texels.size(), [&](size_t begin, size_t end) {
            FinalGather<Gathered> gather(gatherer);
            std::vector<ReceiverLight> row;
            std::vector<SamplePoint> points;
            for (size_t i = begin; i < end; ++i) {
                row.clear();
                gather.gather(gatherer.at(i, points), std::array{always_group}, l.outgoing, options, row);
                benchmark::DoNotOptimize(row.data());
            }
        });
    setRate(state);
}
BENCHMARK(finalGather)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dimmer::cook

BENCHMARK_MAIN();
