#include <bake/sharpen.h>

#include <bake/sampling.h>

#include <algorithm>

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

}  // namespace

Sparse<ReceiverLight> sharpen(const BilinearTaps& taps, const Sparse<ReceiverLight>& light, Progress& progress) {
    progress.stage("sharpen", light.rows());
    return Sparse<ReceiverLight>::build(light.rows(), [&](size_t begin, size_t end, auto emit) {
        std::vector<ReceiverLight> row;
        std::vector<Step> steps;
        std::vector<Tap> around;
        for (size_t i = begin; i < end; ++i) {
            const auto here = light.row(i);
            row.assign(here.begin(), here.end());
            steps.assign(row.size(), {});
            if (!row.empty()) taps.around(static_cast<uint32_t>(i), around);
            for (size_t n = 1; !row.empty() && n < around.size(); ++n)
                forEachCommonTerm(here, light.row(around[n].receiver), [&](size_t k, const ReceiverLight& there) {
                    const float weight = around[n].weight;
                    steps[k].light += here[k].light * weight;
                    steps[k].light += there.light * -weight;
                    steps[k].from_own += weight;
                    steps[k].variance += weight * weight * there.variance;
                });
            for (size_t k = 0; k < row.size(); ++k) move(row[k], steps[k]);
            emit(std::span<const ReceiverLight>(row));
        }
        progress.advance(end - begin);
    });
}

}  // namespace dimmer::cook
