// The limit on contributions per receiver: which stay, and what is said of those that go.
#include <bake/overlap.h>
#include <gtest/gtest.h>

#include <limits>

namespace dimmer::cook::test {
namespace {

ReceiverLight lit(uint32_t term, float lux) {
    ReceiverLight l{.term = term, .light = {}};
    l.light.irradiance_lux = glm::vec3(lux);
    return l;
}

Baked bakedOf(const std::vector<std::vector<ReceiverLight>>& rows, size_t terms) {
    Baked baked;
    baked.light = Sparse<ReceiverLight>::build(rows.size(), [&](size_t begin, size_t end, auto&& emit) {
        for (size_t i = begin; i < end; ++i) emit(std::span<const ReceiverLight>(rows[i]));
    });
    for (uint32_t t = 0; t < terms; ++t) baked.terms.push_back({.group = t, .doors_open = {}, .doors_closed = {}});
    baked.reports.resize(terms);
    return baked;
}

std::vector<uint32_t> termsAt(const Baked& baked, size_t row) {
    std::vector<uint32_t> terms;
    for (const ReceiverLight& l : baked.light.row(row)) terms.push_back(l.term);
    return terms;
}

using Terms = std::vector<uint32_t>;
const std::vector<float> same_areas(4, 1.0f);

TEST(Overlap, TheBrightestStayInTheirOrder) {
    // Always-on light stays however faint it is, and does not count; of equals the first stays.
    const std::vector<std::vector<ReceiverLight>> rows = {
        {lit(0, 0.01f), lit(1, 3), lit(2, 1), lit(3, 2), lit(4, 3)},
        {lit(1, 1), lit(2, 1), lit(4, 1)},
        {lit(0, 5), lit(2, 1)},
        {},
    };
    Baked baked = bakedOf(rows, 5);
    limitOverlap(baked, same_areas, 2);
    EXPECT_EQ(termsAt(baked, 0), (Terms{0, 1, 4}));
    EXPECT_EQ(termsAt(baked, 1), (Terms{1, 2}));
    EXPECT_EQ(termsAt(baked, 2), (Terms{0, 2}));
    EXPECT_EQ(termsAt(baked, 3), Terms{});
}

TEST(Overlap, WhatGoesIsReported) {
    Baked baked = bakedOf({{lit(1, 3), lit(2, 1)}, {lit(2, 3)}}, 3);
    baked.reports[2].energy_dropped = 0.5;  // half of it below the threshold before
    limitOverlap(baked, std::vector<float>{4, 1}, 1);
    EXPECT_DOUBLE_EQ(baked.reports[1].energy_dropped, 0);
    // Of 1 lux on 4 m2 and 3 lux on 1 m2, the first go.
    EXPECT_DOUBLE_EQ(baked.reports[2].energy_dropped, 0.5 + 0.5 * 4 / 7);
}

TEST(Overlap, NoLimitChangesNothing) {
    Baked baked = bakedOf({{lit(0, 1), lit(1, 3), lit(2, 1)}}, 3);
    limitOverlap(baked, same_areas, 0);
    EXPECT_EQ(termsAt(baked, 0), (Terms{0, 1, 2}));
    limitOverlap(baked, same_areas, 2);
    EXPECT_EQ(termsAt(baked, 0), (Terms{0, 1, 2}));
}

}  // namespace
}  // namespace dimmer::cook::test
