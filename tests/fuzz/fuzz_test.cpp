// A short run of every fuzz target: its seeds, and a few thousand damaged ones, the same with every run. scripts/fuzz
// runs the same targets for as long as one likes.
#include <fuzz/mutate.h>
#include <gtest/gtest.h>

namespace dimmer::fuzz {
namespace {

class FuzzTarget : public testing::TestWithParam<Target> {};

TEST_P(FuzzTarget, TheSeedsAndDamagedOnes) {
    const Target& target = GetParam();
    const std::vector<Bytes> seeds = target.seeds();
    ASSERT_FALSE(seeds.empty());
    for (const Bytes& seed : seeds) runChecked(target, seed);
    std::mt19937 random(1);
    for (int i = 0; i < 3000; ++i) {
        Bytes input = seeds[random() % seeds.size()];
        const Bytes& other = seeds[random() % seeds.size()];
        for (uint32_t steps = 1 + random() % 4; steps > 0; --steps) mutateOnce(input, other, random);
        runChecked(target, input);  // aborts when a promise is broken
    }
}

INSTANTIATE_TEST_SUITE_P(All, FuzzTarget, testing::ValuesIn(targets().begin(), targets().end()),
                         [](const auto& target) { return std::string(target.param.name); });

TEST(FuzzTargets, AreFoundByName) {
    for (const Target& target : targets()) EXPECT_EQ(findTarget(target.name), &target);
    EXPECT_EQ(findTarget("pac"), nullptr);
}

TEST(FuzzTargetsDeathTest, ABrokenPromiseAborts) {
    EXPECT_DEATH(require(false, "the sky is green"), "the sky is green");
}

}  // namespace
}  // namespace dimmer::fuzz
