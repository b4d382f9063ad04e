#include <bake/denoise.h>

#include <bake/sampling.h>
#include <pack/pack_data.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace dimmer::cook {
namespace {

constexpr int passes = 3;             // steps of 1, 2, 4 texels
constexpr float edge_deviations = 3;  // differences up to this many standard deviations count as noise
constexpr std::array<float, 3> kernel = {3.0f / 8, 1.0f / 4, 1.0f / 16};  // B3 spline, by distance

// The smoothing of a variance: a texel's own estimate comes from a handful of rounds and says little alone.
constexpr int variance_reach = 1;

// Directional light is averaged as it is stored, by the tangent frame.
constexpr float same_frame_cos = 0.99f;
// An unwrap of the level's own may stretch texels: longer than a square one of their area by so much.
constexpr float stretch_max = 1.5f;
// Off the plane, of the way to a neighbour: above what frames that agree curve, below a step of stairs.
constexpr float off_plane_share = 0.25f;

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
                const uint32_t other = neighbour(receiver, dx * step_, dy * step_);
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
                const uint32_t other = neighbour(receiver, dx, dy);
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

    // The receiver so many texels away on the same surface; no_index where there is none.
    uint32_t neighbour(size_t receiver, int dx, int dy) const {
        const uint32_t other = neighbourInChart(unwrap_, texels_, receiver, dx, dy);
        if (other == no_index || other == receiver) return other;
        const SamplePoint &a = texels_.sample(receiver, 0), &b = texels_.sample(other, 0);
        if (a.face == b.face || !unwrap_.charts[unwrap_.face_chart[a.face]].of_file) return other;
        return framesAgree(a.face, b.face) && nearInSpace(a, b, dx, dy) ? other : no_index;
    }

    bool framesAgree(uint32_t a, uint32_t b) const {
        const TangentFrame &f = unwrap_.frames[a], &g = unwrap_.frames[b];
        return glm::dot(f.normal, g.normal) > same_frame_cos && glm::dot(f.tangent, g.tangent) > same_frame_cos &&
               glm::dot(f.bitangent, g.bitangent) > same_frame_cos;
    }

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
