#include <bake/denoise.h>

#include <bake/sampling.h>
#include <pack/pack_data.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace dimmer::cook {
namespace {

constexpr int passes = 3;  // steps of 1, 2, 4 texels
constexpr int kernel_reach = 2;
constexpr std::array<float, kernel_reach + 1> kernel = {3.0f / 8, 1.0f / 4, 1.0f / 16};  // B3 spline, by distance

// A texel counts by exp(-(d^2 / k^2) / 2) of its difference d, in standard deviations of the noise of both: of the two
// texels, and of the means around them, whose noise is a third of that and tells gradients from noise. Where light
// changes slowly both are small; a difference that noise does not explain is an edge, or a gradient that averaging
// would flatten.
constexpr float texel_deviations = 1.4f, mean_deviations = 0.5f;

// Means around a texel, of its light and of its variance: its own estimate comes from a handful of rounds and says
// little alone.
constexpr int mean_reach = 1;

// An unwrap of the level's own may stretch texels: longer than a square one of their area by so much.
constexpr float stretch_max = 1.5f;
// Off the plane, of the way to a neighbour: above what frames that agree curve, below a step of stairs.
constexpr float off_plane_share = 0.25f;

// Which texels lie beside each other on one surface, and what they hold in common.
class Surface {
   public:
    Surface(const RayScene& rays, const Unwrap& unwrap, const Texels& texels)
        : rays_(rays), unwrap_(unwrap), texels_(texels) {}

    // The receiver so many texels away on the same surface; no_index where there is none.
    uint32_t neighbour(size_t receiver, int dx, int dy) const {
        const uint32_t other = neighbourInChart(unwrap_, texels_, receiver, dx, dy);
        if (other == no_index || other == receiver) return other;
        const uint32_t a = texels_.face(receiver), b = texels_.face(other);
        if (a == b || !unwrap_.charts[unwrap_.face_chart[a]].curved) return other;
        if (!sameFrame(unwrap_.frames[a], unwrap_.frames[b])) return no_index;
        return nearInSpace(firstPoint(receiver), firstPoint(other), dx, dy) ? other : no_index;
    }

    // visit(index in the receiver's row, entry) for the same terms of the texels around it. `counts`: how many each
    // term then is of, its own among them.
    void addAround(const Sparse<ReceiverLight>& light, size_t receiver, std::vector<float>& counts,
                   auto&& visit) const {
        const auto here = light.row(receiver);
        counts.assign(here.size(), 1);
        for (int dy = -mean_reach; dy <= mean_reach; ++dy)
            for (int dx = -mean_reach; dx <= mean_reach; ++dx) {
                const uint32_t other = neighbour(receiver, dx, dy);
                if (other == no_index || other == receiver) continue;
                forEachCommonTerm(here, light.row(other), [&](size_t i, const ReceiverLight& o) {
                    visit(i, o);
                    counts[i] += 1;
                });
            }
    }

   private:
    SamplePoint firstPoint(size_t receiver) const { return samplePoint(rays_, unwrap_, texels_, receiver, 0); }

    // As near as texels of one plane are, wherever in them samples lie: islands lie side by side on the page alone, and
    // may lie in parallel planes. By whole texels' size: what a border cuts off leaves them as far apart.
    bool nearInSpace(const SamplePoint& a, const SamplePoint& b, int dx, int dy) const {
        const float size_m = std::sqrt(std::max(unwrap_.texel_area_m2[a.face], unwrap_.texel_area_m2[b.face]));
        const glm::vec3 way = b.position_m - a.position_m;
        const float off_plane_m = std::abs(glm::dot(way, unwrap_.frames[a.face].normal));
        const auto side = [](int texels) { return static_cast<float>(std::abs(texels) + 1); };
        return glm::length(way) <= stretch_max * std::hypot(side(dx), side(dy)) * size_m &&
               off_plane_m <= off_plane_share * std::max(glm::length(way), size_m);
    }

    const RayScene& rays_;
    const Unwrap& unwrap_;
    const Texels& texels_;
};

class LightmapFilter {
   public:
    LightmapFilter(const Surface& surface, const Sparse<ReceiverLight>& light, int step)
        : surface_(surface), light_(light), step_(step) {
        means_ = Sparse<float>::build(light.rows(), [&](size_t begin, size_t end, auto emit) {
            std::vector<float> row, counts;
            for (size_t i = begin; i < end; ++i) {
                row.clear();
                for (const ReceiverLight& l : light.row(i)) row.push_back(luminance(l.light.irradiance_lux));
                surface.addAround(light, i, counts, [&](size_t k, const ReceiverLight& o) {
                    row[k] += luminance(o.light.irradiance_lux);
                });
                for (size_t k = 0; k < row.size(); ++k) row[k] /= counts[k];
                emit(std::span<const float>(row));
            }
        });
    }

    // `row`: the receiver's, as it is in the light.
    void filter(size_t receiver, std::span<ReceiverLight> row) const {
        std::vector<Sum> sums(row.size());
        for (int dy = -kernel_reach; dy <= kernel_reach; ++dy)
            for (int dx = -kernel_reach; dx <= kernel_reach; ++dx) {
                const uint32_t other = surface_.neighbour(receiver, dx * step_, dy * step_);
                if (other == no_index) continue;
                const float spatial =
                    kernel[static_cast<size_t>(std::abs(dx))] * kernel[static_cast<size_t>(std::abs(dy))];
                addRow(receiver, other, spatial, sums);
            }
        for (size_t i = 0; i < row.size(); ++i) {
            if (!(sums[i].weight > 0)) continue;
            row[i].light = sums[i].light * (1 / sums[i].weight);
            row[i].variance = sums[i].variance / (sums[i].weight * sums[i].weight);
        }
    }

   private:
    struct Sum {
        Gathered light;
        float weight = 0, variance = 0;
    };

    void addRow(size_t receiver, size_t other, float spatial, std::vector<Sum>& sums) const {
        const auto here = light_.row(receiver), there = light_.row(other);
        const auto means_here = means_.row(receiver), means_there = means_.row(other);
        forEachCommonTerm(here, there, [&](size_t i, const ReceiverLight& o) {
            float weight = spatial;
            if (other != receiver) {
                const float texels = luminance(here[i].light.irradiance_lux) - luminance(o.light.irradiance_lux);
                const float means = means_here[i] - means_there[static_cast<size_t>(&o - there.data())];
                weight *= alike(texels, means, here[i].variance + o.variance);
            }
            if (!(weight > 0)) return;
            sums[i].light += o.light * weight;
            sums[i].weight += weight;
            sums[i].variance += weight * weight * o.variance;
        });
    }

    // By differences of luminance, and the variance of that of single texels.
    static float alike(float texels, float means, float variance) {
        if (!(variance > 0)) return 0;
        const float of_texels = texels / texel_deviations, of_means = means / mean_deviations;
        return std::exp(-(of_texels * of_texels + of_means * of_means) / (2 * variance));
    }

    const Surface& surface_;
    const Sparse<ReceiverLight>& light_;
    int step_;
    Sparse<float> means_;  // of the luminance around each entry of light_
};

// Per block of receivers: the last one with receivers at most `steps` times `step` texels away, which may read them.
std::vector<uint32_t> lastReaders(const Unwrap& unwrap, const Texels& texels, int steps, int step) {
    std::vector<uint32_t> last(blockCount(texels.size()));
    forEachBlock(texels.size(), [&](size_t begin, size_t end) {
        uint32_t furthest = 0;
        for (size_t i = begin; i < end; ++i)
            for (int dy = -steps; dy <= steps; ++dy)
                for (int dx = -steps; dx <= steps; ++dx)
                    if (const uint32_t other = neighbourInChart(unwrap, texels, i, dx * step, dy * step);
                        other != no_index)
                        furthest = std::max(furthest, other);
        last[begin / rows_per_block] = static_cast<uint32_t>(furthest / rows_per_block);
    });
    return last;
}

}  // namespace

Sparse<ReceiverLight> denoise(const RayScene& rays, const Unwrap& unwrap, const Texels& texels,
                              Sparse<ReceiverLight> light, Progress& progress) {
    progress.stage("denoise", texels.size() * (passes + 1));
    const Surface surface(rays, unwrap, texels);
    const auto run = [&](int steps, int step, auto&& filter_row) {
        light.rewrite(lastReaders(unwrap, texels, steps, step), [&](size_t begin, size_t end, auto row_of) {
            for (size_t i = begin; i < end; ++i) filter_row(i, row_of(i));
            progress.advance(end - begin);
        });
    };
    run(mean_reach, 1, [&](size_t i, std::span<ReceiverLight> row) {
        std::vector<float> counts;
        surface.addAround(light, i, counts, [&](size_t k, const ReceiverLight& o) { row[k].variance += o.variance; });
        for (size_t k = 0; k < row.size(); ++k) row[k].variance /= counts[k];
    });
    for (int pass = 0; pass < passes; ++pass)
        run(kernel_reach, 1 << pass,
            [filter = LightmapFilter(surface, light, 1 << pass)](size_t i, std::span<ReceiverLight> row) {
                filter.filter(i, row);
            });
    return light;
}

}  // namespace dimmer::cook
