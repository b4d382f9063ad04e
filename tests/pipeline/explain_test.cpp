// `dimmer explain` against packs whose light is known by construction.
#include <format/texel.h>
#include <gmock/gmock.h>
#include <pipeline/explain.h>

#include <pack/sample_pack.h>
#include <probes/tetrahedra.h>

#include <cmath>
#include <numbers>

namespace dimmer::cook {
namespace {

using testing::HasSubstr;

constexpr uint32_t side = 8;

uint32_t evenLight(float light) {
    return encodeR11G11B10(light, light, light);
}

TexelRecord even(float lux) {
    return {evenLight(lux), direction_none};
}

// A floor of 8 x 8 m, one texel per metre, u along +x and v along +z. Everywhere: base 8 lux, set "hall" 64 lux; where
// x > 4 also set "lamp" through door "front", 32 lux. All are powers of two, so the format holds them exactly.
PackData halves() {
    PackData d;
    d.page_width = d.page_height = side;
    d.page_count = 1;
    d.elements = {
        {"hall", ElementKind::LightSet, 1}, {"lamp", ElementKind::LightSet, 2}, {"front", ElementKind::Door, 1}};
    d.contributions = {
        {.light_set = 0, .doors_open = {}, .doors_closed = {}, .receivers = 64, .energy_dropped = 0},
        {.light_set = 1, .doors_open = {2}, .doors_closed = {}, .receivers = 32, .energy_dropped = 0.125f}};
    d.base_pages.assign(size_t{side} * side, even(8));
    for (const uint32_t first_x : {0u, 4u}) {
        const bool lamp = first_x > 0;
        const auto receiver = static_cast<uint32_t>(d.addresses.size());
        d.clusters.push_back({receiver, 32, lamp ? 1u : 0u, 1, lamp ? 1u : 0u, lamp ? 2u : 1u});
        d.batches.push_back({receiver, 32});
        d.terms.push_back({0, receiver});
        if (lamp) d.terms.push_back({1, 64});
        for (uint32_t y = 0; y < side; ++y)
            for (uint32_t x = first_x; x < first_x + 4; ++x) d.addresses.push_back(TexelAddress::pack(0, x, y));
    }
    d.payload.assign(64, even(64));
    d.payload.resize(96, even(32));
    Mesh floor;
    floor.node = "floor";
    for (const auto& [x, z] : {std::pair{0.0f, 0.0f}, {0.0f, 8.0f}, {8.0f, 8.0f}, {8.0f, 0.0f}})
        floor.vertices.push_back({{x, 0, z}, {0, 1, 0}, {x / 8, z / 8}});
    floor.indices = {0, 1, 2, 0, 2, 3};
    d.meshes = {floor};
    return d;
}

Pack halvesPack() {
    auto pack = Pack::fromData(halves());
    EXPECT_TRUE(pack) << pack.error().message;
    return *pack;
}

TEST(Explain, NamesTheTexelItsClusterAndItsBatch) {
    const auto e = explain(halvesPack(), {6.5f, 0.05f, 2.5f}, {}, "");
    ASSERT_TRUE(e) << e.error().message;
    EXPECT_EQ(e->surface->place.mesh, 0u);
    EXPECT_NEAR(e->surface->place.distance_m, 0.05f, 1e-6f);
    EXPECT_EQ(e->surface->texel, (std::array<uint32_t, 2>{6, 2}));
    EXPECT_EQ(e->surface->receiver.cluster, 1u);
    EXPECT_EQ(e->surface->receiver.batch, 1u);
    EXPECT_EQ(explain(halvesPack(), {0.5f, 0, 7.5f}, {}, "")->surface->receiver.cluster, 0u);
}

TEST(Explain, EveryContributionWithItsWeightAndShare) {
    const auto e = explain(halvesPack(), {6.5f, 0, 2.5f}, glm::vec3(0, 1, 0), "hall=0.5,lamp=2,door:front=0.25");
    ASSERT_TRUE(e) << e.error().message;
    ASSERT_EQ(e->contributions.size(), 2u);
    const auto& [hall, lamp] = std::tie(e->contributions[0], e->contributions[1]);
    EXPECT_EQ(hall.weight, Weight(0.5f));
    EXPECT_EQ(lamp.weight, Weight(2 * 0.25f));
    EXPECT_TRUE(hall.records == 1 && lamp.records == 1);
    // 8 + 0.5 * 64 + 0.5 * 32 = 56 lux; sums in the format of 7 bits hold it exactly (56 = 1.75 * 32).
    for (const size_t c : {0u, 1u, 2u}) {
        EXPECT_FLOAT_EQ(e->base_lux[c], 8);
        EXPECT_FLOAT_EQ(hall.full_lux[c], 64);
        EXPECT_FLOAT_EQ(hall.lux[c], 32);
        EXPECT_FLOAT_EQ(lamp.lux[c], 16);
        EXPECT_FLOAT_EQ(e->lux[c], 56);
    }
    EXPECT_NEAR(e->base_share, 8.0 / 56, 1e-6);
    EXPECT_NEAR(hall.share, 32.0 / 56, 1e-6);
    EXPECT_NEAR(lamp.share, 16.0 / 56, 1e-6);
}

TEST(Explain, AChannelAtATime) {
    const auto e = explain(halvesPack(), {6.5f, 0, 2.5f}, {}, "all=0,hall=1/0.5/0");
    ASSERT_TRUE(e) << e.error().message;
    EXPECT_FLOAT_EQ(e->contributions[0].lux[0], 64);
    EXPECT_FLOAT_EQ(e->contributions[0].lux[1], 32);
    EXPECT_FLOAT_EQ(e->contributions[0].lux[2], 0);
    EXPECT_FLOAT_EQ(e->lux[1], 8 + 32);
    EXPECT_EQ(e->contributions[1].lux, (std::array<float, 3>{}));
}

// Half way between the last texel without the lamp (centre 3.5 m) and the first with it (4.5 m): half of its light.
TEST(Explain, NeighboursTakePartByFiltering) {
    const auto e = explain(halvesPack(), {3.99f, 0, 2.5f}, {}, "door:front=1");
    ASSERT_TRUE(e) << e.error().message;
    const ExplainedContribution& lamp = e->contributions[1];
    EXPECT_EQ(lamp.records, 0u);
    EXPECT_NEAR(lamp.full_lux[0], 0.49f * 32, 1e-3f);
    // In the left half there is none of it.
    EXPECT_EQ(explain(halvesPack(), {1.5f, 0, 2.5f}, {}, "door:front=1")->contributions[1].full_lux,
              (std::array<float, 3>{}));
}

TEST(Explain, TexelsThatNeverChangeHaveNoCluster) {
    PackData d = halves();
    PackData fixed = d;
    fixed.contributions.clear();
    fixed.clusters.clear();
    fixed.terms.clear();
    fixed.batches.clear();
    fixed.addresses.clear();
    fixed.payload.clear();
    const auto pack = Pack::fromData(std::move(fixed));
    ASSERT_TRUE(pack) << pack.error().message;
    const auto e = explain(*pack, {1.5f, 0, 2.5f}, {}, "");
    ASSERT_TRUE(e) << e.error().message;
    EXPECT_FALSE(e->surface->receiver.cluster || e->surface->receiver.batch);
    EXPECT_DOUBLE_EQ(e->base_share, 1);
}

TEST(Explain, PlacesWithoutASurface) {
    const auto high = explain(halvesPack(), {4, 1.5f, 4}, {}, "");
    ASSERT_FALSE(high);
    EXPECT_EQ(high.error().code, ErrorCode::NotFound);
    EXPECT_THAT(high.error().message, HasSubstr("the nearest is 1.50 m away"));
    const auto below = explain(halvesPack(), {4, 0, 4}, glm::vec3(0, -1, 0), "");
    ASSERT_FALSE(below);
    EXPECT_THAT(below.error().message, HasSubstr("that faces along the normal"));
    EXPECT_FALSE(explain(halvesPack(), {4, 0, 4}, {}, "hal=1"));
}

// At a texel's centre, with directional records and every kind of contribution, the parts add up to what the pages
// hold.
TEST(Explain, PartsAddUpToThePages) {
    const auto pack = Pack::fromData(test::samplePack(3));
    ASSERT_TRUE(pack) << pack.error().message;
    size_t clustered = 0;
    for (int i = 0; i < 16; ++i) {
        // Texel centres of the floor: uv = 0.1 + 0.5 x on a page of 32.
        const auto centre = [](int texel) { return ((static_cast<float>(texel) + 0.5f) / 32 - 0.1f) / 0.5f; };
        const auto e = explain(*pack, {centre(4 + i % 8), 0, centre(5 + i / 2)}, {}, "door:door0=0.5,set0=2");
        ASSERT_TRUE(e) << e.error().message;
        clustered += e->surface->receiver.cluster.has_value();
        for (const size_t c : {0u, 1u, 2u}) {
            float sum = e->base_lux[c];
            for (const ExplainedContribution& part : e->contributions) sum += part.lux[c];
            // One rounding of the sum: half a step of 6 (blue: 5) bits, 1/128 (1/64).
            EXPECT_NEAR(e->lux[c], sum, sum / (c == 2 ? 63 : 127) + 1e-3f);
        }
    }
    EXPECT_GT(clustered, 4u);
}

// The floor again, 3 m below the probes of a tetrahedron that stands on (0, 3, 0) and reaches 1 m along each axis (a
// grid around it gives every place an answer). Radiance L is 1 cd/m2 on average at all probes, that of "hall" 4 cd/m2
// at those of x = 0, and leans upwards, by the code q = 32 of Y_1-1: E = pi L (1 + 2 q / 127 n.y), and pi L on average.
PackData withProbes() {
    PackData d = halves();
    const std::vector<glm::vec3> corners = {{0, 3, 0}, {1, 3, 0}, {0, 4, 0}, {0, 3, 1}};
    const auto built = tetrahedralise(corners, {{-1, 2, -1}, {2, 5, 2}});
    EXPECT_TRUE(built);
    d.probes.global = *built;
    const float y00 = std::sqrt(4 * std::numbers::pi_v<float>);
    const auto leaning = [&](float radiance) {
        ProbeRecord record;
        record.light = evenLight(radiance * y00);
        record.bands[0] = 0x202020;
        return record;
    };
    d.exposure = 1;
    for (const ProbePosition& p : built->positions) {
        d.probes.base.push_back(leaning(1));
        if (p.x_m == 0 && p.y_m > 2.5f && p.y_m < 4.5f)
            d.probes.numbers.push_back(static_cast<uint32_t>(d.probes.base.size() - 1));
    }
    const auto receivers = static_cast<uint32_t>(d.probes.numbers.size());
    EXPECT_EQ(receivers, 3u);
    d.probes.clusters = {{0, receivers, 0, 1, 0, 1}};
    d.probes.terms = {{0, 0}};
    d.probes.batches = {{0, receivers}};
    d.probes.payload.assign(receivers, leaning(4));
    d.probes.record_counts = {receivers, 0};
    return d;
}

TEST(Explain, InTheAirTheProbesAround) {
    const auto pack = Pack::fromData(withProbes());
    ASSERT_TRUE(pack) << pack.error().message;
    constexpr float pi = std::numbers::pi_v<float>;
    // R11G11B10 has 6 bits: half a step is 1 / 128, once for the record, once for the blend (blue: twice that).
    constexpr float quantum = 1.0f / 64;
    for (const std::optional<glm::vec3> normal :
         {std::optional<glm::vec3>{}, std::optional(glm::vec3(0, 0.6f, 0.8f))}) {
        const auto e = explain(*pack, {0.5f, 3.25f, 0.125f}, normal, "hall=0.5");
        ASSERT_TRUE(e) << e.error().message;
        const float mean_lux = pi * (normal ? 1 + 2 * 32 / 127.0f * normal->y : 1);
        EXPECT_FALSE(e->surface);
        // Barycentric: 1/2 at (1, 3, 0), 1/4 at (0, 4, 0), 1/8 at the two others.
        ASSERT_EQ(e->probes.size(), 4u);
        float shares = 0;
        for (const ExplainedProbe& probe : e->probes) {
            const ProbePosition& p = pack->data().probes.global.positions[probe.number];
            EXPECT_NEAR(probe.share, p.x_m == 1 ? 0.5f : p.y_m == 4 ? 0.25f : 0.125f, 1e-5f);
            EXPECT_EQ(probe.receiver.cluster.has_value(), p.x_m == 0);
            shares += probe.share;
        }
        EXPECT_NEAR(shares, 1, 1e-5f);
        ASSERT_EQ(e->contributions.size(), 2u);
        const ExplainedContribution& hall = e->contributions[0];
        EXPECT_EQ(hall.records, 3u);
        EXPECT_EQ(e->contributions[1].records, 0u);
        EXPECT_EQ(e->contributions[1].full_lux, (std::array<float, 3>{}));
        EXPECT_NEAR(e->base_lux[0], mean_lux, quantum * mean_lux);
        EXPECT_NEAR(hall.full_lux[0], 0.5f * 4 * mean_lux, quantum * 2 * mean_lux);
        EXPECT_NEAR(hall.lux[0], mean_lux, quantum * mean_lux);
        EXPECT_NEAR(e->lux[0], 2 * mean_lux, 2 * quantum * mean_lux);
        EXPECT_NEAR(hall.share, 0.5, 0.01);
    }
    // A surface near by comes first, unless the grid is asked for.
    EXPECT_TRUE(explain(*pack, {4, 0.05f, 4}, {}, "")->surface);
    EXPECT_FALSE(explain(*pack, {4, 0.05f, 4}, {}, "", ExplainFrom::Grid)->surface);
    EXPECT_FALSE(explain(*pack, {4, 1.5f, 4}, {}, "", ExplainFrom::Surface));
    const auto none = explain(halvesPack(), {4, 1.5f, 4}, {}, "", ExplainFrom::Grid);
    ASSERT_FALSE(none);
    EXPECT_THAT(none.error().message, HasSubstr("grids.global=on"));
    EXPECT_THAT(explain(halvesPack(), {4, 1.5f, 4}, {}, "").error().message, HasSubstr("no global grid"));
}

}  // namespace
}  // namespace dimmer::cook
