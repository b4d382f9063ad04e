#include <bake/links.h>
#include <bake/sampling.h>
#include <gtest/gtest.h>

#include <tbb/parallel_for.h>

namespace dimmer::cook::test {
namespace {

// Numbers of 1 to 21 bits, rows that end within a byte, the largest number and none: as they were put, from many
// threads at once.
TEST(Links, AreReadAsTheyWerePut) {
    for (const size_t receivers : {1u, 2u, 3u, 255u, 256u, 1000u, 65535u, 65536u, 1u << 20})
        for (const size_t of_each : {1u, 7u, 32u}) {
            const auto hit = [&](size_t row, size_t i) {
                const uint32_t at = hash(static_cast<uint32_t>(row), static_cast<uint32_t>(i));
                return at % 5 == 0 ? no_index : static_cast<uint32_t>(at % 5 == 1 ? receivers - 1 : at % receivers);
            };
            Links links(receivers, of_each);
            tbb::parallel_for(size_t{0}, receivers, [&](size_t row) {
                std::vector<uint32_t> hits;
                for (size_t i = 0; i < of_each; ++i) hits.push_back(hit(row, i));
                links.put(row, hits);
            });
            size_t wrong = 0;
            std::vector<uint32_t> hits(of_each);
            for (size_t row = 0; row < receivers; ++row) {
                links.get(row, hits);
                for (size_t i = 0; i < of_each; ++i) wrong += hits[i] != hit(row, i);
            }
            EXPECT_EQ(wrong, 0u) << receivers << " " << of_each;
        }
}

}  // namespace
}  // namespace dimmer::cook::test
