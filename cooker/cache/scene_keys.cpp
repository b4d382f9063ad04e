#include <cache/scene_keys.h>

#include <scene/emission.h>
#include <scene/ies.h>

#include <map>

namespace dimmer::cook {
namespace {

KeyBuilder& add(KeyBuilder& key, glm::vec3 v) {
    for (int c = 0; c < 3; ++c) key.add(v[c]);
    return key;
}

template <class T>
KeyBuilder& addAll(KeyBuilder& key, const std::vector<T>& values) {
    return key.addArray(std::span<const T>(values));
}

void addMatrix(KeyBuilder& key, const glm::dmat4& m) {
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row) key.add(std::bit_cast<uint64_t>(m[column][row]));
}

// What a material does to light that it did not emit.
void addSurface(KeyBuilder& key, const Material& m) {
    add(key, m.base_color);
    key.add(m.metallic).add(m.specular).add(m.alpha).add(m.alpha_mode).add(m.alpha_cutoff);
    key.add(uint32_t{m.double_sided}).addOptional(m.base_color_texture);
}

void addImage(KeyBuilder& key, const Image& image) {
    key.add(image.width).add(image.height);
    addAll(key, image.texels);
}

void addTexture(KeyBuilder& key, const Texture& texture) {
    key.add(texture.width).add(texture.height).add(texture.transfer);
    addAll(key, texture.texels);
}

// Numbers of the file, of which it matters alone which are the same: a camera more shifts them all.
class Ranks {
   public:
    // Of the first that has the number; -1 stays what it is.
    int of(int number) {
        return number < 0 ? number : ranks_.try_emplace(number, static_cast<int>(ranks_.size())).first->second;
    }

   private:
    std::map<int, int> ranks_;
};

void addMesh(KeyBuilder& key, const SceneMesh& mesh, Ranks& nodes, Ranks& meshes) {
    addAll(key, mesh.positions_m);
    addAll(key, mesh.normals);
    addAll(key, mesh.uv0);
    addAll(key, mesh.uv1);
    addAll(key, mesh.triangles);
    addAll(key, mesh.triangle_materials);
    addAll(key, mesh.triangle_regions);
    key.add(mesh.lighting).addOptional(mesh.door).add(uint32_t{mesh.is_open_leaf});
    addMatrix(key, mesh.open_from_closed);
    key.addOptional(mesh.texels_per_metre).addOptional(mesh.grid_spacing_m);
    key.add(nodes.of(mesh.gltf_node)).add(meshes.of(mesh.gltf_mesh));
    addMatrix(key, mesh.world_from_node);
}

void addLamp(KeyBuilder& key, const PunctualLight& light) {
    key.add(light.type).add(light.bake);
    add(key, light.position_m);
    add(key, light.direction);
    add(key, light.intensity);
    key.addOptional(light.range_m).add(light.cone_inner_cos).add(light.cone_outer_cos);
    key.add(uint32_t{light.profile != nullptr});
    if (!light.profile) return;
    addAll(key, light.profile->vertical_deg);
    addAll(key, light.profile->horizontal_deg);
    addAll(key, light.profile->share);
    for (int column = 0; column < 3; ++column) add(key, light.profile_from_world[column]);
}

void addSky(KeyBuilder& key, const Scene& scene) {
    add(key, scene.sky_radiance_cd_m2);
    key.add(uint32_t{scene.sky_image != nullptr});
    if (scene.sky_image) addImage(key, *scene.sky_image);
}

// As the level has them, whatever the lamps are that a set is taken apart into: paths are the same.
void addCombinations(KeyBuilder& key, const Scene& scene) {
    std::vector<std::vector<std::pair<bool, std::string>>> named;
    for (const auto& combination : scene.combinations) {
        std::vector<std::pair<bool, std::string>> names;
        for (const ElementRef& e : combination) {
            const std::string& own = e.is_door ? scene.doors[e.index].name : scene.light_sets[e.index].name;
            const bool is_part = !e.is_door && !scene.light_sets[e.index].part_of.empty();
            names.emplace_back(e.is_door, is_part ? scene.light_sets[e.index].part_of : own);
        }
        if (named.empty() || named.back() != names) named.push_back(std::move(names));
    }
    key.add(uint64_t{named.size()});
    for (const auto& names : named) {
        key.add(uint64_t{names.size()});
        for (const auto& [is_door, name] : names) key.add(uint32_t{is_door}).add(name);
    }
}

void addPlayAreas(KeyBuilder& key, const Scene& scene) {
    key.add(uint64_t{scene.play_areas.size()});
    for (const PlayArea& area : scene.play_areas)
        for (int column = 0; column < 4; ++column)
            for (int row = 0; row < 4; ++row) key.add(area.box_from_world[column][row]);
}

}  // namespace

Key geometryKey(const Scene& scene) {
    KeyBuilder key("geometry");
    key.add(uint64_t{scene.materials.size()});
    for (const Material& m : scene.materials) addSurface(key, m);
    key.add(uint64_t{scene.textures.size()});
    for (const auto& texture : scene.textures) addTexture(key, *texture);
    key.add(uint64_t{scene.meshes.size()});
    Ranks nodes, meshes;
    for (const SceneMesh& mesh : scene.meshes) addMesh(key, mesh, nodes, meshes);
    key.add(uint64_t{scene.models.size()});
    for (const SceneModel& model : scene.models)
        for (int axis = 0; axis < 3; ++axis) key.add(model.probes[axis]);
    key.add(uint64_t{scene.doors.size()});
    for (const SceneDoor& door : scene.doors) key.add(door.name).add(uint32_t{door.pose});
    addCombinations(key, scene);
    return key.finish();
}

Key sceneKey(const Scene& scene) {
    KeyBuilder key("scene");
    key.add(geometryKey(scene)).add(scene.file);
    for (const SceneMesh& mesh : scene.meshes) key.add(mesh.node);  // the pack and warnings name it
    key.add(uint64_t{scene.light_sets.size()});
    for (uint32_t s = 0; s < scene.light_sets.size(); ++s)
        key.add(scene.light_sets[s].name).add(scene.light_sets[s].max_weight);
    for (uint32_t g = 0; g <= scene.light_sets.size(); ++g) key.add(lampsKey(scene, g));
    for (const PunctualLight& light : scene.lights) key.add(light.node);  // warnings name it
    key.add(uint64_t{scene.viewpoints.size()});
    for (const SceneViewpoint& v : scene.viewpoints) {
        key.add(v.name).add(v.vertical_fov_rad);
        add(add(key, v.position_m), v.forward);
    }
    addPlayAreas(key, scene);
    key.add(uint64_t{scene.dynamic_places.size()});
    for (const DynamicPlace& place : scene.dynamic_places) addMatrix(key.add(place.node), place.world_from_node);
    key.add(uint64_t{scene.warnings.size()});
    for (const std::string& warning : scene.warnings) key.add(warning);
    return key.finish();
}

Key chartsKey(const Key& geometry, const UnwrapOptions& options, uint32_t samples_per_texel) {
    return KeyBuilder("charts")
        .add(geometry)
        .add(options.texels_per_metre)
        .add(options.page_size)
        .add(samples_per_texel)
        .finish();
}

Key bakeSettingsKey(const BakeSettings& s) {
    return KeyBuilder("bake settings")
        .add(s.series_rays)
        .add(s.final_rays)
        .add(s.emitter_samples)
        .add(s.noise_max)
        .add(uint32_t{s.denoise})
        .add(uint32_t{s.sharpen})
        .add(s.bounces_max)
        .add(s.tail_max)
        .add(s.door_share)
        .add(s.seed)
        .add(uint32_t{s.light_grid})
        .finish();
}

Key lampsKey(const Scene& scene, uint32_t group) {
    KeyBuilder key("lamps");
    if (group == always_group)
        addSky(key, scene);
    else
        key.add(scene.light_sets[group - 1].name).add(uint32_t{scene.light_sets[group - 1].always_on});
    for (const PunctualLight& light : scene.lights)
        if (groupOf(light.light_set) == group && light.bake != BakeMode::None) addLamp(key, light);
    key.add(std::string_view("emitters"));
    for (uint32_t m = 0; m < scene.meshes.size(); ++m) {
        const SceneMesh& mesh = scene.meshes[m];
        if (groupOf(mesh.light_set) != group) continue;
        glm::vec3 last(0);
        for (uint32_t t = 0; t < mesh.triangle_materials.size(); ++t) {
            const glm::vec3 emission = emissionOf(scene, mesh, t);
            if (emission == last) continue;
            add(key.add(m).add(t), emission);
            last = emission;
        }
    }
    return key.finish();
}

Key groupKey(const Key& charts, const Key& settings, float threshold, const Key& lamps) {
    return KeyBuilder("light").add(charts).add(settings).add(threshold).add(lamps).finish();
}

Key sceneRaysKey(const Key& charts, const Key& settings, const Scene& scene) {
    KeyBuilder key("scene of rays");
    key.add(charts).add(settings);
    for (uint32_t m = 0; m < scene.meshes.size(); ++m)
        for (uint32_t t = 0; t < scene.meshes[m].triangle_materials.size(); ++t)
            if (emissionOf(scene, scene.meshes[m], t) != glm::vec3(0)) key.add(m).add(t);
    return key.finish();
}

Key raysKey(const Key& scene, std::string_view kind, std::span<const glm::vec3> places) {
    return KeyBuilder("rays").add(scene).add(kind).addArray(places).finish();
}

Key sitesKey(const Key& group, std::span<const SiteBlock> blocks) {
    KeyBuilder key("sites");
    key.add(group);
    for (const SiteBlock& block : blocks) key.add(block.rays).addArray(std::span(block.places_m));
    return key.finish();
}

Key placesKey(const Key& scene, std::span<const float> what) {
    return KeyBuilder("places").add(scene).addArray(what).finish();
}

Key gridSettingsKey(const GridSettings& s, const Scene& scene, const Box& air) {
    KeyBuilder key("grid settings");
    key.add(s.probes_max).add(s.probes_per_m3).add(s.min_spacing_m).add(s.sites).add(s.site_rays).add(s.tolerance);
    key.add(uint32_t{s.uniform}).add(uint32_t{s.fit}).add(uint32_t{s.visibility});
    addPlayAreas(key, scene);
    return add(add(key, air.min_m), air.max_m).finish();
}

Key lampOrderKey(const Scene& scene) {
    KeyBuilder key("order of lamps");
    for (const PunctualLight& light : scene.lights)
        if (light.bake != BakeMode::None) key.add(groupOf(light.light_set));
    return key.finish();
}

Key gridKey(const Key& settings, const Key& lamp_order, std::span<const Key> groups) {
    KeyBuilder key("grid");
    key.add(settings).add(lamp_order).add(uint64_t{groups.size()});
    for (const Key& group : groups) key.add(group);
    return key.finish();
}

}  // namespace dimmer::cook
