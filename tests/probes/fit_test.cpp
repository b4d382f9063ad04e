// Probes' light by least squares.
#include <gtest/gtest.h>
#include <probes/fit.h>
#include <runtime/random_pack.h>

#include <cmath>

namespace dimmer::cook {
namespace {

using dimmer::test::pick;
using dimmer::test::Random;
using dimmer::test::uniform;

std::vector<FitSite> randomSites(Random& random, uint32_t probes, uint32_t count) {
    std::vector<FitSite> sites(count);
    for (FitSite& s : sites) {
        float sum = 0;
        for (size_t k = 0; k < 4; ++k) {
            s.probes[k] = (pick(random, 0, probes - 1) / 4 * 4 + static_cast<uint32_t>(k)) % probes;
            sum += s.shares[k] = uniform(random, 0, 1);
        }
        for (float& share : s.shares) share /= sum;
        s.importance = uniform(random, 0.1f, 3);
    }
    return sites;
}

std::vector<FitValue> randomValues(Random& random, size_t count) {
    std::vector<FitValue> values(count);
    for (FitValue& v : values)
        for (float& x : v) x = uniform(random, -1, 4);
    return values;
}

FitValue interpolate(const FitSite& s, std::span<const FitValue> probes) {
    FitValue sum{};
    for (size_t k = 0; k < 4; ++k)
        for (size_t c = 0; c < 27; ++c) sum[c] += s.shares[k] * probes[s.probes[k]][c];
    return sum;
}

double squares(std::span<const FitSite> sites, std::span<const FitValue> targets, std::span<const FitValue> probes) {
    double sum = 0;
    for (size_t s = 0; s < sites.size(); ++s) {
        const FitValue is = interpolate(sites[s], probes);
        for (size_t c = 0; c < 27; ++c)
            sum += static_cast<double>(sites[s].importance) * std::pow(static_cast<double>(is[c] - targets[s][c]), 2);
    }
    return sum;
}

// Where some light of the probes explains all sites and the prior is that light, it stays.
TEST(ProbeFit, KeepsWhatIsRight) {
    Random random(1);
    const auto sites = randomSites(random, 40, 400);
    const auto right = randomValues(random, 40);
    std::vector<FitValue> targets;
    for (const FitSite& s : sites) targets.push_back(interpolate(s, right));
    auto probes = right;
    fitProbes(sites, targets, probes);
    for (size_t i = 0; i < probes.size(); ++i)
        for (size_t c = 0; c < 27; ++c) EXPECT_NEAR(probes[i][c], right[i][c], 1e-4);  // 32-bit sums
}

// From a prior that is wrong everywhere, most of the error goes. The prior weighs 1 %, so at the optimum what is left
// of the squares is at most 1 % of what the prior's distance to the right light would cost, which the diagonal bounds.
TEST(ProbeFit, FindsTheLightThatExplainsTheSites) {
    Random random(2);
    const auto sites = randomSites(random, 40, 2000);
    const auto right = randomValues(random, 40);
    std::vector<FitValue> targets;
    for (const FitSite& s : sites) targets.push_back(interpolate(s, right));
    auto probes = randomValues(random, 40);
    double bound = 0;
    for (const FitSite& s : sites)
        for (size_t k = 0; k < 4; ++k)
            for (size_t c = 0; c < 27; ++c)
                bound += 0.01 * static_cast<double>(s.importance * s.shares[k] * s.shares[k]) *
                         std::pow(static_cast<double>(probes[s.probes[k]][c] - right[s.probes[k]][c]), 2);
    fitProbes(sites, targets, probes);
    EXPECT_LE(squares(sites, targets, probes), bound);
}

// No step along any coefficient of any probe makes the sum of squares and prior smaller: it is the minimum.
TEST(ProbeFit, IsTheMinimum) {
    Random random(3);
    const auto sites = randomSites(random, 12, 60);
    const auto targets = randomValues(random, 60), prior = randomValues(random, 12);
    auto probes = prior;
    fitProbes(sites, targets, probes);
    std::vector<double> weight(12, 0);
    for (const FitSite& s : sites)
        for (size_t k = 0; k < 4; ++k)
            weight[s.probes[k]] += 0.01 * static_cast<double>(s.importance * s.shares[k] * s.shares[k]);
    const auto energy = [&](std::span<const FitValue> x) {
        double sum = squares(sites, targets, x);
        for (size_t i = 0; i < 12; ++i)
            for (size_t c = 0; c < 27; ++c) {
                const double w = weight[i] > 0 ? weight[i] : 1;
                sum += w * std::pow(static_cast<double>(x[i][c] - prior[i][c]), 2);
            }
        return sum;
    };
    const double least = energy(probes);
    for (size_t i = 0; i < 12; ++i)
        for (const float step : {-0.02f, 0.02f}) {
            auto moved = probes;
            moved[i][i] += step;
            EXPECT_GT(energy(moved), least) << i;
        }
}

// What was put where nothing was traced has no say: even light is even there too.
TEST(ProbeFit, GuessesHaveNoSay) {
    Random random(4);
    const auto sites = randomSites(random, 40, 400);
    FitValue even;
    even.fill(3);
    const std::vector<FitValue> targets(sites.size(), even);
    std::vector<FitValue> probes(40, even);
    std::vector<float> own(40, 1);
    for (const size_t i : {7u, 21u}) {
        probes[i].fill(1000);
        own[i] = 0;
    }
    fitProbes(sites, targets, probes, 1e-3f, own);
    // The tolerance is 0.001 of all light, that of 40 probes.
    for (const FitValue& v : probes)
        for (const float x : v) EXPECT_NEAR(x, 3, 3 * 0.001f * std::sqrt(40.0f));
}

// A probe beside a lamp has three hundred times the light of the places around, and is not asked for them: of
// sites with importance 2, share a and target t, and a prior p of importance o, the minimum of sum 2 a^2 (x - t)^2 +
// 0.01 min(o, 2) sum a^2 (x - p)^2 is x = (2 t + w p) / (2 + w), with w = 0.01 min(o, 2).
TEST(ProbeFit, LightBesideALampIsNotTakenFarther) {
    FitValue here, around, seen;
    here.fill(1000);
    around.fill(3);
    seen.fill(0.3f * 3);
    const FitSite site{.probes = {0, 1, 1, 1}, .shares = {0.3f, 0, 0, 0}, .importance = 2};
    const std::vector<FitSite> sites(20, site);
    const std::vector<FitValue> targets(20, seen);
    for (const float own : {1e-6f, 1e-3f, 1.0f, 50.0f}) {
        std::vector<FitValue> probes = {here, around};
        fitProbes(sites, targets, probes, 1e-3f, std::vector<float>{own, 1});
        const float prior = 0.01f * std::min(own, 2.0f);
        const float best = (2 * 3 + prior * 1000) / (2 + prior);
        // Of what is fitted the tolerance, and of what it starts from the rounding.
        EXPECT_NEAR(probes[0][0], best, 1e-3f * best + 4 * 1000 * 0x1p-23f) << own;
        EXPECT_EQ(probes[1], around);
    }
}

}  // namespace
}  // namespace dimmer::cook
