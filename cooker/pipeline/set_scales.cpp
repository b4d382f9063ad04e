#include <pipeline/set_scales.h>

#include <bake/sampling.h>

#include <cmath>
#include <map>

namespace dimmer::cook {
namespace {

constexpr int mantissa_bits = 16;

float rounded(float x) {
    int exponent = 0;
    const float mantissa = std::frexp(x, &exponent);
    return std::ldexp(std::nearbyint(std::ldexp(mantissa, mantissa_bits)), exponent - mantissa_bits);
}

glm::vec3 divided(glm::vec3 light, glm::vec3 scale) {
    glm::vec3 out(0);
    for (int c = 0; c < 3; ++c)
        if (scale[c] > 0) out[c] = rounded(light[c] / scale[c]);
    return out;
}

// Emissive materials by the light set of the meshes that use them.
std::map<std::pair<uint32_t, uint32_t>, uint32_t> emissiveInSets(const Scene& scene) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> used;
    for (const SceneMesh& mesh : scene.meshes)
        for (const uint32_t m : mesh.triangle_materials)
            if (mesh.light_set && scene.materials[m].emission_cd_m2 != glm::vec3(0)) used[{*mesh.light_set, m}] = m;
    return used;
}

// Whether anything outside of the set is made of the material.
bool isShared(const Scene& scene, uint32_t material, uint32_t set) {
    for (const SceneMesh& mesh : scene.meshes)
        if (mesh.light_set != set && std::ranges::count(mesh.triangle_materials, material) > 0) return true;
    return false;
}

}  // namespace

SetScales divideByScales(Scene& scene) {
    SetScales scales;
    scales.of_group.assign(1 + scene.light_sets.size(), glm::vec3(0));
    scales.of_group[always_group] = glm::vec3(1);
    auto used = emissiveInSets(scene);
    std::vector<uint8_t> has_lamps(scales.of_group.size());
    for (const PunctualLight& light : scene.lights) {
        if (!light.light_set || light.bake == BakeMode::None) continue;
        glm::vec3& scale = scales.of_group[groupOf(light.light_set)];
        scale = glm::max(scale, light.intensity);
        has_lamps[groupOf(light.light_set)] = 1;
    }
    for (const auto& [key, material] : used)
        if (glm::vec3& scale = scales.of_group[groupOf(key.first)]; !has_lamps[groupOf(key.first)])
            scale = glm::max(scale, scene.materials[material].emission_cd_m2);
    // A channel that only emissive surfaces have.
    for (const auto& [key, material] : used)
        for (int c = 0; c < 3; ++c)
            if (float& scale = scales.of_group[groupOf(key.first)][c]; !(scale > 0))
                scale = scene.materials[material].emission_cd_m2[c];

    for (PunctualLight& light : scene.lights)
        if (light.light_set) light.intensity = divided(light.intensity, scales.of_group[groupOf(light.light_set)]);
    for (const Material& m : scene.materials) {
        scales.copy_of.push_back(static_cast<uint32_t>(scales.copy_of.size()));
        scales.emission_cd_m2.push_back(m.emission_cd_m2);
    }
    for (auto& [key, material] : used) {
        if (isShared(scene, material, key.first)) {
            scene.materials.push_back(scene.materials[material]);
            scales.emission_cd_m2.push_back(scales.emission_cd_m2[material]);
            scales.copy_of.push_back(material);
            material = static_cast<uint32_t>(scene.materials.size() - 1);
        }
        glm::vec3& emission = scene.materials[material].emission_cd_m2;
        emission = divided(emission, scales.of_group[groupOf(key.first)]);
    }
    for (SceneMesh& mesh : scene.meshes)
        for (uint32_t& m : mesh.triangle_materials)
            if (mesh.light_set)
                if (const auto own = used.find({*mesh.light_set, m}); own != used.end()) m = own->second;
    return scales;
}

void multiplyByScales(const SetScales& scales, Baked& baked) {
    baked.light.forEach([&](ReceiverLight& l) {
        const glm::vec3 scale = scales.of_group[baked.terms[l.term].group];
        const float before = luminance(l.light.irradiance_lux);
        l.light.irradiance_lux *= scale;
        const float after = luminance(l.light.irradiance_lux);
        l.light.tilted_lux *= before > 0 ? after / before : 0.0f;
    });
    for (auto* probes : {&baked.grid.light, &baked.local_light})
        probes->forEach([&](ProbeTermLight& l) {
            const glm::vec3 scale = scales.of_group[baked.terms[l.term].group];
            for (glm::vec3& coefficient : l.light.radiance) coefficient *= scale;
        });
}

}  // namespace dimmer::cook
