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
    // With light at the place: at the texel itself (without one, all light is a neighbour's, by filtering, or none), or
    // at the probes around.
    uint32_t records = 0;
};

// Where records of a receiver are; none where no contribution is stored.
struct ReceiverPlace {
    std::optional<uint32_t> cluster, batch;
};

struct ExplainedSurface {
    SurfacePlace place;
    std::array<uint32_t, 2> texel{};  // x, y on the mesh's page
    ReceiverPlace receiver;
};

struct ExplainedProbe {
    uint32_t number = 0;
    float share = 0;  // of it in the light at the place
    ReceiverPlace receiver;
};

struct Explanation {
    std::optional<ExplainedSurface> surface;
    std::vector<ExplainedProbe> probes;  // in the air: those around that count there, of the global grid
    std::array<float, 3> lux{};          // as the runtime's pages or probes have it
    std::array<float, 3> base_lux{};     // always-on light over paths without doors
    double base_share = 0;
    std::vector<ExplainedContribution> contributions;  // all of the pack's, in its order
};

enum class ExplainFrom { Nearest, Surface, Grid };

// Surface: irradiance on `normal`, or, without one, on the nearest surface's own; bilinear over texels as shaders see
// it. NotFound where no lightmapped surface is within surface_reach_m of the point. Grid: as things that move get it,
// from the global grid; without a normal the mean over all. NotFound where the pack has none. Nearest: from a surface
// that is near enough, otherwise from the grid.
Expected<Explanation> explain(const Pack& pack, glm::vec3 point_m, std::optional<glm::vec3> normal,
                              std::string_view state, ExplainFrom from = ExplainFrom::Nearest);

}  // namespace dimmer::cook
