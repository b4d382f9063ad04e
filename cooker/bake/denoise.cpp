#include <bake/denoise.h>

#include <bake/sampling.h>
#include <pack/pack_data.h>

#include <array>
#include <cmath>

namespace dimmer::cook {
namespace {

constexpr int passes = 3;             // steps of 1, 2, 4 texels
constexpr float edge_deviations = 3;  // differences up to this many standard deviations count as noise
constexpr std::array<float, 3> kernel = {3.0f / 8, 1.0f / 4, 1.0f / 16};  // B3 spline, by distance

// The smoothing of a variance: a texel's own estimate comes from a handful of rounds and says little alone.
constexpr int variance_reach = 1;

class LightmapFilter {
   public:
    LightmapFilter(const Unwrap& unwrap, const Texels& texels, const Sparse<ReceiverLight>& light, int step)
        : unwrap_(unwrap), texels_(texels), light_(light), step_(step) {}

    void filter(size_t receiver, std::vector<ReceiverLight>& row) const {
        const auto here = light_.row(receiver);
        row.assign(here.begin(), here.end());
        std::vector<Sum> sums(here.size());
        for (int dy = -2; dy <= 2; ++dy)
            for (int dx = -2; dx <= 2; ++dx) {
                const uint32_t other = neighbourInChart(unwrap_, texels_, receiver, dx * step_, dy * step_);
                if (other == no_index) continue;
                const float spatial =
                    kernel[static_cast<size_t>(std::abs(dx))] * kernel[static_cast<size_t>(std::abs(dy))];
                addRow(here, light_.row(other), spatial, sums);
            }
        for (size_t i = 0; i < row.size(); ++i) {
            if (!(sums[i].weight > 0)) continue;
            row[i].light = sums[i].light * (1 / sums[i].weight);
            row[i].variance = sums[i].variance / (sums[i].weight * sums[i].weight);
        }
    }

    // Replaces each variance by the mean over the neighbours of the same term.
    void smoothVariance(size_t receiver, std::vector<ReceiverLight>& row) const {
        const auto here = light_.row(receiver);
        row.assign(here.begin(), here.end());
        std::vector<float> counts(here.size(), 1);
        for (int dy = -variance_reach; dy <= variance_reach; ++dy)
            for (int dx = -variance_reach; dx <= variance_reach; ++dx) {
                const uint32_t other = neighbourInChart(unwrap_, texels_, receiver, dx, dy);
                if (other == no_index || other == receiver) continue;
                forEachCommon(here, light_.row(other), [&](size_t i, const ReceiverLight& o) {
                    row[i].variance += o.variance;
                    counts[i] += 1;
                });
            }
        for (size_t i = 0; i < row.size(); ++i) row[i].variance /= counts[i];
    }

   private:
    struct Sum {
        Gathered light;
        float weight = 0, variance = 0;
    };

    // visit(index in `here`, entry of `other`) for the terms that both hold; both ascend by term.
    static void forEachCommon(std::span<const ReceiverLight> here, std::span<const ReceiverLight> other, auto&& visit) {
        size_t j = 0;
        for (size_t i = 0; i < here.size(); ++i) {
            while (j < other.size() && other[j].term < here[i].term) ++j;
            if (j == other.size()) return;
            if (other[j].term == here[i].term) visit(i, other[j]);
        }
    }

    static void addRow(std::span<const ReceiverLight> here, std::span<const ReceiverLight> other, float spatial,
                       std::vector<Sum>& sums) {
        forEachCommon(here, other, [&](size_t i, const ReceiverLight& o) {
            const float difference = luminance(here[i].light.irradiance_lux) - luminance(o.light.irradiance_lux);
            const float noise2 = here[i].variance + o.variance;
            if (difference * difference > edge_deviations * edge_deviations * noise2 && &here[i] != &o) return;
            sums[i].light += o.light * spatial;
            sums[i].weight += spatial;
            sums[i].variance += spatial * spatial * o.variance;
        });
    }

    const Unwrap& unwrap_;
    const Texels& texels_;
    const Sparse<ReceiverLight>& light_;
    int step_;
};

}  // namespace

Sparse<ReceiverLight> denoise(const Unwrap& unwrap, const Texels& texels, Sparse<ReceiverLight> light,
                              Progress& progress) {
    progress.stage("denoise", texels.size() * (passes + 1));
    auto run = [&](auto&& filter_row) {
        light = Sparse<ReceiverLight>::build(texels.size(), [&](size_t begin, size_t end, auto emit) {
            std::vector<ReceiverLight> row;
            for (size_t i = begin; i < end; ++i) {
                filter_row(i, row);
                emit(std::span<const ReceiverLight>(row));
            }
            progress.advance(end - begin);
        });
    };
    run([filter = LightmapFilter(unwrap, texels, light, 1)](size_t i, auto& row) { filter.smoothVariance(i, row); });
    for (int pass = 0; pass < passes; ++pass)
        run([filter = LightmapFilter(unwrap, texels, light, 1 << pass)](size_t i, auto& row) {
            filter.filter(i, row);
        });
    return light;
}

}  // namespace dimmer::cook
