// A level cooked in memory and looked at through the runtime's own pages, as `dimmer sample` does.
#pragma once

#include <dimmer/cpu_runtime.h>
#include <gtest/gtest.h>
#include <pipeline/cook.h>
#include <pipeline/sample_points.h>

#include <memory>

namespace dimmer::cook::test {

// Fails the running test when the level does not cook.
inline std::optional<Pack> cooked(const Scene& scene, const std::string& quality) {
    const auto profile = loadProfile("desktop");
    SilentProgress progress;
    CookStats stats;
    auto data = cookScene(scene, *profile, quality, progress, stats);
    EXPECT_TRUE(data) << data.error().message;
    if (!data) return std::nullopt;
    auto pack = Pack::fromData(std::move(*data));
    EXPECT_TRUE(pack) << pack.error().message;
    return pack ? std::optional(*pack) : std::nullopt;
}

// Irradiance at points of surfaces; a point without a surface fails the test and reads 0.
inline std::vector<glm::dvec3> sampled(const Pack& pack, std::span<const QueryPoint> points, const std::string& state) {
    CpuRuntime runtime(pack);
    const auto applied = runtime.apply(state);
    EXPECT_TRUE(applied) << applied.error().message;
    runtime.update();
    const LightPages pages{{runtime.irradiancePages().begin(), runtime.irradiancePages().end()},
                           {runtime.directionPages().begin(), runtime.directionPages().end()}};
    std::vector<glm::dvec3> out;
    size_t missed = 0;
    for (const auto& e : sampleSurface(pack, pages, points)) {
        missed += !e;
        out.push_back(e ? glm::dvec3((*e)[0], (*e)[1], (*e)[2]) : glm::dvec3(0));
    }
    EXPECT_EQ(missed, 0u) << "points without a surface";
    return out;
}

}  // namespace dimmer::cook::test
