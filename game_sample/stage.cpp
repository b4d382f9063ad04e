#include "stage.h"

#include "controls.h"
#include "timeline.h"

#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>
#include <pack/pack_data.h>

namespace dimmer::sample {

Expected<Stage::Commands> Stage::createCommands(const VulkanContext& vulkan) {
    Commands commands;
    auto pool_info = vkStruct<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
    pool_info.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
    pool_info.queueFamilyIndex = vulkan.queue_family;
    VkCommandPool pool = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateCommandPool, vulkan.device, &pool_info, nullptr, &pool);
    commands.pool = {vulkan.device, pool};

    auto allocate = vkStruct<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
    allocate.commandPool = pool;
    allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    allocate.commandBufferCount = 1;
    DIMMER_VK(vkAllocateCommandBuffers, vulkan.device, &allocate, &commands.buffer);

    const auto fence_info = vkStruct<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
    VkFence fence = VK_NULL_HANDLE;
    DIMMER_VK(vkCreateFence, vulkan.device, &fence_info, nullptr, &fence);
    commands.fence = {vulkan.device, fence};
    return commands;
}

Expected<std::unique_ptr<Stage>> Stage::create(const HeadlessDevice& device, const Pack& pack, const Script& script,
                                               bool self_visibility) {
    const VulkanContext vulkan = device.context();
    const VkExtent2D extent{script.width, script.height};
    auto lights = Runtime::create(vulkan, pack, {.moving_probes_max = movingProbes(script) + movingProbes(pack)});
    if (!lights) return std::unexpected(lights.error());
    auto renderer = LevelRenderer::create(vulkan, pack, lights->images(), extent);
    if (!renderer) return std::unexpected(renderer.error());
    auto commands = createCommands(vulkan);
    if (!commands) return std::unexpected(commands.error());
    auto balls = Balls::create(script, *lights);
    if (!balls) return std::unexpected(balls.error());
    auto models = ModelRenderer::create(vulkan, *lights, renderer->renderPass(), extent, self_visibility);
    if (!models) return std::unexpected(models.error());
    std::unique_ptr<Stage> stage(new Stage(vulkan, script, std::move(*lights), std::move(*renderer),
                                           std::move(*commands), std::move(*balls), std::move(*models)));
    DIMMER_TRY(stage->createSpheres());
    return stage;
}

Expected<void> Stage::createSpheres() {
    if (script_.probe_radius_m > 0) probe_spheres_ = probeSpheres(lights_.pack(), script_.probe_radius_m);
    const size_t count = script_.balls.size() + probe_spheres_.size();
    if (count == 0) return {};
    auto made = SphereRenderer::create(vulkan_, lights_, renderer_.renderPass(), {script_.width, script_.height},
                                       static_cast<uint32_t>(count));
    if (!made) return std::unexpected(made.error());
    sphere_renderer_ = std::move(*made);
    return {};
}

Expected<UpdateStats> Stage::draw(uint32_t frame, const CameraPose& camera) {
    DIMMER_TRY(balls_.move(frame, lights_));
    DIMMER_TRY(models_.move(frame / static_cast<double>(script_.fps), lights_));

    auto begin = vkStruct<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    DIMMER_VK(vkBeginCommandBuffer, commands_.buffer, &begin);
    const auto recorded = lights_.record(commands_.buffer);
    if (!recorded) return std::unexpected(recorded.error());
    auto spheres = balls_.spheres(lights_);
    if (!spheres) return std::unexpected(spheres.error());
    spheres->insert(spheres->end(), probe_spheres_.begin(), probe_spheres_.end());
    Expected<void> drawn{};
    renderer_.record(commands_.buffer, camera, script_.sky_cd_m2, lights_,
                     [&](VkCommandBuffer pass, const glm::mat4& clip_from_world) {
                         drawn = models_.draw(pass, clip_from_world, lights_);
                         if (sphere_renderer_) sphere_renderer_->draw(pass, clip_from_world, *spheres);
                     });
    DIMMER_TRY(drawn);
    DIMMER_TRY(submitAndWait());
    return recorded->dispatches == 0 ? recorded : lights_.wait();  // the same update, now with its time on the GPU
}

Expected<void> Stage::submitAndWait() {
    DIMMER_VK(vkEndCommandBuffer, commands_.buffer);
    const VkFence fence = commands_.fence.get();
    auto info = vkStruct<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
    info.commandBufferCount = 1;
    info.pCommandBuffers = &commands_.buffer;
    DIMMER_VK(vkQueueSubmit, vulkan_.queue, 1, &info, fence);
    DIMMER_VK(vkWaitForFences, vulkan_.device, 1, &fence, VK_TRUE, UINT64_MAX);
    DIMMER_VK(vkResetFences, vulkan_.device, 1, &fence);
    return {};
}

Expected<void> Stage::rehearse(uint32_t frames) {
    Timeline timeline(script_);
    for (uint32_t frame = 0; frame < frames; ++frame) {
        const auto changes = timeline.advance(frame, lights_);
        if (!changes) return std::unexpected(changes.error());
        DIMMER_TRY(balls_.move(frame, lights_));
        if (const auto sent = lights_.submit(); !sent) return std::unexpected(sent.error());
    }
    DIMMER_TRY(resetWeights(lights_));
    if (const auto sent = lights_.submit(); !sent) return std::unexpected(sent.error());
    if (const auto done = lights_.wait(); !done) return std::unexpected(done.error());
    return {};
}

}  // namespace dimmer::sample
