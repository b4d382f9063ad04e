// A bake without cook and encoding: what the baker says of each receiver, in floats.
#pragma once

#include <bake/bake.h>
#include <bake/progress.h>
#include <charts/texels.h>
#include <charts/unwrap.h>
#include <gtest/gtest.h>
#include <models/self_visibility.h>

#include <memory>

namespace dimmer::cook::test {

inline SilentProgress no_progress;

struct BakedScene {
    explicit BakedScene(const Scene& scene_in, float texels_per_metre = 4, uint32_t samples = 4)
        : scene(scene_in), rays(std::make_unique<RayScene>(scene)) {
        findTransfers(scene, no_progress);
        auto unwrapped = unwrap(*rays, {.texels_per_metre = texels_per_metre, .page_size = 2048});
        if (!unwrapped) {
            ADD_FAILURE() << unwrapped.error().message;
            return;
        }
        charts = std::move(*unwrapped);
        texels = sampleTexels(*rays, charts, samples);
    }
    BakedScene(const BakedScene&) = delete;
    BakedScene& operator=(const BakedScene&) = delete;

    void bake(const BakeSettings& settings) { baked = cook::bake(*rays, charts, texels, settings, no_progress); }
    // Of one term at a receiver; nothing stored is darkness.
    glm::vec3 lux(size_t receiver, uint32_t term = always_group) const {
        for (const ReceiverLight& l : baked.light.row(receiver))
            if (l.term == term) return l.light.irradiance_lux;
        return glm::vec3(0);
    }
    glm::vec3 normal(size_t receiver) const { return charts.frames[texels.face(receiver)].normal; }
    // Name of the mesh that a receiver belongs to.
    const std::string& meshOf(size_t receiver) const {
        const Face& face = charts.faces[texels.face(receiver)];
        return scene.meshes[rays->triangles()[face.triangle].mesh].node;
    }
    // Mean of f(position) over a receiver's sample points: what a bake of f's light must give there.
    double mean(size_t receiver, auto&& f) const {
        double sum = 0;
        const uint32_t n = texels.sampleCount(receiver);
        for (uint32_t i = 0; i < n; ++i) sum += f(glm::dvec3(position(receiver, i)));
        return sum / n;
    }
    glm::vec3 position(size_t receiver, uint32_t i) const {
        return samplePoint(*rays, charts, texels, receiver, i).position_m;
    }
    glm::vec3 place(size_t receiver) const { return position(receiver, 0); }

    Scene scene;
    std::unique_ptr<RayScene> rays;
    Unwrap charts;
    Texels texels;
    Baked baked;
};

}  // namespace dimmer::cook::test
