// Light for things that move: each model has a box of light probes of its own, which follow it through the level's
// global light grid. Both runtimes take them; see LightState::addModel.
#pragma once

#include <array>
#include <cstdint>

namespace dimmer {

// From a model's space to the world's, metres: rows of a 3x4 matrix, the translation last.
struct Transform {
    std::array<std::array<float, 4>, 3> rows = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
};

// Where a model's probes stand in its own space: a lattice inside of the box, 5 cm in the world off its faces (a tenth
// of its side at most), so that what stands on a floor has none in the floor's plane; a single one in the middle.
struct ModelGrid {
    std::array<float, 3> min_m = {-0.5f, -0.5f, -0.5f}, max_m = {0.5f, 0.5f, 0.5f};
    std::array<uint32_t, 3> counts = {2, 2, 2};  // 1..64 along each axis
    uint32_t probeCount() const { return counts[0] * counts[1] * counts[2]; }
};

// For a model that fills this box: at least 2 probes an axis, so that light has a gradient, and no further apart than
// `spacing_m`, unless that takes more than `probes_max`, or 64 along an axis: then the spacing grows. Source:
// section 2.4 of UBERBAKE for the spacing of 1.5 m.
ModelGrid modelGrid(std::array<float, 3> min_m, std::array<float, 3> max_m, float spacing_m = 1.5f,
                    uint32_t probes_max = 64);

// More than this no runtime has room for: half a gigabyte of probes.
inline constexpr uint32_t moving_probes_limit = 1 << 24;

// A model that was added to a runtime. Handles of models that this one removed are refused, not mistaken for later
// ones; another runtime, or one made anew after DeviceLost, takes a handle for what it numbered so itself.
struct Model {
    uint32_t index = 0, generation = 0;  // generations begin at 1: what was never added is no model
};

// What a shader needs to light a model: dimmer_model_irradiance in grid.glsl, GridSampler on the CPU. Its probes
// follow one another, x fastest, then y.
struct ModelSlot {
    uint32_t first_probe = 0;
    std::array<uint32_t, 3> counts = {};
    std::array<std::array<float, 4>, 3> grid_from_world = {};  // to 0..counts-1 along each axis
};

}  // namespace dimmer
