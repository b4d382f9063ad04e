#include <bake/links.h>
#include <bake/sampling.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace dimmer::cook::test {
namespace {

// What a row is read as: by path, then by receiver.
void inOrder(std::vector<Link>& links) {
    std::ranges::sort(links, {}, [](const Link& l) { return std::pair(l.path, l.receiver); });
}

// As they were put, but for their order, from many threads at once.
void expectReadAsPut(size_t receivers, auto&& linksOf) {
    Links::Builder builder(receivers);
    forEachBlock(receivers, [&](size_t begin, size_t end) {
        for (size_t row = begin; row < end; ++row) {
            std::vector<Link> links = linksOf(row);
            builder.put(row, links);
        }
        builder.close(begin);
    });
    const Links all = builder.finish();
    size_t wrong = 0;
    std::vector<Link> found = {{7, 7}};
    for (size_t row = 0; row < receivers; ++row) {
        std::vector<Link> expected = linksOf(row);
        inOrder(expected);
        all.get(row, found);
        wrong += found != expected;
    }
    EXPECT_EQ(wrong, 0u) << receivers;
}

// Few receivers and many, rows without any, the same one many times, the largest numbers of both.
TEST(Links, AreReadAsTheyWerePut) {
    for (const size_t receivers : {1u, 2u, 3u, 255u, 256u, 1000u, 65536u, 1u << 18})
        for (const uint32_t most : {1u, 7u, 40u})
            for (const uint32_t paths : {1u, 3u, 100'000u})
                expectReadAsPut(receivers, [&](size_t row) {
                    std::vector<Link> links;
                    if (receivers > 1000 && row % 61 != 0) return links;  // of many, some in every block
                    const auto seed = static_cast<uint32_t>(row);
                    for (uint32_t i = 0; i < hash(seed, most) % (most + 1); ++i) {
                        const uint32_t at = hash(seed, i), over = hash(at, 1);
                        links.push_back({static_cast<uint32_t>(at % 5 == 0 ? receivers - 1 : at % receivers),
                                         over % 3 == 0   ? 0
                                         : over % 3 == 1 ? paths - 1
                                                         : over % paths});
                    }
                    return links;
                });
}

// All at the first receiver but one at the last: a difference of hundreds of times the mean.
TEST(Links, OneMayBeFarFromAllOthers) {
    constexpr uint32_t receivers = 1u << 20;
    expectReadAsPut(receivers, [&](size_t row) {
        return row % 4096 == 0 ? std::vector<Link>(300 + row / 4096, {row % 8192 == 0 ? 0u : receivers - 1, 5})
                               : std::vector<Link>{};
    });
    expectReadAsPut(receivers, [&](size_t row) {
        std::vector<Link> links(row % 4096 == 0 ? 300 : 0, {0, 0});
        if (!links.empty()) links[static_cast<size_t>(row / 4096)] = {receivers - 1, 0};
        return links;
    });
}

}  // namespace
}  // namespace dimmer::cook::test
