// A batch at a time gives the bits of a texel at a time.
#include <cpu/batch_blend.h>
#include <gtest/gtest.h>

#include "random_pack.h"

namespace dimmer {
namespace {

template <ColorFormat format>
void agreesWithSingleTexels(bool hostile) {
    test::Random random(hostile ? 2 : 1);
    for (int round = 0; round < 400; ++round) {
        const uint32_t count = test::pick(random, 1, batch_receivers_max);
        BatchBlend<format> batch(count);
        std::vector<TexelBlend<format>> single(count);
        std::vector<TexelRecord> records(count);
        for (uint32_t terms = test::pick(random, 1, 20); terms > 0; --terms) {
            for (TexelRecord& record : records)
                record = hostile ? TexelRecord{static_cast<uint32_t>(random()), static_cast<uint32_t>(random())}
                                 : test::randomRecord(random, 1.0f / 64);
            float w[3];
            // Up to 2^27, more than max_weight_limit; hostile ones down to where products are denormal numbers.
            for (float& channel : w)
                channel = weightScale(format) *
                          (hostile ? std::exp2(test::uniform(random, -120, 27)) : test::uniform(random, 0, 2));
            batch.add(records.data(), w[0], w[1], w[2]);
            for (uint32_t i = 0; i < count; ++i) single[i].add(canonical(format, records[i]), w[0], w[1], w[2]);
        }
        batch.encode(records.data());
        for (uint32_t i = 0; i < count; ++i) ASSERT_EQ(records[i], single[i].encode()) << "round " << round;
    }
}

TEST(BatchBlend, AgreesWithTexelBlendBitForBit) {
    agreesWithSingleTexels<ColorFormat::R11G11B10F>(false);
    agreesWithSingleTexels<ColorFormat::E5B9G9R9>(false);
}

TEST(BatchBlend, AgreesWithTexelBlendOnHostileNumbers) {
    agreesWithSingleTexels<ColorFormat::R11G11B10F>(true);
    agreesWithSingleTexels<ColorFormat::E5B9G9R9>(true);
}

}  // namespace
}  // namespace dimmer
