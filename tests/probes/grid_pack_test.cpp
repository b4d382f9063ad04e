// Light grids in a pack: what is written is what is read, what is wrong is refused, and what is only absurd harms
// nobody.
#include <dimmer/probe_grid.h>
#include <format/texel.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pack/pack_file.h>
#include <pack/sample_pack.h>
#include <probes/resample.h>
#include <probes/tetrahedra.h>
#include <probes/tetrahedron_walk.h>
#include <write/pack_writer.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

namespace dimmer::test {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

// samplePack() with probes: 50 in a global grid, 12 in local ones that share the last.
PackData gridPack(uint32_t seed = 1) {
    Random random(seed);
    PackData data = samplePack(seed);
    addRandomProbes(data, random);
    std::vector<glm::vec3> points(42);
    for (auto& p : points) p = {uniform(random, 0, 4), uniform(random, 0, 3), uniform(random, 0, 4)};
    GlobalGrid& grid = data.probes.global;
    grid = cook::tetrahedralise(points, {glm::vec3(0), glm::vec3(4, 3, 4)}).value();
    for (uint8_t& level : grid.levels) level = static_cast<uint8_t>(pick(random, 0, 5));
    grid.visibility.resize(grid.tetrahedra.size());
    for (auto& v : grid.visibility)
        for (auto& probe : v.seen)
            for (int8_t& value : probe) value = static_cast<int8_t>(pick(random, 0, 255));
    data.probes.local = {{"crate", 50, {2, 3, 2}, {1, 2, 3}, {{{0.5f, 0, 0}, {0, 0.25f, 0}, {0, 0, 1}}}},
                         {"ball", 61, {1, 1, 1}, {0, 1, 0}, {}}};
    return data;
}

template <class T>
void expectSameBytes(const std::vector<T>& a, const std::vector<T>& b, const char* what) {
    ASSERT_EQ(a.size(), b.size()) << what;
    EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(T)), 0) << what;
}

TEST(GridPack, EveryFieldComesBack) {
    const PackData data = gridPack();
    const auto pack = Pack::fromBytes(cook::packBytes(data), "test");
    ASSERT_TRUE(pack) << pack.error().message;
    const ProbeData &a = data.probes, &b = pack->data().probes;
    expectSameBytes(a.base, b.base, "base");
    expectSameBytes(a.payload, b.payload, "payload");
    expectSameBytes(a.global.positions, b.global.positions, "positions");
    expectSameBytes(a.global.levels, b.global.levels, "levels");
    expectSameBytes(a.global.tetrahedra, b.global.tetrahedra, "tetrahedra");
    expectSameBytes(a.global.visibility, b.global.visibility, "visibility");
    expectSameBytes(a.global.starts, b.global.starts, "starts");
    EXPECT_EQ(std::memcmp(&a.global.start, &b.global.start, sizeof(StartGrid)), 0);
    ASSERT_EQ(b.local.size(), 2u);
    EXPECT_EQ(b.local[0].node, "crate");
    EXPECT_EQ(b.local[0].first_probe, 50u);
    EXPECT_EQ(b.local[0].counts, (std::array<uint32_t, 3>{2, 3, 2}));
    EXPECT_EQ(b.local[0].origin_m, (std::array<float, 3>{1, 2, 3}));
    EXPECT_EQ(b.local[0].step_m, a.local[0].step_m);
    EXPECT_EQ(b.local[1].first_probe, 61u);
}

TEST(GridPack, ALocalGridThatIsNotThereHasNoProbes) {
    const auto pack = Pack::fromData(gridPack());
    ASSERT_TRUE(pack);
    EXPECT_EQ(pack->localGridSlot(0).first_probe, 50u);
    EXPECT_EQ(pack->localGridSlot(0).counts, (std::array<uint32_t, 3>{2, 3, 2}));
    for (const uint32_t number : {2u, UINT32_MAX})
        EXPECT_EQ(pack->localGridSlot(number).counts, (std::array<uint32_t, 3>{0, 0, 0}));
}

struct Fault {
    const char* name;
    std::function<void(ProbeData&)> apply;
    std::string message;
};

const Fault grid_faults[] = {
    {"more places than probes", [](ProbeData& p) { p.global.positions.resize(p.base.size() + 1); }, "places and"},
    {"a level too few", [](ProbeData& p) { p.global.levels.pop_back(); }, "49 levels"},
    {"a place that is none", [](ProbeData& p) { p.global.positions[3].y_m = nan; }, "a probe stands nowhere"},
    {"a probe of no place", [](ProbeData& p) { p.global.tetrahedra[2].probes[1] = 50; }, "2 has probe 50 of 50"},
    {"no such neighbour",
     [](ProbeData& p) { p.global.tetrahedra[2].neighbours[3] = static_cast<uint32_t>(p.global.tetrahedra.size()); },
     "tetrahedron 2 has neighbour"},
    {"visibility of fewer", [](ProbeData& p) { p.global.visibility.pop_back(); }, "its visibility is of"},
    {"no such start", [](ProbeData& p) { p.global.starts[0] = static_cast<uint32_t>(p.global.tetrahedra.size()); },
     "a walk starts in"},
    {"a start too few", [](ProbeData& p) { p.global.starts.pop_back(); }, "starts of walks"},
    {"counts that overflow",
     [](ProbeData& p) {
         p.global.start.counts = {1u << 31, 1u << 31, 4};
     },
     "starts of walks"},
    {"no start", [](ProbeData& p) { p.global.starts.clear(), p.global.start.counts = {}; }, "starts of walks"},
    {"a flat box", [](ProbeData& p) { p.global.start.max_m[1] = p.global.start.min_m[1]; }, "box is flat"},
    {"a box with no room", [](ProbeData& p) { p.global.start.max_m[1] = 1e-40f, p.global.start.min_m[1] = 0; },
     "box is flat"},
    {"a box without end", [](ProbeData& p) { p.global.start.max_m[1] = 3e38f; }, "flat or without end"},
    {"a box that is none", [](ProbeData& p) { p.global.start.max_m[1] = nan; }, "box is not finite"},
    {"a local grid of nothing", [](ProbeData& p) { p.local[0].counts[1] = 0; }, "'crate' has 2 x 0 x 2"},
    {"a huge local grid", [](ProbeData& p) { p.local[0].counts[1] = 65; }, "'crate' has 2 x 65 x 2"},
    {"a local grid nowhere", [](ProbeData& p) { p.local[0].step_m[1][2] = nan; }, "'crate' is not finite"},
    {"probes of the global grid", [](ProbeData& p) { p.local[0].first_probe = 49; }, "'crate' has probes that"},
    {"probes past the end", [](ProbeData& p) { p.local[0].first_probe = static_cast<uint32_t>(p.base.size()) - 11; },
     "'crate' has probes that"},
};

TEST(GridPack, EveryRuleIsChecked) {
    ASSERT_TRUE(validate(gridPack()));
    for (const Fault& fault : grid_faults) {
        PackData data = gridPack();
        fault.apply(data.probes);
        const auto valid = validate(data);
        ASSERT_FALSE(valid) << fault.name;
        EXPECT_EQ(valid.error().code, ErrorCode::BadInput) << fault.name;
        EXPECT_THAT(valid.error().message, testing::HasSubstr(fault.message)) << fault.name;
    }
}

TEST(GridPack, AllChunksOrNone) {
    for (const std::string type : {"GPOS", "GLEV", "GTET", "GVIS", "GSTA", "GBOX", "LGRD"}) {
        PackFile file(cook::packBytes(gridPack()));
        std::erase_if(file.chunks, [&](const ChunkContent& c) { return typeName(c.type) == type; });
        const auto pack = Pack::fromBytes(file.bytes(), "test");
        ASSERT_FALSE(pack) << type;
        EXPECT_THAT(pack.error().message, testing::HasSubstr(fmt::format("chunk {} is missing", type)));
    }
}

TEST(GridPack, ACountOfLocalGridsAloneIsRefused) {
    PackFile file(cook::packBytes(gridPack()));
    ASSERT_EQ(file.chunk("LGRD").read<uint32_t>(0), 2u);
    file.chunk("LGRD").bytes.resize(4);
    const auto pack = Pack::fromBytes(file.bytes(), "test");
    ASSERT_FALSE(pack);
    EXPECT_THAT(pack.error().message, testing::HasSubstr("LGRD is malformed"));
}

// The file tells tetrahedra by each other (FaceOrder.RecordsOfNoTetrahedraAreRefused tries what that allows); who
// borders on whom is found when it is read (GridPack.EveryFieldComesBack compares that with TetGen's neighbours).
TEST(GridPack, TetrahedraThatNobodyCanJoinAreRefused) {
    const PackFile whole(cook::packBytes(gridPack()));
    const std::vector<std::function<void(ChunkContent&)>> faults = {
        [](ChunkContent& c) { c.write(0, 4u); },  // from one before the first
        [](ChunkContent& c) { c.write(4, 1u); },  // probe -1
        [](ChunkContent& c) { c.bytes.resize(c.bytes.size() - 4); },
        [](ChunkContent& c) { c.bytes.resize(c.bytes.size() + 8); },  // a corner alone
    };
    for (const auto& fault : faults) {
        PackFile file = whole;
        fault(file.chunk("GTET"));
        const auto pack = Pack::fromBytes(file.bytes(), "test");
        ASSERT_FALSE(pack);
        EXPECT_EQ(pack.error().code, ErrorCode::BadInput);
        EXPECT_THAT(pack.error().message, testing::HasSubstr("chunk GTET"));
    }
}

std::vector<uint32_t> words(const PackData& data) {
    std::vector<uint32_t> out;
    for (const ProbeRecord& probe : data.probes.base) {
        out.push_back(canonicalR11G11B10(probe.light));
        out.insert(out.end(), probe.bands.begin(), probe.bands.end());
    }
    return out;
}

// Tables that pass validate() and make no sense: neighbours at random, flat and inverted tetrahedra, a box elsewhere,
// points that are no numbers.
TEST(GridPack, NonsenseNeitherLoopsNorGivesNaN) {
    Random random(3);
    for (uint32_t seed = 1; seed <= 30; ++seed) {
        PackData data = gridPack(seed);
        GlobalGrid& grid = data.probes.global;
        const auto count = static_cast<uint32_t>(grid.tetrahedra.size());
        for (Tetrahedron& t : grid.tetrahedra) {
            for (uint32_t& probe : t.probes) probe = pick(random, 0, pick(random, 0, 49));
            for (uint32_t& neighbour : t.neighbours)
                neighbour = pick(random, 0, 9) ? pick(random, 0, count - 1) : no_tetrahedron;
        }
        for (ProbePosition& p : grid.positions)
            if (pick(random, 0, 4) == 0) p.x_m = uniform(random, -1, 1) * 3e38f;
        for (uint32_t& start : grid.starts) start = pick(random, 0, count - 1);
        const auto pack = Pack::fromData(data);
        ASSERT_TRUE(pack) << pack.error().message;
        const auto probes = words(data);
        const GridSampler sampler(*pack, probes);
        for (const float x : {0.5f, -3e38f, nan, std::numeric_limits<float>::infinity()})
            for (uint32_t hint : {no_tetrahedron, 0u, count - 1, count, 0xfffffffeu}) {
                GridHint walk{hint};
                for (const float e : sampler.sample({x, 1, 2}, {0, 1, 0}, &walk)) EXPECT_TRUE(std::isfinite(e));
                EXPECT_LT(walk.tetrahedron, count);
                uint32_t from = hint;
                resampleProbe(data, probes, {x, 1, 2}, from);
                EXPECT_EQ(from, walk.tetrahedron);
            }
    }
}

TEST(GridPack, WithoutAGridAllIsBlack) {
    const auto pack = Pack::fromData(samplePack());
    ASSERT_TRUE(pack);
    const GridSampler sampler(*pack, {});
    EXPECT_TRUE(sampler.empty());
    EXPECT_EQ(sampler.sample({0, 0, 0}, {0, 1, 0}), (std::array<float, 3>{0, 0, 0}));
}

}  // namespace
}  // namespace dimmer::test
