// Draws spheres that light probes light: moving balls, and the probes themselves.
#pragma once

#include "storage_bindings.h"

#include <dimmer/runtime.h>
#include <gpu/memory.h>

#include <glm/glm.hpp>
#include <span>

namespace dimmer::sample {

struct Sphere {
    glm::vec3 centre_m{};
    float radius_m = 0;
    glm::vec4 reflectance{};
    ModelSlot light;
};
static_assert(sizeof(Sphere) == 96);

// The global grid's probes as spheres, each lit by itself alone.
std::vector<Sphere> probeSpheres(const Pack& pack, float radius_m);

class SphereRenderer {
   public:
    // For up to `spheres_max`, at least 1, within `render_pass` (its one subpass). `lights` has probes and stays.
    static Expected<SphereRenderer> create(const VulkanContext& vulkan, const Runtime& lights, VkRenderPass render_pass,
                                           VkExtent2D extent, uint32_t spheres_max);

    // One draw. Written to memory that the GPU reads: the last frame's commands must have completed.
    void draw(VkCommandBuffer commands, const glm::mat4& clip_from_world, std::span<const Sphere> spheres) const;

   private:
    GpuBuffer spheres_;
    StorageBindings bindings_;
    PipelineHandle pipeline_;
    float exposure_ = 1;
    uint32_t color_format_ = 0;
};

}  // namespace dimmer::sample
