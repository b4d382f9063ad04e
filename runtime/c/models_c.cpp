// The C interface to light grids: models that move, models of the pack, and points in the air.
#include <c/handles.h>
#include <dimmer/probe_grid.h>
#include <fmt/format.h>
#include <format/probe.h>
#include <pack/pack_data.h>

#include <algorithm>
#include <bit>
#include <cstring>

namespace dimmer::c {
namespace {

// C's structures are the C++ ones.
static_assert(sizeof(dimmer_model_grid) == sizeof(ModelGrid) && sizeof(dimmer_model) == sizeof(Model));
static_assert(sizeof(dimmer_model_slot) == sizeof(ModelSlot) && sizeof(dimmer_model_vertex) == sizeof(ModelVertex));
static_assert(offsetof(dimmer_model_grid, counts) == offsetof(ModelGrid, counts));
static_assert(offsetof(dimmer_model_slot, grid_from_world) == offsetof(ModelSlot, grid_from_world));
static_assert(offsetof(dimmer_model_vertex, transfer) == offsetof(ModelVertex, transfer));
static_assert(sizeof(Transform) == 12 * sizeof(float));

Transform transformOf(const float world_from_model[12]) {
    std::array<float, 12> rows;
    std::copy_n(world_from_model, rows.size(), rows.begin());
    return std::bit_cast<Transform>(rows);
}

// Whether `word_count` words hold probes 0 .. probes - 1; reports it otherwise.
bool holds(const uint32_t* words, size_t word_count, uint64_t probes) {
    if (probes > 0 && !given(words)) return false;
    if (word_count / words_per_probe >= probes) return true;
    report({ErrorCode::InvalidArgument,
            fmt::format("{} words of probes were passed, {} are needed", word_count, probes * words_per_probe)});
    return false;
}

std::array<float, 3> vec3(const float v[3]) {
    return {v[0], v[1], v[2]};
}

}  // namespace
}  // namespace dimmer::c

using namespace dimmer;
using namespace dimmer::c;

dimmer_result dimmer_lights_add_model(dimmer_lights* lights, const dimmer_model_grid* grid,
                                      const float world_from_model[12], dimmer_model* model) {
    if (!given(lights, grid, world_from_model, model)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto added = lights->state().addModel(std::bit_cast<ModelGrid>(*grid), transformOf(world_from_model));
        if (!added) return report(added.error());
        *model = std::bit_cast<dimmer_model>(*added);
        return DIMMER_OK;
    });
}

dimmer_result dimmer_lights_move_model(dimmer_lights* lights, dimmer_model model, const float world_from_model[12]) {
    if (!given(lights, world_from_model)) return DIMMER_INVALID_ARGUMENT;
    return guarded(
        [&] { return finish(lights->state().moveModel(std::bit_cast<Model>(model), transformOf(world_from_model))); });
}

dimmer_result dimmer_lights_remove_model(dimmer_lights* lights, dimmer_model model) {
    if (!given(lights)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] { return finish(lights->state().removeModel(std::bit_cast<Model>(model))); });
}

dimmer_result dimmer_lights_get_model_slot(const dimmer_lights* lights, dimmer_model model, dimmer_model_slot* slot) {
    if (!given(lights, slot)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto found = lights->state().modelSlot(std::bit_cast<Model>(model));
        if (!found) return report(found.error());
        *slot = std::bit_cast<dimmer_model_slot>(*found);
        return DIMMER_OK;
    });
}

dimmer_result dimmer_lights_get_probes(const dimmer_lights* lights, const uint32_t** probes, size_t* word_count) {
    if (!given(lights, probes, word_count)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto* runtime = runtimeAs<CpuRuntime>(lights);
        if (!runtime) return DIMMER_UNSUPPORTED;
        *probes = runtime->probes().data();
        *word_count = runtime->probes().size();
        return DIMMER_OK;
    });
}

dimmer_result dimmer_lights_get_probe_buffers(const dimmer_lights* lights, VkBuffer* probes, VkBuffer* grid_table) {
    if (!given(lights, probes, grid_table)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto* runtime = runtimeAs<Runtime>(lights);
        if (!runtime) return DIMMER_UNSUPPORTED;
        *probes = runtime->probes(runtime->probeSet());
        *grid_table = runtime->gridTable();
        return DIMMER_OK;
    });
}

dimmer_result dimmer_sample_radiance(const dimmer_pack* pack, const uint32_t* probes, size_t word_count,
                                     const float point_m[3], uint32_t* hint, float radiance[27]) {
    if (!given(pack, point_m, radiance) || !finite({{point_m, 3}})) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        if (!holds(probes, word_count, pack->pack.data().probes.global.positions.size()))
            return DIMMER_INVALID_ARGUMENT;
        GridHint near{hint ? *hint : DIMMER_NONE};
        const Radiance found = GridSampler(pack->pack, {probes, word_count}).radiance(vec3(point_m), &near);
        if (hint) *hint = near.tetrahedron;
        std::memcpy(radiance, &found.coefficients, sizeof(found.coefficients));
        return DIMMER_OK;
    });
}

dimmer_result dimmer_sample_air(const dimmer_pack* pack, const uint32_t* probes, size_t word_count,
                                const float point_m[3], const float normal[3], uint32_t* hint, float lux[3]) {
    if (!given(normal, lux) || !finite({{normal, 3}})) return DIMMER_INVALID_ARGUMENT;
    std::array<float, 27> radiance;
    const dimmer_result done = dimmer_sample_radiance(pack, probes, word_count, point_m, hint, radiance.data());
    if (done != DIMMER_OK) return done;
    std::ranges::copy(irradiance(std::bit_cast<Radiance>(radiance), vec3(normal)), lux);
    return DIMMER_OK;
}

dimmer_result dimmer_sample_model(const dimmer_pack* pack, const uint32_t* probes, size_t word_count,
                                  const dimmer_model_slot* slot, const float point_m[3], const float normal[3],
                                  float lux[3]) {
    if (!given(pack, slot, point_m, normal, lux) || !finite({{point_m, 3}, {normal, 3}}))
        return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        uint64_t count = 1;
        for (const uint32_t n : slot->counts) {
            if (n < 1 || n > local_grid_side_max)
                return report({ErrorCode::InvalidArgument, fmt::format("a slot of {} probes along an axis", n)});
            count *= n;
        }
        if (!holds(probes, word_count, slot->first_probe + count)) return DIMMER_INVALID_ARGUMENT;
        const GridSampler sampler(pack->pack, {probes, word_count});
        std::ranges::copy(sampler.sample(std::bit_cast<ModelSlot>(*slot), vec3(point_m), vec3(normal)), lux);
        return DIMMER_OK;
    });
}

dimmer_result dimmer_pack_get_model(const dimmer_pack* pack, uint32_t index, dimmer_placed_model* model) {
    if (!given(pack, model)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto models = pack->pack.models();
        if (index >= models.size()) return noSuch("model", index, models.size());
        const PlacedModel& m = models[index];
        *model = {};
        model->node = m.node.c_str();
        model->first_mesh = m.first_mesh;
        model->mesh_count = m.mesh_count;
        model->moves = m.local_grid ? 0 : 1;
        if (m.local_grid) model->slot = std::bit_cast<dimmer_model_slot>(pack->pack.localGridSlot(*m.local_grid));
        std::memcpy(model->world_from_model, &m.world_from_model, sizeof(model->world_from_model));
        std::ranges::copy(m.min_m, model->min_m);
        std::ranges::copy(m.max_m, model->max_m);
        return DIMMER_OK;
    });
}

dimmer_result dimmer_pack_get_model_mesh(const dimmer_pack* pack, uint32_t index, dimmer_model_mesh* mesh) {
    if (!given(pack, mesh)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto meshes = pack->pack.modelMeshes();
        if (index >= meshes.size()) return noSuch("model mesh", index, meshes.size());
        const ModelMesh& m = meshes[index];
        *mesh = {.vertices = reinterpret_cast<const dimmer_model_vertex*>(m.vertices.data()),
                 .indices = m.indices.data(),
                 .vertex_count = static_cast<uint32_t>(m.vertices.size()),
                 .index_count = static_cast<uint32_t>(m.indices.size()),
                 .min_m = {m.min_m[0], m.min_m[1], m.min_m[2]},
                 .max_m = {m.max_m[0], m.max_m[1], m.max_m[2]},
                 .reflectance = {m.reflectance[0], m.reflectance[1], m.reflectance[2]},
                 .emission_cd_m2 = {m.emission_cd_m2[0], m.emission_cd_m2[1], m.emission_cd_m2[2]},
                 .emission_set = m.emission_set.value_or(DIMMER_NONE)};
        return DIMMER_OK;
    });
}
