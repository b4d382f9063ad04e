// Clusters and batches, recomputed from what the bake found.
#include <bake/bake.h>
#include <charts/texels.h>
#include <charts/unwrap.h>
#include <cluster/cluster.h>
#include <encode/encode.h>
#include <format/texel.h>
#include <gmock/gmock.h>
#include <pipeline/small_level.h>

#include <map>
#include <set>
#include <tuple>

namespace dimmer::cook::test {
namespace {

struct Stored {
    Texels texels;
    Baked baked;
    PackData pack;
};

// A room with lamps of three sets, one behind a screen, so that overlaps differ; and always-on light.
LevelFile level() {
    LevelFile level = twoCells();
    const int mesh = level.addSquareMesh(addWhite(level, {{"doubleSided", true}}));
    level.addNode({{"name", "screen"}, {"mesh", mesh}, {"translation", {1, 1, 1}}, {"scale", {1.5, 1.5, 1}}});
    const int lamp = level.addLight("always", {{"type", "point"}, {"intensity", 20}}, {{"dimmer_bake", "full"}});
    level.node(lamp)["translation"] = {1.5, 1.5, 1.5};
    return level;
}

Stored store() {
    Stored s;
    const auto scene = level().import();
    EXPECT_TRUE(scene) << scene.error().message;
    const RayScene rays(*scene);
    const auto charts = unwrap(rays, {.texels_per_metre = 6, .page_size = 64});
    EXPECT_TRUE(charts) << charts.error().message;
    s.texels = sampleTexels(rays, *charts, 2);
    SilentProgress silent;
    BakeSettings settings{.series_rays = 8, .final_rays = 16, .emitter_samples = 2, .bounces_max = 8};
    settings.threshold = 0.3f;  // high: sets end somewhere within the room
    s.baked = bake(rays, *charts, s.texels, settings, silent);
    s.pack.page_width = charts->page_width;
    s.pack.page_height = charts->page_height;
    s.pack.page_count = charts->page_count;
    s.pack.exposure = 4;
    for (uint32_t i = 0; i < scene->light_sets.size(); ++i)
        s.pack.contributions.push_back({.light_set = i, .doors_open = {}, .doors_closed = {}});
    for (const SceneLightSet& set : scene->light_sets) s.pack.elements.push_back({set.name, ElementKind::LightSet, 1});
    std::vector<uint32_t> contribution_of_term{no_index};
    for (uint32_t i = 0; i < s.pack.contributions.size(); ++i) contribution_of_term.push_back(i);
    buildClusters(s.texels, s.baked, contribution_of_term, 0, s.pack);
    return s;
}

class Clusters : public testing::Test {
   protected:
    static void SetUpTestSuite() { stored_ = new Stored(store()); }
    static void TearDownTestSuite() { delete stored_; }
    const Stored& stored() const { return *stored_; }
    const PackData& pack() const { return stored_->pack; }

    std::vector<uint32_t> listOf(const Cluster& cluster) const {
        std::vector<uint32_t> list;
        for (uint32_t t = 0; t < cluster.term_count; ++t)
            list.push_back(pack().terms[cluster.first_term + t].contribution);
        return list;
    }

   private:
    static inline Stored* stored_ = nullptr;
};

TEST_F(Clusters, AreValidAndVaried) {
    const auto valid = validate(pack());
    ASSERT_TRUE(valid.has_value()) << valid.error().message;
    EXPECT_GE(pack().clusters.size(), 4u);
    EXPECT_GT(pack().batches.size(), pack().clusters.size());
}

// Every (texel, contribution) that the bake kept is stored once, with its light; all else that is stored has none.
TEST_F(Clusters, HoldWhatTheBakeKept) {
    std::map<std::pair<uint32_t, uint32_t>, glm::vec3> kept;  // address, contribution -> lux
    auto keep = [&](uint32_t address, uint32_t receiver) {
        for (const ReceiverLight& l : stored().baked.light.row(receiver))
            if (l.term != always_group) kept[{address, l.term - 1}] = l.light.irradiance_lux;
    };
    for (uint32_t i = 0; i < stored().texels.size(); ++i) keep(stored().texels.address[i], i);
    for (const FillTexel& fill : stored().texels.fills) keep(fill.address, fill.source);

    size_t found = 0, padding = 0;
    for (const Cluster& cluster : pack().clusters)
        for (uint32_t t = 0; t < cluster.term_count; ++t) {
            const ClusterTerm& term = pack().terms[cluster.first_term + t];
            for (uint32_t i = 0; i < cluster.receiver_count; ++i) {
                const auto it = kept.find({pack().addresses[cluster.first_receiver + i], term.contribution});
                if (it == kept.end()) {
                    EXPECT_EQ(pack().payload[term.first_record + i].irradiance, 0u);
                    ++padding;
                    continue;
                }
                ++found;
                const auto stored = decodeR11G11B10(pack().payload[term.first_record + i].irradiance);
                // Rounded to nearest: half a step of 1/64 (red, green) or 1/32 (blue) of the value; 0 below 2^-14.
                for (int c = 0; c < 3; ++c)
                    EXPECT_NEAR(stored[static_cast<size_t>(c)], it->second[c] * pack().exposure,
                                it->second[c] * pack().exposure / (c == 2 ? 64 : 128) + 0x1p-14f);
            }
        }
    EXPECT_EQ(found, kept.size());
    EXPECT_EQ(found + padding, pack().payload.size());
    EXPECT_GT(found, 1000u);
}

TEST_F(Clusters, EachListOncePerPageAndAscending) {
    std::set<std::pair<std::vector<uint32_t>, uint32_t>> lists;
    for (const Cluster& cluster : pack().clusters) {
        const auto list = listOf(cluster);
        EXPECT_FALSE(list.empty());
        EXPECT_TRUE(std::ranges::is_sorted(list));
        const uint32_t page = TexelAddress::page(pack().addresses[cluster.first_receiver]);
        EXPECT_TRUE(lists.insert({list, page}).second) << "two clusters share their contributions";
    }
}

// Another pair of receivers would be more than 64, or touch a fifth tile; the last batch has what is left.
TEST_F(Clusters, BatchesHoldAsMuchAsFourTilesAllow) {
    uint32_t full = 0;
    for (const Cluster& cluster : pack().clusters)
        for (uint32_t b = 0; b + 1 < cluster.batch_count; ++b) {
            const Batch& batch = pack().batches[cluster.first_batch + b];
            EXPECT_EQ(batch.receiver_count % 2, 0u);
            std::set<std::pair<uint32_t, uint32_t>> tiles;
            auto add = [&](uint32_t i) {
                const uint32_t address = pack().addresses[batch.first_receiver + i];
                tiles.emplace(TexelAddress::x(address) / 8, TexelAddress::y(address) / 8);
            };
            for (uint32_t i = 0; i < batch.receiver_count; ++i) add(i);
            EXPECT_LE(tiles.size(), 4u);
            add(batch.receiver_count), add(batch.receiver_count + 1);
            EXPECT_TRUE(batch.receiver_count == 64 || tiles.size() > 4) << batch.receiver_count;
            full += batch.receiver_count == 64;
        }
    EXPECT_GT(full, 10u);
}

TEST_F(Clusters, ReceiversFollowTheTilesOfTheirPage) {
    auto place = [](uint32_t a) {
        const uint32_t x = TexelAddress::x(a), y = TexelAddress::y(a);
        return std::tuple(TexelAddress::page(a), y / 8, x / 8, y % 8, x % 8);
    };
    // Clusters by number of contributions, then in page order.
    uint32_t previous_first = 0, previous_terms = 0;
    for (size_t i = 0; i < pack().clusters.size(); ++i) {
        const Cluster& c = pack().clusters[i];
        for (uint32_t r = c.first_receiver + 1; r < c.first_receiver + c.receiver_count; ++r)
            ASSERT_LT(place(pack().addresses[r - 1]), place(pack().addresses[r]));
        const uint32_t first = pack().addresses[c.first_receiver];
        ASSERT_TRUE(i == 0 || std::pair(previous_terms, place(previous_first)) < std::pair(c.term_count, place(first)))
            << "clusters are out of order";
        previous_first = first;
        previous_terms = c.term_count;
    }
}

// The base is stored in the page itself; where there is none, black.
TEST_F(Clusters, BasePagesHoldTheAlwaysOnLight) {
    std::map<uint32_t, glm::vec3> base;
    auto keep = [&](uint32_t address, uint32_t receiver) {
        for (const ReceiverLight& l : stored().baked.light.row(receiver))
            if (l.term == always_group) base[address] = l.light.irradiance_lux;
    };
    for (uint32_t i = 0; i < stored().texels.size(); ++i) keep(stored().texels.address[i], i);
    for (const FillTexel& fill : stored().texels.fills) keep(fill.address, fill.source);
    ASSERT_GT(base.size(), 100u);
    size_t i = 0;
    for (uint32_t page = 0; page < pack().page_count; ++page)
        for (uint32_t y = 0; y < pack().page_height; ++y)
            for (uint32_t x = 0; x < pack().page_width; ++x, ++i) {
                const auto it = base.find(TexelAddress::pack(page, x, y));
                const float lux = it == base.end() ? 0 : it->second.x;
                EXPECT_NEAR(decodeR11G11B10(pack().base_pages[i].irradiance)[0], lux * pack().exposure,
                            lux * pack().exposure / 128 + 0x1p-14f);
            }
}

}  // namespace
}  // namespace dimmer::cook::test
