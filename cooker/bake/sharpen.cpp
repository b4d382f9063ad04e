#include <bake/sharpen.h>

#include <bake/sampling.h>

#include <algorithm>
#include <atomic>

namespace dimmer::cook {
namespace {

// A negative correction beside a bright edge takes no more of a texel than this.
constexpr float loss_max = 0.5f;

struct Step {
    Gathered light;      // the mean less what is shown
    float from_own = 0;  // weight of the texel's own mean in it
    float variance = 0;  // of its luminance, from the neighbours
};

void move(ReceiverLight& texel, const Step& step) {
    const float lux = luminance(step.light.irradiance_lux), mean_lux = luminance(texel.light.irradiance_lux);
    if (lux == 0) return;
    const float variance = step.variance + step.from_own * step.from_own * texel.variance;
    float share = std::max(0.0f, 1 - variance / (lux * lux));
    if (lux < 0) share = std::min(share, loss_max * mean_lux / -lux);
    texel.light += step.light * share;
    // A channel, or the light from one side, may fall faster than their sum.
    texel.light.irradiance_lux = glm::max(texel.light.irradiance_lux, 0.0f);
    texel.light.tilted_lux = glm::max(texel.light.tilted_lux, 0.0f);
}

// Receivers that lie so many blocks before one that they are shown beside: neighbours may be far from each other on the
// curve that receivers stand along, and over a seam padding shows any place.
struct FarBehind {
    uint32_t near_blocks;
    bool operator()(size_t receiver, size_t reader) const {
        return reader / rows_per_block > receiver / rows_per_block + near_blocks;
    }
};

// The rows of those.
Sparse<ReceiverLight> farBehind(const BilinearTaps& taps, const Sparse<ReceiverLight>& light, FarBehind isFarBehind) {
    std::vector<std::atomic<bool>> far(light.rows());
    forEachBlock(light.rows(), [&](size_t begin, size_t end) {
        std::vector<Tap> around;
        for (size_t i = begin; i < end; ++i) {
            taps.around(static_cast<uint32_t>(i), around);
            for (const Tap& tap : around)
                if (isFarBehind(tap.receiver, i)) far[tap.receiver] = true;
        }
    });
    return Sparse<ReceiverLight>::build(light.rows(), [&](size_t begin, size_t end, auto emit) {
        for (size_t i = begin; i < end; ++i) emit(far[i] ? light.row(i) : std::span<const ReceiverLight>());
    });
}

}  // namespace

Sparse<ReceiverLight> sharpen(const BilinearTaps& taps, Sparse<ReceiverLight> light, Progress& progress,
                              uint32_t near_blocks) {
    progress.stage("sharpen", light.rows());
    const FarBehind isFarBehind{near_blocks};
    const Sparse<ReceiverLight> far = farBehind(taps, light, isFarBehind);
    std::vector<uint32_t> last_reader(blockCount(light.rows()), near_blocks);
    for (size_t b = 0; b < last_reader.size(); ++b) last_reader[b] += static_cast<uint32_t>(b);
    const auto rowOf = [&](size_t receiver, size_t reader) {
        return isFarBehind(receiver, reader) ? far.row(receiver) : light.row(receiver);
    };
    light.rewrite(last_reader, [&](size_t begin, size_t end, auto row_of) {
        std::vector<Step> steps;
        std::vector<Tap> around;
        for (size_t i = begin; i < end; ++i) {
            const auto here = light.row(i);
            const std::span<ReceiverLight> row = row_of(i);
            steps.assign(row.size(), {});
            if (!row.empty()) taps.around(static_cast<uint32_t>(i), around);
            for (size_t n = 1; !row.empty() && n < around.size(); ++n)
                forEachCommonTerm(here, rowOf(around[n].receiver, i), [&](size_t k, const ReceiverLight& there) {
                    const float weight = around[n].weight;
                    steps[k].light += here[k].light * weight;
                    steps[k].light += there.light * -weight;
                    steps[k].from_own += weight;
                    steps[k].variance += weight * weight * there.variance;
                });
            for (size_t k = 0; k < row.size(); ++k) move(row[k], steps[k]);
        }
        progress.advance(end - begin);
    });
    return light;
}

}  // namespace dimmer::cook
