// Packs without a level: receivers, light sets and doors in the numbers of a production level, with random records.
#pragma once

#include <pack/pack_data.h>

#include <optional>
#include <span>
#include <string_view>

namespace dimmer::cook {

// A row of Table 1 of UBERBAKE (Seyb et al. 2020, "The design and evolution of the UberBake light baking system").
struct LevelStatistics {
    std::string_view name;
    uint32_t texels, local_probes, global_probes;
    uint32_t light_sets, doors;
    uint32_t memory_mib, memory_with_sets_mib;

    // Mean number of contributions per receiver: the bytes that sets and doors add over the bytes of one record (8 for
    // a texel, 28 for a probe) per receiver.
    double meanOverlap() const;
};

std::span<const LevelStatistics> productionLevels();
std::optional<LevelStatistics> productionLevel(std::string_view name);

struct SynthOptions {
    LevelStatistics level;
    double scale = 1;          // times the receivers, 1/64 or more
    uint32_t clusters = 1000;  // 1..100000; clusters without any contribution come on top
    uint32_t light_sets = 0;   // instead of the level's; 0: the level's
    uint32_t seed = 1;
    ColorFormat color_format = ColorFormat::E5B9G9R9;
    bool probes = false;  // light probes as well, as many as the level has, in the clusters of the texels
};

// Clusters are the cells of a Voronoi diagram on the pages, of unequal sizes; each holds some of the sets
// nearest to it, so that light sets and doors are coherent regions; where clusters are few, some sets have none.
// Overlaps fall off geometrically (as in the paper's figure 5) up to 16; their mean is the level's within 0.1 %. The
// same options give the same pack.
Expected<PackData> synthesise(const SynthOptions& options);

}  // namespace dimmer::cook
