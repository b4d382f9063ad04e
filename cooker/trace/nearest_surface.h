// Finds the lightmapped surface at a point: for tools that ask a pack for light at places in the world.
#pragma once

#include <charts/unwrap.h>
#include <dimmer/pack.h>

#include <array>
#include <memory>
#include <optional>
#include <span>

namespace dimmer::cook {

struct SurfacePlace {
    uint32_t mesh = 0;
    float distance_m = 0;
    std::array<float, 2> uv{};  // 0..1 over the mesh's page
    TangentFrame frame;
};

// Over the meshes of a pack, which must outlive it. Queries are thread-safe.
class NearestSurface {
   public:
    explicit NearestSurface(std::span<const Mesh> meshes, uint32_t page_width, uint32_t page_height);
    ~NearestSurface();

    // The nearest point within `radius_m` on a surface that faces as `normal` does (within 90 degrees); of equally near
    // ones that which faces it best, and of those that is no door's leaf: it may be open.
    std::optional<SurfacePlace> find(glm::vec3 point, glm::vec3 normal, float radius_m) const;

   private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace dimmer::cook
