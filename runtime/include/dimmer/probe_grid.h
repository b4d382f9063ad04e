// Light at points of the open air, from the light probes of the global grid: for game logic ("does the player stand in
// the light?"), and for servers without a GPU.
#pragma once

#include <dimmer/model_mesh.h>
#include <dimmer/pack.h>

#include <array>
#include <cstdint>
#include <span>

namespace dimmer {

// Radiance over all directions in real spherical harmonics, bands 0..2: coefficients of Y_00, Y_1-1, Y_10, Y_11, Y_2-2,
// Y_2-1, Y_20, Y_21, Y_22 (orthonormal; Y_1m of y, z, x), cd/m2, linear Rec.709. World axes.
struct Radiance {
    std::array<std::array<float, 3>, 9> coefficients = {};
};

// Irradiance in lux on a surface with this unit normal; never negative. Of a normal that is not finite it is not
// either.
std::array<float, 3> irradiance(const Radiance& radiance, std::array<float, 3> normal);

// The same on a surface that knows what of its surroundings it sees.
std::array<float, 3> transferredIrradiance(const Radiance& radiance, const LightTransfer& transfer);

// Where the last query ended; pass it to the next one nearby and it finds its place in a step or two. One per thread.
struct GridHint {
    uint32_t tetrahedron = UINT32_MAX;
};

// Reads `probes`, the blended probes of a runtime (CpuRuntime::probes(), Runtime::Pages::probes), which must outlive
// it. Thread-safe as long as nobody updates them. Costs some hundred nanoseconds a query. A point outside the level
// gets the light of the grid's nearest point; with no global grid all is black, and so is what reads probes that are
// not among `probes`, as with those of another pack.
class GridSampler {
   public:
    GridSampler(const Pack& pack, std::span<const uint32_t> probes) : pack_(pack), probes_(probes) {}

    bool empty() const;
    // What arrives at a point from all sides, for fog, particles and volumes.
    Radiance radiance(std::array<float, 3> point_m, GridHint* hint = nullptr) const;
    // Irradiance in lux on a surface at the point, with this unit normal.
    std::array<float, 3> sample(std::array<float, 3> point_m, std::array<float, 3> normal,
                                GridHint* hint = nullptr) const;

    // The same at a place of a model, from the model's own probes, linear between them. Of models that move and
    // of those that stand (Pack::localGridSlot). The CPU twin of dimmer_model_irradiance in grid.glsl.
    Radiance radiance(const ModelSlot& slot, std::array<float, 3> point_m) const;
    std::array<float, 3> sample(const ModelSlot& slot, std::array<float, 3> point_m, std::array<float, 3> normal) const;
    // With the model's shadow on itself: modelTransfer() of a vertex, or the mean of several.
    std::array<float, 3> sampleTransfer(const ModelSlot& slot, std::array<float, 3> point_m,
                                        const LightTransfer& transfer) const;

   private:
    Pack pack_;
    std::span<const uint32_t> probes_;
};

}  // namespace dimmer
