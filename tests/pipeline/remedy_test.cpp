// Remedies as they are printed: what is followed to the letter does what was said.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <pipeline/losses.h>
#include <pipeline/remedy.h>
#include <pipeline/settings.h>

namespace dimmer::cook::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

Remedy ofSets(size_t sets) {
    Remedy remedy{.changes = {{"records.threshold", 0.01f, 0.045f}}, .saves = 1500, .error = 0.0123};
    for (size_t i = 0; i < sets; ++i)
        remedy.changes.push_back({fmt::format("records.thresholds.set{}", i), 0.045f, 0.01f});
    return remedy;
}

TEST(RemedyText, OfFewChangesNamesAll) {
    EXPECT_EQ(ofSets(1).text(" (so)"),
              "records.threshold 0.01 -> 0.045, records.thresholds.set0 0.045 -> 0.01: saves 1.5 kB, adds a mean error "
              "of 1.23 % (so)");
}

// A set that keeps a threshold below that of all is the one that a shortened line would leave out.
TEST(RemedyText, OfManyGivesAllAsOptions) {
    const std::string text = ofSets(5).text(" (so)");
    EXPECT_THAT(text, HasSubstr("set2 0.045 -> 0.01 and 2 more: saves 1.5 kB, adds a mean error of 1.23 % (so)\n"));
    EXPECT_THAT(text,
                testing::EndsWith("\n    in full: --set records.threshold=0.045 --set records.thresholds.set0=0.01 "
                                  "--set records.thresholds.set1=0.01 --set records.thresholds.set2=0.01 "
                                  "--set records.thresholds.set3=0.01 --set records.thresholds.set4=0.01"));
}

TEST(RemedyText, OptionsAreWordsOfAShell) {
    const Remedy remedy{.changes = {{"records.thresholds.John's $lamp", 0, 0.5f}, {"records.thresholds.lamp", 0, 1}}};
    EXPECT_EQ(remedy.options(), R"(--set 'records.thresholds.John'\''s $lamp=0.5' --set records.thresholds.lamp=1)");
}

// That of all sets does what the set's own would do as well, and no more light goes.
TEST(Dominated, IsWhatChangesMoreAndIsNoBetter) {
    const Remedy less{.changes = {{"a", 0, 1}}, .saves = 1000, .error = 0.01};
    Remedy more{.changes = {{"a", 0, 0.5f}, {"b", 0, 1}}, .saves = 1000, .error = 0.01};
    EXPECT_THAT(withoutDominated({more, less}), ElementsAre(testing::Field(&Remedy::changes, less.changes)));
    // One that is better in anything stays, and so does one of other settings.
    Remedy saves = more, loses = more, fits = more, other = more;
    saves.saves = 1001;
    loses.error = 0.009;
    fits.fits = true;
    other.changes[0].key = "c";
    for (const Remedy& kept : {saves, loses, fits, other}) EXPECT_EQ(withoutDominated({kept, less}).size(), 2u);
}

TEST(BestOfEachKind, SavesMost) {
    const auto remedy = [](std::vector<Change> changes, uint64_t saves) {
        return Remedy{.changes = std::move(changes), .saves = saves};
    };
    const Change all{"records.threshold", 0, 1}, set{"records.thresholds.hall", 0, 1},
        density{"lightmaps.texels_per_metre", 4, 2}, probes{"grids.probes_max", 20, 10};
    std::vector<uint64_t> saved;
    for (const Remedy& r : bestOfEachKind({remedy({set}, 1), remedy({density}, 2), remedy({all, set}, 3),
                                           remedy({density, probes}, 4), remedy({all}, 2), remedy({probes}, 1)}))
        saved.push_back(r.saves);
    EXPECT_THAT(saved, ElementsAre(3, 2, 4, 1));
}

// 1.5 times 0.03 is 0.044999998 in floats; what is written reads back as the same float.
TEST(Ladder, HoldsDecimalsAsPeopleWriteThem) {
    std::vector<std::string> texts;
    for (size_t r = 0; r < 8; ++r) texts.push_back(fmt::format("{}", ladderOf(0.03f)[r]));
    EXPECT_THAT(texts, ElementsAre("0.03", "0.045", "0.06", "0.09", "0.12", "0.18", "0.24", "0.36"));
    EXPECT_EQ(ladderOf(0.03f).back(), 1);
    EXPECT_EQ(ladderOf(0.07f)[1], 0.105f);
    Profile profile;
    ASSERT_TRUE(assignText(profile, fmt::format("records.threshold={}", ladderOf(0.03f)[1]), "--set", "fit"));
    EXPECT_EQ(profile.threshold, ladderOf(0.03f)[1]);
    EXPECT_THAT(profile.settingsJson("draft"), HasSubstr(R"("records.threshold":{"value":0.045,"from":"fit"})"));
}

}  // namespace
}  // namespace dimmer::cook::test
