#include "model_renderer.h"

#include "level_pipeline.h"
#include "shaders/draw_constants.glsl"

#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/gtc/constants.hpp>

namespace dimmer::sample {
namespace {

constexpr VkShaderStageFlags model_stages = VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT;
constexpr double turn_s = 10;

// As in model.glsl.
struct ModelDraw {
    ModelSlot light;
    Transform world_from_model;
    glm::vec4 box_min{0}, box_side{0};
    glm::vec4 reflectance{0}, emission_cd_m2{0};
};
static_assert(sizeof(ModelDraw) == 176);

glm::vec4 vec(const std::array<float, 3>& v) {
    return {v[0], v[1], v[2], 0};
}

bool isMover(const PlacedModel& model) {
    return !model.local_grid && model.mesh_count > 0;
}

glm::vec4 emission(const ModelMesh& mesh, const LightState& lights) {
    const Weight weight = mesh.emission_set ? lights.weight(LightSet{*mesh.emission_set}) : Weight(1);
    return vec(mesh.emission_cd_m2) * glm::vec4(weight.r, weight.g, weight.b, 0);
}

// About the upright line through the middle of the model's box where it stands.
Transform turned(const PlacedModel& model, float angle) {
    const auto& from = model.world_from_model.rows;
    std::array<float, 3> middle;
    for (size_t r = 0; r < 3; ++r) {
        middle[r] = from[r][3];
        for (size_t c = 0; c < 3; ++c) middle[r] += from[r][c] * 0.5f * (model.min_m[c] + model.max_m[c]);
    }
    const float cosine = std::cos(angle), sine = std::sin(angle);
    Transform out = model.world_from_model;
    for (size_t c = 0; c < 4; ++c) {
        const float x = from[0][c] - (c == 3 ? middle[0] : 0), z = from[2][c] - (c == 3 ? middle[2] : 0);
        out.rows[0][c] = cosine * x + sine * z + (c == 3 ? middle[0] : 0);
        out.rows[2][c] = cosine * z - sine * x + (c == 3 ? middle[2] : 0);
    }
    return out;
}

}  // namespace

uint32_t movingProbes(const Pack& pack) {
    uint32_t probes = 0;
    for (const PlacedModel& model : pack.models())
        if (isMover(model)) probes += (modelGrid(model.min_m, model.max_m).probeCount() + 7) / 8 * 8;
    return probes;
}

Expected<ModelRenderer> ModelRenderer::create(const VulkanContext& vulkan, Runtime& lights, VkRenderPass render_pass,
                                              VkExtent2D extent, bool self_visibility) {
    ModelRenderer renderer(lights.pack());
    renderer.self_visibility_ = self_visibility;
    // Without a global grid nothing says how what moves is lit.
    if (lights.gridTable() != VK_NULL_HANDLE) DIMMER_TRY(renderer.addMovers(lights));
    DIMMER_TRY(renderer.createGeometry(vulkan));
    if (renderer.draws_.empty()) return renderer;
    auto bindings = StorageBindings::create(vulkan.device, {lights.probes(0), renderer.draw_data_.buffer.get()},
                                            model_stages, sizeof(ModelConstants));
    if (!bindings) return std::unexpected(bindings.error());
    renderer.bindings_ = std::move(*bindings);
    auto pipeline = createModelPipeline(vulkan.device, renderer.bindings_.layout(), render_pass, extent);
    if (!pipeline) return std::unexpected(pipeline.error());
    renderer.pipeline_ = std::move(*pipeline);
    return renderer;
}

Expected<void> ModelRenderer::addMovers(LightState& lights) {
    for (uint32_t i = 0; i < pack_.models().size(); ++i) {
        const PlacedModel& model = pack_.models()[i];
        if (!isMover(model)) continue;
        const auto handle = lights.addModel(modelGrid(model.min_m, model.max_m), model.world_from_model);
        if (!handle) return std::unexpected(handle.error());
        movers_.push_back({i, *handle, model.world_from_model});
    }
    return {};
}

// As LevelRenderer does: one buffer each, in memory that the host sees.
Expected<void> ModelRenderer::createGeometry(const VulkanContext& vulkan) {
    size_t vertex_count = 0, index_count = 0;
    std::vector<Draw> of_mesh;
    for (const ModelMesh& mesh : pack_.modelMeshes()) {
        of_mesh.push_back({0, static_cast<uint32_t>(of_mesh.size()), static_cast<uint32_t>(index_count),
                           static_cast<uint32_t>(mesh.indices.size()), static_cast<int32_t>(vertex_count)});
        vertex_count += mesh.vertices.size();
        index_count += mesh.indices.size();
    }
    for (uint32_t i = 0; i < pack_.models().size(); ++i) {
        const PlacedModel& model = pack_.models()[i];
        if (!model.local_grid && std::ranges::find(movers_, i, &Mover::model) == movers_.end()) continue;
        for (uint32_t m = 0; m < model.mesh_count; ++m) {
            draws_.push_back(of_mesh[model.first_mesh + m]);
            draws_.back().model = i;
        }
    }
    if (draws_.empty()) return {};
    const auto create = [&](GpuBuffer& out, size_t bytes, VkBufferUsageFlags usage) -> Expected<void> {
        auto made = createBuffer(vulkan, std::max<size_t>(bytes, 4), usage, MemoryUse::Upload);
        if (!made) return std::unexpected(made.error());
        out = std::move(*made);
        return {};
    };
    DIMMER_TRY(create(vertices_, vertex_count * sizeof(ModelVertex), VK_BUFFER_USAGE_VERTEX_BUFFER_BIT));
    DIMMER_TRY(create(indices_, index_count * sizeof(uint32_t), VK_BUFFER_USAGE_INDEX_BUFFER_BIT));
    DIMMER_TRY(create(draw_data_, draws_.size() * sizeof(ModelDraw), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT));
    auto* vertex_out = reinterpret_cast<ModelVertex*>(vertices_.mapped);
    auto* index_out = reinterpret_cast<uint32_t*>(indices_.mapped);
    for (const ModelMesh& mesh : pack_.modelMeshes()) {
        vertex_out = std::copy(mesh.vertices.begin(), mesh.vertices.end(), vertex_out);
        index_out = std::copy(mesh.indices.begin(), mesh.indices.end(), index_out);
    }
    return {};
}

Expected<void> ModelRenderer::move(double seconds, LightState& lights) {
    for (Mover& mover : movers_) {
        const double angle = 2 * glm::pi<double>() * std::fmod(seconds / turn_s, 1.0);
        mover.transform = turned(pack_.models()[mover.model], static_cast<float>(angle));
        DIMMER_TRY(lights.moveModel(mover.handle, mover.transform));
    }
    return {};
}

Expected<void> ModelRenderer::draw(VkCommandBuffer commands, const glm::mat4& clip_from_world,
                                   const LightState& lights) const {
    if (draws_.empty()) return {};
    auto* data = reinterpret_cast<ModelDraw*>(draw_data_.mapped);
    for (size_t i = 0; i < draws_.size(); ++i) {
        const PlacedModel& model = pack_.models()[draws_[i].model];
        const ModelMesh& mesh = pack_.modelMeshes()[draws_[i].mesh];
        ModelDraw draw{{}, model.world_from_model, vec(mesh.min_m), {}, {}, emission(mesh, lights)};
        draw.box_side = vec(mesh.max_m) - draw.box_min;
        draw.reflectance = vec(mesh.reflectance);
        if (model.local_grid) {
            draw.light = pack_.localGridSlot(*model.local_grid);
        } else {
            const auto mover = std::ranges::find(movers_, draws_[i].model, &Mover::model);
            const auto slot = lights.modelSlot(mover->handle);
            if (!slot) return std::unexpected(slot.error());
            draw.light = *slot;
            draw.world_from_model = mover->transform;
        }
        std::memcpy(&data[i], &draw, sizeof(draw));
    }
    const ModelConstants constants{clip_from_world, pack_.exposure(), static_cast<uint32_t>(pack_.colorFormat()),
                                   self_visibility_ ? 1u : 0u};
    const VkBuffer vertices = vertices_.buffer.get();
    const VkDeviceSize offset = 0;
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline_.get());
    bindings_.bind(commands, &constants);
    vkCmdBindVertexBuffers(commands, 0, 1, &vertices, &offset);
    vkCmdBindIndexBuffer(commands, indices_.buffer.get(), 0, VK_INDEX_TYPE_UINT32);
    for (uint32_t i = 0; i < draws_.size(); ++i)
        vkCmdDrawIndexed(commands, draws_[i].index_count, 1, draws_[i].first_index, draws_[i].vertex_offset, i);
    return {};
}

}  // namespace dimmer::sample
