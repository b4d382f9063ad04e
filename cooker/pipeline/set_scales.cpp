#include <pipeline/set_scales.h>

#include <bake/sampling.h>

#include <algorithm>
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

// Emissive materials by the light group of the meshes that use them.
std::map<std::pair<uint32_t, uint32_t>, uint32_t> emissiveInGroups(const Scene& scene) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> used;
    for (const SceneMesh& mesh : scene.meshes)
        for (const uint32_t m : mesh.triangle_materials)
            if (scene.materials[m].emission_cd_m2 != glm::vec3(0)) used[{groupOf(mesh.light_set), m}] = m;
    return used;
}

// Whether anything outside of the group is made of the material.
bool isShared(const Scene& scene, uint32_t material, uint32_t group) {
    for (const SceneMesh& mesh : scene.meshes)
        if (groupOf(mesh.light_set) != group && std::ranges::count(mesh.triangle_materials, material) > 0) return true;
    return false;
}

// Nor is what is divided by the scale of lamps that nobody would see beside it: it would overflow.
void fillBlackChannels(glm::vec3& scale, glm::vec3 light) {
    constexpr float unseen = 1e-12f;
    for (int c = 0; c < 3; ++c)
        if (!(scale[c] > unseen * light[c])) scale[c] = light[c];
}

}  // namespace

SetScales divideByScales(Scene& scene) {
    SetScales scales;
    scales.of_group.assign(1 + scene.light_sets.size(), glm::vec3(0));
    std::vector<glm::vec3> surfaces(scales.of_group.size(), glm::vec3(0));
    auto used = emissiveInGroups(scene);
    for (const PunctualLight& light : scene.lights) {
        if (light.bake == BakeMode::None) continue;
        glm::vec3& scale = scales.of_group[groupOf(light.light_set)];
        scale = glm::max(scale, light.intensity);
    }
    for (const auto& [key, material] : used)
        surfaces[key.first] = glm::max(surfaces[key.first], scene.materials[material].emission_cd_m2);
    for (size_t g = 1; g < surfaces.size(); ++g) fillBlackChannels(scales.of_group[g], surfaces[g]);
    // One number for all channels: no game recolours it, and so directions are weighted by its true colours.
    glm::vec3& of_always = scales.of_group[always_group];
    of_always = glm::max(of_always, glm::max(scene.sky_radiance_cd_m2, surfaces[always_group]));
    of_always = glm::vec3(std::max({of_always.x, of_always.y, of_always.z}));

    for (PunctualLight& light : scene.lights)
        if (light.bake != BakeMode::None)
            light.intensity = divided(light.intensity, scales.of_group[groupOf(light.light_set)]);
    scene.sky_radiance_cd_m2 = divided(scene.sky_radiance_cd_m2, scales.of_group[always_group]);
    for (const Material& m : scene.materials) {
        scales.copy_of.push_back(static_cast<uint32_t>(scales.copy_of.size()));
        scales.emission_cd_m2.push_back(m.emission_cd_m2);
    }
    // Sets have copies of what they share; always-on light keeps the level's own, and is divided when those are made.
    for (const bool always : {false, true})
        for (auto& [key, material] : used) {
            if ((key.first == always_group) != always) continue;
            if (!always && isShared(scene, material, key.first)) {
                scene.materials.push_back(scene.materials[material]);
                scales.emission_cd_m2.push_back(scales.emission_cd_m2[material]);
                scales.copy_of.push_back(material);
                material = static_cast<uint32_t>(scene.materials.size() - 1);
            }
            glm::vec3& emission = scene.materials[material].emission_cd_m2;
            emission = divided(emission, scales.of_group[key.first]);
        }
    for (SceneMesh& mesh : scene.meshes)
        for (uint32_t& m : mesh.triangle_materials)
            if (const auto own = used.find({groupOf(mesh.light_set), m}); own != used.end()) m = own->second;
    return scales;
}

Gathered multiplied(const Gathered& light, glm::vec3 scale) {
    const glm::vec3 irradiance_lux = light.irradiance_lux * scale;
    const float before = luminance(light.irradiance_lux);
    return {irradiance_lux, light.tilted_lux * (before > 0 ? luminance(irradiance_lux) / before : 0.0f)};
}

void multiplyByScales(const SetScales& scales, Baked& baked) {
    baked.light.forEach(
        [&](ReceiverLight& l) { l.light = multiplied(l.light, scales.of_group[baked.terms[l.term].group]); });
    for (auto* probes : {&baked.grid.light, &baked.local_light})
        probes->forEach([&](ProbeTermLight& l) {
            const glm::vec3 scale = scales.of_group[baked.terms[l.term].group];
            for (glm::vec3& coefficient : l.light.radiance) coefficient *= scale;
        });
}

}  // namespace dimmer::cook
