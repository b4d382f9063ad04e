// What raising activity thresholds would save and lose, counted on a bake's own light.
#pragma once

#include <bake/bake.h>
#include <charts/texels.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace dimmer::cook {

inline constexpr float threshold_max = 1;  // what settings take at most
// Thresholds that are tried, as multiples of the present ones.
inline constexpr std::array<float, 13> threshold_rungs = {1, 1.5f, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64};

// A rung per light group.
using Rungs = std::vector<uint8_t>;

struct Loss {
    uint64_t bytes = 0;  // of records; not the bases of receivers that keep none
    double error = 0;    // mean over receivers of the light that is lost over the light there, in luminance
    double energy = 0;   // share of the groups' stored light
};

// What a profile's density changes: the sizes of charts, but of those whose meshes state a density of their own.
struct ChartSizes {
    uint32_t page_size = 0;
    std::vector<glm::uvec2> charts;  // texels, padding included
    std::vector<bool> fixed;
};
ChartSizes chartSizes(const RayScene& rays, const Unwrap& unwrap, uint32_t page_size);

// Records of a bake by the rung at which they go. A receiver counts once for every texel that shows it. Errors are
// those of all sets at weight 1, the mean of all doors open and all closed; below 1 % of the mean light, shares of that
// 1 %.
class LossTable {
   public:
    LossTable() = default;
    // `thresholds`: per light group, those of the bake.
    LossTable(const Baked& baked, const Texels& texels, std::span<const float> thresholds, ChartSizes sizes);

    // From the present thresholds to `rungs`.
    Loss loss(const Rungs& rungs) const;
    Loss step(uint32_t group, uint8_t from, uint8_t to) const;
    // Bytes of the step that terms about the door hold.
    uint64_t doorBytes(uint32_t group, uint8_t from, uint8_t to, uint32_t door) const;
    // All that costs PackCost::dynamic, bases included. Exact.
    uint64_t dynamicBytes(const Rungs& rungs) const;
    // Mean relative error of texels `factor` times as long, against those there are: of second differences of the light
    // along the pages, an eighth of which a box of a texel and bilinear filtering lose where light is smooth.
    double densityError(double factor) const { return (1 - fixed_texels_) * (factor * factor - 1) * curvature_ / 4; }
    // Of texels `factor` times as long, the share that is left of how many charts have, and of the pages, which charts
    // do not fill. Without charts, as area goes. Cost: packs the charts anew.
    struct TexelsLeft {
        double charts = 1, pages = 1;
    };
    TexelsLeft texelsLeft(double factor) const;

    uint32_t groupCount() const { return static_cast<uint32_t>(steps_.size()); }

   private:
    struct Record {
        uint32_t receiver;
        uint16_t group;
        uint8_t lost_at;  // the first rung at which it goes; threshold_rungs.size(): never
    };
    struct Step {
        Loss loss;
        std::vector<uint64_t> door_bytes;
    };
    void measureCurvature(const Texels& texels, const std::vector<float>& lux, float floor_lux);

    std::vector<Record> records_;                                  // by receiver
    std::vector<uint32_t> copies_;                                 // texels that show a receiver
    std::vector<std::array<Step, threshold_rungs.size()>> steps_;  // per group: what goes at each rung
    double curvature_ = 0;
    ChartSizes sizes_;
    double fixed_texels_ = 0;  // share of charts' texels
};

}  // namespace dimmer::cook
