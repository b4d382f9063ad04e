// Draws what light grids light: models that stand and models that move, through one path.
#pragma once

#include "storage_bindings.h"

#include <dimmer/runtime.h>
#include <gpu/memory.h>

#include <glm/glm.hpp>
#include <vector>

namespace dimmer::sample {

// Room that the runtime needs for the pack's models that move.
uint32_t movingProbes(const Pack& pack);

class ModelRenderer {
   public:
    // Adds the pack's moving models to `lights`, where the level has them. `lights` stays, and has room for
    // movingProbes().
    static Expected<ModelRenderer> create(const VulkanContext& vulkan, Runtime& lights, VkRenderPass render_pass,
                                          VkExtent2D extent, bool self_visibility);

    // Models that move turn about their upright axis, once in ten seconds. Before the frame's update.
    Expected<void> move(double seconds, LightState& lights);
    // Within the render pass. Written to memory that the GPU reads: the last frame's commands must have completed.
    Expected<void> draw(VkCommandBuffer commands, const glm::mat4& clip_from_world, const LightState& lights) const;

   private:
    struct Draw {
        uint32_t model = 0, mesh = 0;  // of the pack
        uint32_t first_index = 0, index_count = 0;
        int32_t vertex_offset = 0;
    };
    struct Mover {
        uint32_t model = 0;  // of the pack
        Model handle;
        Transform transform;
    };
    Expected<void> addMovers(LightState& lights);
    Expected<void> createGeometry(const VulkanContext& vulkan);

    explicit ModelRenderer(const Pack& pack) : pack_(pack) {}
    Pack pack_;
    bool self_visibility_ = true;
    std::vector<Draw> draws_;
    std::vector<Mover> movers_;
    GpuBuffer vertices_, indices_, draw_data_;
    StorageBindings bindings_;
    PipelineHandle pipeline_;
};

}  // namespace dimmer::sample
