// The C interface to packs.
#include <c/handles.h>

#include <fmt/format.h>
#include <pack/pack_data.h>

#include <algorithm>
#include <string>

namespace dimmer::c {
namespace {

thread_local std::string last_message;

dimmer_result resultOf(ErrorCode code) {
    switch (code) {
        case ErrorCode::InvalidArgument:
            return DIMMER_INVALID_ARGUMENT;
        case ErrorCode::NotFound:
            return DIMMER_NOT_FOUND;
        case ErrorCode::BadInput:
            return DIMMER_BAD_INPUT;
        case ErrorCode::Unsupported:
            return DIMMER_UNSUPPORTED;
        case ErrorCode::OutOfMemory:
            return DIMMER_OUT_OF_MEMORY;
        case ErrorCode::DeviceLost:
            return DIMMER_DEVICE_LOST;
        case ErrorCode::Io:
            return DIMMER_IO;
        case ErrorCode::OverBudget:  // of the cooker alone
        case ErrorCode::Internal:
            return DIMMER_INTERNAL;
    }
    return DIMMER_INTERNAL;
}

dimmer_result give(Expected<Pack> opened, dimmer_pack** pack) {
    if (!opened) return report(opened.error());
    *pack = new dimmer_pack{std::move(*opened)};
    return DIMMER_OK;
}

// The C vertex is the pack's own.
static_assert(sizeof(dimmer_vertex) == sizeof(MeshVertex));
static_assert(offsetof(dimmer_vertex, position_m) == offsetof(MeshVertex, position_m));
static_assert(offsetof(dimmer_vertex, normal) == offsetof(MeshVertex, normal));
static_assert(offsetof(dimmer_vertex, lightmap_uv) == offsetof(MeshVertex, lightmap_uv));

}  // namespace

dimmer_result report(ErrorCode code, const char* message) noexcept {
    try {
        last_message = message;
    } catch (...) {
        last_message.clear();  // no memory for the message: the result alone has to do
    }
    return resultOf(code);
}

dimmer_result noSuch(const char* what, uint32_t index, size_t count) {
    return report({ErrorCode::NotFound, fmt::format("there is no {} {}; the pack has {}", what, index, count)});
}

}  // namespace dimmer::c

using namespace dimmer;
using namespace dimmer::c;

const char* dimmer_error_message(void) {
    return last_message.c_str();
}

dimmer_result dimmer_pack_open(const char* path, dimmer_pack** pack) {
    if (!given(path, pack)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] { return give(Pack::open(path), pack); });
}

dimmer_result dimmer_pack_from_memory(const void* bytes, size_t byte_count, const char* name, dimmer_pack** pack) {
    if (!given(bytes, name, pack)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        return give(Pack::fromBytes({static_cast<const std::byte*>(bytes), byte_count}, name), pack);
    });
}

void dimmer_pack_close(dimmer_pack* pack) {
    delete pack;
}

dimmer_result dimmer_pack_get_info(const dimmer_pack* pack, dimmer_pack_info* info) {
    if (!given(pack, info)) return DIMMER_INVALID_ARGUMENT;
    const Pack& p = pack->pack;
    *info = {.page_count = p.pageCount(),
             .page_width = p.pageWidth(),
             .page_height = p.pageHeight(),
             .color_format = static_cast<dimmer_color_format>(p.colorFormat()),
             .direction_model = static_cast<dimmer_direction_model>(p.directionModel()),
             .exposure = p.exposure(),
             .element_count = static_cast<uint32_t>(p.elements().size()),
             .mesh_count = static_cast<uint32_t>(p.meshes().size()),
             .viewpoint_count = static_cast<uint32_t>(p.viewpoints().size()),
             .model_count = static_cast<uint32_t>(p.models().size()),
             .model_mesh_count = static_cast<uint32_t>(p.modelMeshes().size())};
    return DIMMER_OK;
}

dimmer_result dimmer_pack_get_element(const dimmer_pack* pack, uint32_t index, dimmer_element* element) {
    if (!given(pack, element)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto elements = pack->pack.elements();
        if (index >= elements.size()) return noSuch("element", index, elements.size());
        const Element& e = elements[index];
        *element = {e.name.c_str(), static_cast<dimmer_element_kind>(e.kind), e.max_weight};
        return DIMMER_OK;
    });
}

dimmer_result dimmer_pack_find_light_set(const dimmer_pack* pack, const char* name, uint32_t* element) {
    if (!given(pack, name, element)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto found = findLightSet(pack->pack, name);
        if (!found) return report(found.error());
        *element = found->element;
        return DIMMER_OK;
    });
}

dimmer_result dimmer_pack_find_door(const dimmer_pack* pack, const char* name, uint32_t* element) {
    if (!given(pack, name, element)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto found = findDoor(pack->pack, name);
        if (!found) return report(found.error());
        *element = found->element;
        return DIMMER_OK;
    });
}

dimmer_result dimmer_pack_get_mesh(const dimmer_pack* pack, uint32_t index, dimmer_mesh* mesh) {
    if (!given(pack, mesh)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto meshes = pack->pack.meshes();
        if (index >= meshes.size()) return noSuch("mesh", index, meshes.size());
        const Mesh& m = meshes[index];
        *mesh = {.node = m.node.c_str(),
                 .vertices = reinterpret_cast<const dimmer_vertex*>(m.vertices.data()),
                 .indices = m.indices.data(),
                 .vertex_count = static_cast<uint32_t>(m.vertices.size()),
                 .index_count = static_cast<uint32_t>(m.indices.size()),
                 .page = m.page,
                 .door = m.door.value_or(DIMMER_NONE),
                 .reflectance = {m.reflectance[0], m.reflectance[1], m.reflectance[2]},
                 .emission_cd_m2 = {m.emission_cd_m2[0], m.emission_cd_m2[1], m.emission_cd_m2[2]},
                 .emission_set = m.emission_set.value_or(DIMMER_NONE)};
        return DIMMER_OK;
    });
}

dimmer_result dimmer_pack_get_viewpoint(const dimmer_pack* pack, uint32_t index, dimmer_viewpoint* viewpoint) {
    if (!given(pack, viewpoint)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto viewpoints = pack->pack.viewpoints();
        if (index >= viewpoints.size()) return noSuch("viewpoint", index, viewpoints.size());
        const Viewpoint& v = viewpoints[index];
        *viewpoint = {.name = v.name.c_str(),
                      .position_m = {v.position_m[0], v.position_m[1], v.position_m[2]},
                      .forward = {v.forward[0], v.forward[1], v.forward[2]},
                      .vertical_fov_rad = v.vertical_fov_rad};
        return DIMMER_OK;
    });
}

dimmer_result dimmer_sample_lightmap(const dimmer_pack* pack, const uint32_t* irradiance, const uint32_t* direction,
                                     size_t texel_count, uint32_t page, const float uv[2],
                                     const float normal_tangent[3], float lux[3]) {
    if (!given(pack, irradiance, direction, uv, normal_tangent, lux) || !finite({{uv, 2}, {normal_tangent, 3}}))
        return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const Pack& p = pack->pack;
        if (page >= p.pageCount()) return noSuch("page", page, p.pageCount());
        if (texel_count < p.data().base_pages.size())
            return report({ErrorCode::InvalidArgument, fmt::format("the pages hold {} texels, the pack's {}",
                                                                   texel_count, p.data().base_pages.size())});
        const auto sampled = sampleLightmap(p, {irradiance, texel_count}, {direction, texel_count}, page,
                                            {uv[0], uv[1]}, {normal_tangent[0], normal_tangent[1], normal_tangent[2]});
        std::ranges::copy(sampled, lux);
        return DIMMER_OK;
    });
}
