#include "sphere_renderer.h"

#include "level_pipeline.h"
#include "shaders/draw_constants.glsl"

#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>
#include <pack/pack_data.h>

#include <algorithm>
#include <cstring>

namespace dimmer::sample {
namespace {

constexpr uint32_t sphere_vertices = 24 * 12 * 6;  // columns, rows and corners of sphere.vert
constexpr VkShaderStageFlags stages = VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT;

}  // namespace

std::vector<Sphere> probeSpheres(const Pack& pack, float radius_m) {
    std::vector<Sphere> spheres;
    for (const ProbePosition& p : pack.data().probes.global.positions) {
        const auto number = static_cast<uint32_t>(spheres.size());
        spheres.push_back({{p.x_m, p.y_m, p.z_m}, radius_m, glm::vec4(0.8f), {number, {1, 1, 1}, {}}});
    }
    return spheres;
}

Expected<SphereRenderer> SphereRenderer::create(const VulkanContext& vulkan, const Runtime& lights,
                                                VkRenderPass render_pass, VkExtent2D extent, uint32_t spheres_max) {
    SphereRenderer renderer;
    renderer.exposure_ = lights.pack().exposure();
    renderer.color_format_ = static_cast<uint32_t>(lights.pack().colorFormat());
    auto spheres =
        createBuffer(vulkan, spheres_max * sizeof(Sphere), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, MemoryUse::Upload);
    if (!spheres) return std::unexpected(spheres.error());
    renderer.spheres_ = std::move(*spheres);
    auto bindings = StorageBindings::create(vulkan.device, {lights.probes(0), renderer.spheres_.buffer.get()}, stages,
                                            sizeof(SphereConstants));
    if (!bindings) return std::unexpected(bindings.error());
    renderer.bindings_ = std::move(*bindings);
    auto pipeline = createSpherePipeline(vulkan.device, renderer.bindings_.layout(), render_pass, extent);
    if (!pipeline) return std::unexpected(pipeline.error());
    renderer.pipeline_ = std::move(*pipeline);
    return renderer;
}

void SphereRenderer::draw(VkCommandBuffer commands, const glm::mat4& clip_from_world,
                          std::span<const Sphere> spheres) const {
    const size_t count = std::min<size_t>(spheres.size(), spheres_.size_bytes / sizeof(Sphere));
    if (count == 0) return;
    std::memcpy(spheres_.mapped, spheres.data(), count * sizeof(Sphere));
    const SphereConstants constants{clip_from_world, exposure_, color_format_};
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline_.get());
    bindings_.bind(commands, &constants);
    vkCmdDraw(commands, sphere_vertices, static_cast<uint32_t>(count), 0, 0);
}

}  // namespace dimmer::sample
