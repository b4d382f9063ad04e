// What a cook says of doors that do nothing, or lose light together.
#include <gtest/gtest.h>
#include <pipeline/door_warnings.h>

#include <cmath>

namespace dimmer::cook::test {
namespace {

constexpr uint32_t doors_in_row = 4;

struct DoorRow {
    Scene scene;
    Baked baked;

    // Light of the first room passes each door by itself up to `reached`.
    explicit DoorRow(uint32_t reached) {
        scene.file = "row.gltf";
        baked.terms.push_back({});
        for (uint32_t d = 0; d < doors_in_row; ++d) {
            scene.doors.push_back({std::string(1, static_cast<char>('p' + d)), false});
            Term term;
            term.doors_open = {d};
            baked.terms.push_back(term);
        }
        baked.reports.resize(baked.terms.size());
        for (uint32_t d = 0; d < reached; ++d) baked.reports[1 + d] = {.receivers = 9, .energy = 1};
        baked.door_flux.resize(1);
        for (uint32_t d = 0; d + 1 < doors_in_row; ++d) baked.door_flux[0].pairs.push_back({d, d + 1, 0});
    }

    CookStats stats() const {
        CookStats stats;
        warnOfElements(scene, baked, stats);
        return stats;
    }
};

using Names = std::vector<std::string>;

// The third room is in no pair's light: what is to be named is told from one cook to the next, until light is there.
TEST(DoorWarnings, ADoorBehindTwoOthersIsToBeNamedWithThem) {
    DoorRow row(1);
    row.baked.dependent_doors = {{0, 1, INFINITY}};
    CookStats stats = row.stats();
    EXPECT_EQ(stats.suggested_combinations, (std::vector<Names>{{"door:p", "door:q", "door:r"}, {"door:p", "door:q"}}));
    ASSERT_EQ(stats.warnings.size(), 3u);
    EXPECT_EQ(stats.warnings[0],
              "row.gltf: door 'r' changes no light by itself: if light comes to it through other doors alone, name "
              "[\"door:p\", \"door:q\", \"door:r\"] in the scene's 'dimmer_combinations' (--suggest-combinations "
              "prints the list); if none does, it does nothing");
    EXPECT_EQ(stats.warnings[1], "row.gltf: door 's' changes no light; it is kept, and does nothing");

    // Pairs alone, as the cook told before.
    row.scene.combinations = {{{true, 0}, {true, 1}}, {{true, 1}, {true, 2}}};
    row.baked.dependent_doors.clear();
    row.baked.door_flux[0].pairs = {{2, 3, 0}};
    row.baked.reports[2] = {.receivers = 9, .energy = 1};
    stats = row.stats();
    EXPECT_EQ(stats.suggested_combinations, (std::vector<Names>{{"door:p", "door:q", "door:r"}}));

    // The three together; then the fourth one is next.
    row.scene.combinations = {{{true, 0}, {true, 1}, {true, 2}}};
    row.baked.reports[3] = {.receivers = 9, .energy = 1};
    stats = row.stats();
    EXPECT_EQ(stats.suggested_combinations, (std::vector<Names>{{"door:p", "door:q", "door:r", "door:s"}}));

    // Named, and still dark: so it is.
    row.scene.combinations = {{{true, 0}, {true, 1}, {true, 2}, {true, 3}}};
    stats = row.stats();
    EXPECT_TRUE(stats.suggested_combinations.empty());
    ASSERT_EQ(stats.warnings.size(), 1u);
    EXPECT_EQ(stats.warnings[0], "row.gltf: door 's' changes no light; it is kept, and does nothing");
}

// What is suggested can be named: eight doors at most in one list, and a few lists for a door.
TEST(DoorWarnings, ChainsAreAsLongAndAsManyAsALevelMayName) {
    DoorRow row(doors_in_row - 1);  // the last one is dark
    for (uint32_t d = 0; d < 20; ++d) row.scene.doors.push_back({"x" + std::to_string(d), false});
    const auto last = doors_in_row - 1;
    std::vector<ElementRef> eight = {{true, last - 1}};
    Term term;
    row.baked.terms.clear();
    row.baked.reports.clear();
    for (uint32_t d = 0; d < row.scene.doors.size(); ++d) {
        if (d == last) continue;
        term.doors_open = {d};
        row.baked.terms.push_back(term);
        row.baked.reports.push_back({.receivers = 9, .energy = 1});
        if (d > last && eight.size() < 8) eight.push_back({true, d});
    }
    row.scene.combinations = {eight};
    EXPECT_TRUE(row.stats().suggested_combinations.empty());
    row.scene.combinations.clear();
    for (uint32_t d = last + 1; d < row.scene.doors.size(); ++d)
        row.scene.combinations.push_back({{true, last - 1}, {true, d}});
    EXPECT_EQ(row.stats().suggested_combinations.size(), 3u);
}

TEST(DoorWarnings, OfManyPairsTheLargestAreTold) {
    DoorRow row(doors_in_row);
    for (uint32_t i = 0; i < 20; ++i) row.baked.dependent_doors.push_back({0, 1, 0.5f - 0.01f * static_cast<float>(i)});
    const CookStats stats = row.stats();
    EXPECT_EQ(stats.suggested_combinations.size(), 20u);
    ASSERT_EQ(stats.warnings.size(), 9u);
    EXPECT_EQ(stats.warnings[8],
              "row.gltf: 12 pairs of doors more depend on each other, for 42 % at most: --suggest-combinations prints "
              "the list");
}

}  // namespace
}  // namespace dimmer::cook::test
