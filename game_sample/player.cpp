#include "player.h"

#include "balls.h"
#include "exposure.h"
#include "image_file.h"
#include "level_renderer.h"
#include "model_renderer.h"
#include "progress.h"
#include "timeline.h"

#include <fmt/format.h>
#include <gpu/vk_result.h>
#include <gpu/vk_struct.h>
#include <pack/pack_data.h>
#include <tools/headless_device.h>

#include <optional>

namespace dimmer::sample {
namespace {

// One command buffer, recorded anew for each frame, waited for before the next: pictures, not frame rate.
class FrameCommands {
   public:
    static Expected<FrameCommands> create(const VulkanContext& vulkan) {
        FrameCommands frame;
        frame.vulkan_ = vulkan;
        auto pool_info = vkStruct<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
        pool_info.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
        pool_info.queueFamilyIndex = vulkan.queue_family;
        VkCommandPool pool = VK_NULL_HANDLE;
        DIMMER_VK(vkCreateCommandPool, vulkan.device, &pool_info, nullptr, &pool);
        frame.pool_ = {vulkan.device, pool};

        auto allocate = vkStruct<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
        allocate.commandPool = pool;
        allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
        allocate.commandBufferCount = 1;
        DIMMER_VK(vkAllocateCommandBuffers, vulkan.device, &allocate, &frame.commands_);

        const auto fence_info = vkStruct<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
        VkFence fence = VK_NULL_HANDLE;
        DIMMER_VK(vkCreateFence, vulkan.device, &fence_info, nullptr, &fence);
        frame.fence_ = {vulkan.device, fence};
        return frame;
    }

    Expected<VkCommandBuffer> begin() {
        auto info = vkStruct<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
        info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
        DIMMER_VK(vkBeginCommandBuffer, commands_, &info);
        return commands_;
    }

    Expected<void> submitAndWait() {
        DIMMER_VK(vkEndCommandBuffer, commands_);
        const VkFence fence = fence_.get();
        auto info = vkStruct<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
        info.commandBufferCount = 1;
        info.pCommandBuffers = &commands_;
        DIMMER_VK(vkQueueSubmit, vulkan_.queue, 1, &info, fence);
        DIMMER_VK(vkWaitForFences, vulkan_.device, 1, &fence, VK_TRUE, UINT64_MAX);
        DIMMER_VK(vkResetFences, vulkan_.device, 1, &fence);
        return {};
    }

   private:
    VulkanContext vulkan_;
    CommandPoolHandle pool_;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
    FenceHandle fence_;
};

class Player {
   public:
    // `spheres` may be null where there are none to draw.
    Player(const Script& script, Runtime& lights, LevelRenderer& renderer, FrameCommands& commands, Balls& balls,
           ModelRenderer& models, const SphereRenderer* spheres)
        : script_(script),
          lights_(lights),
          renderer_(renderer),
          commands_(commands),
          balls_(balls),
          models_(models),
          sphere_renderer_(spheres),
          timeline_(script) {
        if (script.probe_radius_m > 0) probe_spheres_ = probeSpheres(lights.pack(), script.probe_radius_m);
    }

    // Plays the script's next frame.
    Expected<FrameCost> play(uint32_t frame) {
        FrameCost cost{frame, {}, {}};
        auto changes = timeline_.advance(frame, lights_);
        if (!changes) return std::unexpected(changes.error());
        cost.changes = std::move(*changes);
        DIMMER_TRY(balls_.move(frame, lights_));
        DIMMER_TRY(models_.move(frame / static_cast<double>(script_.fps), lights_));

        const auto commands = commands_.begin();
        if (!commands) return std::unexpected(commands.error());
        const auto recorded = lights_.record(*commands);
        if (!recorded) return std::unexpected(recorded.error());
        auto spheres = balls_.spheres(lights_);
        if (!spheres) return std::unexpected(spheres.error());
        spheres->insert(spheres->end(), probe_spheres_.begin(), probe_spheres_.end());
        Expected<void> drawn{};
        renderer_.record(*commands, timeline_.camera(), script_.sky_cd_m2, lights_,
                         [&](VkCommandBuffer pass, const glm::mat4& clip_from_world) {
                             drawn = models_.draw(pass, clip_from_world, lights_);
                             if (sphere_renderer_) sphere_renderer_->draw(pass, clip_from_world, *spheres);
                         });
        DIMMER_TRY(drawn);
        DIMMER_TRY(commands_.submitAndWait());

        cost.stats = *recorded;
        if (recorded->dispatches == 0) return cost;
        const auto stats = lights_.wait();  // the same update, now with its time on the GPU
        if (!stats) return std::unexpected(stats.error());
        cost.stats = *stats;
        return cost;
    }

    bool cut() const { return timeline_.cut(); }

   private:
    const Script& script_;
    Runtime& lights_;
    LevelRenderer& renderer_;
    FrameCommands& commands_;
    Balls& balls_;
    ModelRenderer& models_;
    const SphereRenderer* sphere_renderer_;
    std::vector<Sphere> probe_spheres_;
    Timeline timeline_;
};

// Every weight as it was at the beginning: sets at 1 or their maximum, doors closed.
Expected<void> resetWeights(Runtime& lights) {
    const auto elements = lights.pack().elements();
    for (uint32_t i = 0; i < elements.size(); ++i) {
        const bool is_door = elements[i].kind == ElementKind::Door;
        const float shining = std::min(1.0f, elements[i].max_weight);
        DIMMER_TRY(is_door ? lights.setDoor(Door{i}, 0) : lights.setWeight(LightSet{i}, shining));
    }
    return {};
}

// The script's light without a picture, and back to the beginning. Drivers compile a kernel when it first runs; so they
// have done it before anything is measured.
Expected<void> rehearse(const Script& script, Runtime& lights, Balls& balls) {
    Timeline timeline(script);
    for (uint32_t frame = 0; frame < script.frames; ++frame) {
        const auto changes = timeline.advance(frame, lights);
        if (!changes) return std::unexpected(changes.error());
        DIMMER_TRY(balls.move(frame, lights));
        if (const auto sent = lights.submit(); !sent) return std::unexpected(sent.error());
    }
    DIMMER_TRY(resetWeights(lights));
    if (const auto sent = lights.submit(); !sent) return std::unexpected(sent.error());
    if (const auto done = lights.wait(); !done) return std::unexpected(done.error());
    return {};
}

// None where the script has nothing to draw with it.
Expected<std::optional<SphereRenderer>> createSphereRenderer(const VulkanContext& vulkan, const Script& script,
                                                             const Runtime& lights, const LevelRenderer& renderer) {
    size_t count = script.balls.size();
    if (script.probe_radius_m > 0) count += lights.pack().data().probes.global.positions.size();
    if (count == 0) return std::nullopt;
    auto made = SphereRenderer::create(vulkan, lights, renderer.renderPass(), {script.width, script.height},
                                       static_cast<uint32_t>(count));
    if (!made) return std::unexpected(made.error());
    return std::move(*made);
}

}  // namespace

Expected<PlayResult> playHeadless(const Pack& pack, const Script& script, const PlayOptions& options) {
    std::error_code failed;
    std::filesystem::create_directories(options.out, failed);
    if (failed) return fail(ErrorCode::Io, fmt::format("{}: {}.", options.out.string(), failed.message()));

    const auto device = HeadlessDevice::create({.validation = options.validate, .graphics = true});
    if (!device) return std::unexpected(device.error());
    PlayResult result{{}, device->name(), device->driver(), {}};
    {
        auto lights =
            Runtime::create(device->context(), pack, {.moving_probes_max = movingProbes(script) + movingProbes(pack)});
        if (!lights) return std::unexpected(lights.error());
        auto renderer = LevelRenderer::create(device->context(), pack, lights->images(), {script.width, script.height});
        if (!renderer) return std::unexpected(renderer.error());
        auto commands = FrameCommands::create(device->context());
        if (!commands) return std::unexpected(commands.error());

        auto balls = Balls::create(script, *lights);
        if (!balls) return std::unexpected(balls.error());
        auto spheres = createSphereRenderer(device->context(), script, *lights, *renderer);
        if (!spheres) return std::unexpected(spheres.error());

        auto models = ModelRenderer::create(device->context(), *lights, renderer->renderPass(),
                                            {script.width, script.height}, options.self_visibility);
        if (!models) return std::unexpected(models.error());

        DIMMER_TRY(rehearse(script, *lights, *balls));
        Player player(script, *lights, *renderer, *commands, *balls, *models, *spheres ? &**spheres : nullptr);
        AutoExposure eye(script.adaptation_s, script.fps);
        Progress progress("frames", script.frames);
        for (uint32_t frame = 0; frame < script.frames; ++frame) {
            auto cost = player.play(frame);
            if (!cost) return std::unexpected(cost.error());
            result.cost.add(std::move(*cost));
            const RadianceFrame radiance = renderer->read();
            const float exposure = eye.update(medianLuminance(radiance), frame == 0 || player.cut());
            DIMMER_TRY(writePng(options.out / fmt::format("frame_{:04}.png", frame), radiance.width, radiance.height,
                                developPicture(radiance, exposure)));
            progress.update(frame + 1);
        }
        DIMMER_TRY(result.cost.writeJson(options.out / "cost.json", options.pack.filename().string(), result.device,
                                         result.driver));
    }
    result.validation_messages = device->validationMessages();  // destruction was watched too
    return result;
}

}  // namespace dimmer::sample
