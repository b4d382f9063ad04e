// What raising activity thresholds would save and lose, counted on a bake's own light.
#pragma once

#include <bake/bake.h>
#include <charts/texels.h>
#include <cluster/texel_groups.h>
#include <pipeline/coarser_texels.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace dimmer::cook {

inline constexpr float threshold_max = 1;  // what settings take at most
// Thresholds that are tried, as multiples of the present ones; the last are the largest that there is, whatever those.
inline constexpr std::array<float, 18> threshold_rungs = {1,  1.5f, 2,  3,  4,   6,   8,   12,   16,
                                                          24, 32,   48, 64, 128, 256, 512, 1024, 1e30f};

// What a threshold becomes at each rung, in decimals as people write them: 1.5 times 0.03 is 0.045, not 0.044999998.
using Ladder = std::array<float, threshold_rungs.size()>;
Ladder ladderOf(float threshold);

// A rung per light group.
using Rungs = std::vector<uint8_t>;

struct Loss {
    uint64_t bytes = 0;  // of records; not the bases of receivers that keep none
    double error = 0;    // mean over surfaces of the light that is lost over the light there, in luminance
    double energy = 0;   // share of the stored light of the group that loses most
    uint32_t energy_group = 0;
};

// What records of texels take.
struct RecordBytes {
    uint64_t dynamic = 0;                     // all that costs PackCost::dynamic, bases included
    std::vector<uint64_t> by_group, by_door;  // without bases; of terms of the group, or about the door
};

// What a profile's density changes: the sizes of charts, but of those whose meshes state a density of their own.
struct ChartSizes {
    uint32_t page_size = 0;
    std::vector<glm::uvec2> charts;  // texels, padding included
    std::vector<bool> fixed;
    std::vector<uint32_t> of_face;  // the chart of each
};
ChartSizes chartSizes(const RayScene& rays, const Unwrap& unwrap, uint32_t page_size);

// Of the records that receivers hold at some rungs, those that go at each higher one; not what comes back in their
// place, which depends on all groups' rungs.
class LossSteps {
   public:
    LossSteps(uint32_t groups, uint32_t doors);
    void add(uint32_t group, uint8_t lost_at, const Loss& loss, const Term& term);
    Loss step(uint32_t group, uint8_t from, uint8_t to) const;
    // Bytes of the step that terms about the door hold.
    uint64_t doorBytes(uint32_t group, uint8_t from, uint8_t to, uint32_t door) const;

   private:
    struct Step {
        Loss loss;
        std::vector<uint64_t> door_bytes;
    };
    std::vector<std::array<Step, threshold_rungs.size()>> steps_;
};

// Records of a bake by the rung at which they go. Of those that are left, a receiver keeps as many as it may hold, the
// brightest: where one goes, another may come back. A receiver's bytes count once for every texel that shows it. Errors
// are those of all sets at weight 1, the mean of all doors open and all closed; below 1 % of the mean light, shares of
// that 1 %.
class LossTable {
   public:
    LossTable() = default;
    // `baked`: before limitOverlap(), which then has `overlap_max`. `thresholds`: per light group, those of the bake.
    LossTable(const Baked& baked, const Texels& texels, std::span<const float> thresholds, uint32_t overlap_max,
              ChartSizes sizes);

    // From the present thresholds to `rungs`.
    Loss loss(const Rungs& rungs) const;
    // At `rungs`, of records that have light. Exact.
    RecordBytes bytes(const Rungs& rungs) const;
    // Of all, with those without light of clusters that join others. Exact, but for values that rounding puts on the
    // threshold itself. Cost: clusters all texels.
    uint64_t storedBytes(const Rungs& rungs) const;
    // To choose by at `rungs`.
    LossSteps steps(const Rungs& rungs) const;
    // Whether receivers hold only so many records: then steps() at other rungs are others.
    bool isLimited() const { return overlap_max_ != UINT32_MAX; }
    // Mean relative error of texels `factor` times as long, against those there are, all doors closed.
    double densityError(double factor) const { return coarser_.error(factor); }
    // Of texels `factor` times as long, the share that is left of how many charts have, and of the pages, which charts
    // do not fill. Without charts, as area goes. Cost: packs the charts anew.
    struct TexelsLeft {
        double charts = 1, pages = 1;
    };
    TexelsLeft texelsLeft(double factor) const;

    // By how much the light in the open would be further off, in the mean, with this share of the global grid's probes;
    // none where that is not known. See ProbesError.
    std::optional<double> probesError(double left) const;

    uint32_t groupCount() const { return group_count_; }

   private:
    struct Record {
        uint32_t receiver, term;
        std::array<float, 2> error;  // what goes with it, see Loss; with doors closed, and open
        float energy;
        uint8_t lost_at;  // the first rung at which it goes; threshold_rungs.size(): never
    };
    struct StateLight;
    // Calls each(record, its number) for what receivers hold at `rungs`.
    void forKept(const Rungs& rungs, auto&& each) const;
    double errorOf(const Rungs& rungs) const;
    uint32_t groupOf(const Record& record) const { return terms_[record.term].group; }
    // Returns the records' light.
    std::vector<float> listRecords(const Baked& baked, std::span<const float> thresholds);
    void weigh(const Texels& texels, std::span<const float> lux, std::span<const StateLight> states);

    std::vector<Term> terms_;
    uint32_t group_count_ = 0, door_count_ = 0;
    uint32_t overlap_max_ = UINT32_MAX;
    std::vector<Record> records_;   // by receiver, the brightest first
    std::vector<uint32_t> copies_;  // texels that show a receiver
    std::vector<ShownTexel> shown_;
    ChartSizes sizes_;
    CoarserTexels coarser_;
    std::vector<ProbesError> probes_errors_;
};

}  // namespace dimmer::cook
