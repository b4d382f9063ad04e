// What a frame of the sample is made of: the runtime, everything that is drawn, and the commands for one frame.
#pragma once

#include "balls.h"
#include "level_renderer.h"
#include "model_renderer.h"
#include "script.h"
#include "sphere_renderer.h"

#include <tools/headless_device.h>

#include <memory>
#include <optional>

namespace dimmer::sample {

class Stage {
   public:
    // `device` and `script` outlive the stage. `self_visibility`: models' shadows on themselves.
    static Expected<std::unique_ptr<Stage>> create(const HeadlessDevice& device, const Pack& pack, const Script& script,
                                                   bool self_visibility);

    Runtime& lights() { return lights_; }
    // Brings what moves to where it is in that frame (30 a second, or as the script says), the light up to date, and
    // draws; waits until all of it is done: pictures, not frame rate. Returns what the update cost.
    Expected<UpdateStats> draw(uint32_t frame, const CameraPose& camera);
    // The last one drawn.
    RadianceFrame read() const { return renderer_.read(); }
    // The light of so many of the script's frames without a picture, and back to the beginning. Drivers compile a
    // kernel when it first runs; so they have done it before anything is measured.
    Expected<void> rehearse(uint32_t frames);

   private:
    // One command buffer, recorded anew for each frame.
    struct Commands {
        CommandPoolHandle pool;
        VkCommandBuffer buffer = VK_NULL_HANDLE;
        FenceHandle fence;
    };
    static Expected<Commands> createCommands(const VulkanContext& vulkan);

    Stage(const VulkanContext& vulkan, const Script& script, Runtime lights, LevelRenderer renderer, Commands commands,
          Balls balls, ModelRenderer models)
        : vulkan_(vulkan),
          script_(script),
          lights_(std::move(lights)),
          renderer_(std::move(renderer)),
          commands_(std::move(commands)),
          balls_(std::move(balls)),
          models_(std::move(models)) {}
    Expected<void> createSpheres();
    Expected<void> submitAndWait();

    VulkanContext vulkan_;
    const Script& script_;
    Runtime lights_;
    LevelRenderer renderer_;
    Commands commands_;
    Balls balls_;
    ModelRenderer models_;
    std::optional<SphereRenderer> sphere_renderer_;  // none where the script has nothing to draw with it
    std::vector<Sphere> probe_spheres_;
};

}  // namespace dimmer::sample
