// What lights a place, and what that costs.
#pragma once

#include <dimmer/light_state.h>
#include <trace/nearest_surface.h>

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string_view>
#include <vector>

namespace dimmer::cook {

// One contribution's part of the light at a place.
struct ExplainedContribution {
    uint32_t contribution = 0;        // into Pack::contributions()
    Weight weight;                    // in the state asked for
    std::array<float, 3> full_lux{};  // at weight 1
    std::array<float, 3> lux{};       // at its weight
    double share = 0;                 // of the sum of all luminances, 0..1
    bool stored = false;              // at the texel itself; else all light is a neighbour's, by filtering, or none
};

struct Explanation {
    SurfacePlace surface;
    std::array<uint32_t, 2> texel{};         // x, y on the mesh's page
    std::optional<uint32_t> cluster, batch;  // of the texel; none where no contribution is stored
    std::array<float, 3> lux{};              // as the runtime's pages have it
    std::array<float, 3> base_lux{};         // always-on light over paths without doors
    double base_share = 0;
    std::vector<ExplainedContribution> contributions;  // all of the pack's, in its order
};

// Irradiance on `normal`, or, without one, on the nearest surface's own; bilinear over texels as shaders see it.
// NotFound where no lightmapped surface is within surface_reach_m of the point.
Expected<Explanation> explain(const Pack& pack, glm::vec3 point_m, std::optional<glm::vec3> normal,
                              std::string_view state);

}  // namespace dimmer::cook
