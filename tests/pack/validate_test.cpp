// Every rule of validate() broken on its own; nothing else of the pack is wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pack/sample_pack.h>

#include <functional>
#include <limits>

namespace dimmer::test {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
constexpr uint32_t first_door = 4;  // samplePack() has sets 0..3 and doors 4, 5

struct Fault {
    const char* name;
    std::function<void(PackData&)> apply;
    std::string message;
};

// A cluster with at least so many receivers, terms and batches, not the last one.
size_t clusterWith(const PackData& d, uint32_t receivers, uint32_t terms, uint32_t batches = 1) {
    for (size_t i = 0; i + 1 < d.clusters.size(); ++i)
        if (d.clusters[i].receiver_count >= receivers && d.clusters[i].term_count >= terms &&
            d.clusters[i].batch_count >= batches)
            return i;
    ADD_FAILURE() << "no cluster of " << receivers << " receivers and " << terms << " terms";
    return 0;
}

const Fault page_faults[] = {
    {"no page", [](PackData& d) { d.page_count = 0, d.base_pages.clear(); }, "0 pages"},
    {"257 pages", [](PackData& d) { d.page_count = 257, d.base_pages.resize(257 * 32 * 32); }, "257 pages"},
    {"no width", [](PackData& d) { d.page_width = 0, d.base_pages.clear(); }, "pages of 0 x 32"},
    {"too wide", [](PackData& d) { d.page_width = 4097, d.base_pages.resize(2 * 32 * 4097); }, "pages of 4097 x 32"},
    {"no height", [](PackData& d) { d.page_height = 0, d.base_pages.clear(); }, "pages of 32 x 0"},
    {"too high", [](PackData& d) { d.page_height = 4097, d.base_pages.resize(2 * 32 * 4097); }, "pages of 32 x 4097"},
    {"a texel too few", [](PackData& d) { d.base_pages.pop_back(); }, "its base holds 2047 texels, its pages 2048"},
    {"a texel too many", [](PackData& d) { d.base_pages.push_back({}); }, "its base holds 2049 texels"},
    {"exposure NaN", [](PackData& d) { d.exposure = nan; }, "exposure"},
    {"exposure infinite", [](PackData& d) { d.exposure = infinity; }, "exposure"},
    {"exposure 0", [](PackData& d) { d.exposure = 0; }, "exposure is 0"},
    {"exposure tiny", [](PackData& d) { d.exposure = 2.9e-41f; }, "exposure"},
    {"exposure huge", [](PackData& d) { d.exposure = 1e30f; }, "exposure"},
    {"exposure negative", [](PackData& d) { d.exposure = -1; }, "exposure is -1"},
};

const Fault element_faults[] = {
    {"unknown kind", [](PackData& d) { d.elements[5].kind = static_cast<ElementKind>(2); }, "element 'door1' is of an"},
    {"set behind a door",
     [](PackData& d) {
         d.elements.push_back({"late", ElementKind::LightSet, 1});
     },
     "light set 'late' stands behind a door"},
    {"empty name", [](PackData& d) { d.elements[2].name.clear(); }, "'' is empty or used twice"},
    {"a set's name twice", [](PackData& d) { d.elements[2].name = "set0"; }, "'set0' is empty or used twice"},
    {"a door's name twice", [](PackData& d) { d.elements[5].name = "door0"; }, "'door0' is empty or used twice"},
    {"weight NaN", [](PackData& d) { d.elements[1].max_weight = nan; }, "element 'set1' has a largest weight"},
    {"weight infinite", [](PackData& d) { d.elements[1].max_weight = infinity; }, "element 'set1'"},
    {"weight beyond all", [](PackData& d) { d.elements[1].max_weight = 1.01e8f; }, "a largest weight of 101000000"},
    {"weight 0", [](PackData& d) { d.elements[1].max_weight = 0; }, "element 'set1' has a largest weight of 0"},
    {"weight negative", [](PackData& d) { d.elements[1].max_weight = -2; }, "element 'set1'"},
};

const Fault contribution_faults[] = {
    {"no such set", [](PackData& d) { d.contributions[2].light_set = 6; }, "contribution 2 has no such set"},
    {"a door as set", [](PackData& d) { d.contributions[2].light_set = first_door; }, "contribution 2 has no such set"},
    {"no such door", [](PackData& d) { d.contributions[2].doors_open = {6}; }, "contribution 2 has no such door"},
    {"a set as open door", [](PackData& d) { d.contributions[2].doors_open = {0}; }, "contribution 2 has no such door"},
    {"a set as closed door",
     [](PackData& d) {
         d.contributions[2].doors_closed = {4, 0};
     },
     "contribution 2 has no such door"},
    {"energy NaN", [](PackData& d) { d.contributions[3].energy_dropped = nan; }, "contribution 3 dropped nan"},
    {"a record too few", [](PackData& d) { d.payload.pop_back(); }, "records, its payload holds"},
    {"a record too many", [](PackData& d) { d.payload.push_back({}); }, "records, its payload holds"},
};

const Fault cluster_faults[] = {
    {"another first receiver", [](PackData& d) { ++d.clusters[1].first_receiver; }, "cluster 1 does not follow"},
    {"another first batch", [](PackData& d) { ++d.clusters[1].first_batch; }, "cluster 1 does not follow"},
    {"another first term", [](PackData& d) { ++d.clusters[1].first_term; }, "cluster 1 does not follow"},
    {"an empty cluster",
     [](PackData& d) {
         const Cluster& last = d.clusters.back();
         d.clusters.push_back({last.first_receiver + last.receiver_count, 0, last.first_batch + last.batch_count, 0,
                               last.first_term + last.term_count, 0});
     },
     "cluster 12 does not follow"},
    {"too many receivers", [](PackData& d) { ++d.clusters.back().receiver_count; }, "cluster 11 reaches past"},
    {"too many batches", [](PackData& d) { ++d.clusters.back().batch_count; }, "cluster 11 reaches past"},
    {"too many terms", [](PackData& d) { ++d.clusters.back().term_count; }, "cluster 11 reaches past"},
    {"counts that overflow 32 bits", [](PackData& d) { d.clusters[1].receiver_count = UINT32_MAX; },
     "cluster 1 reaches past"},
    {"a batch that starts elsewhere",
     [](PackData& d) { ++d.batches[d.clusters[clusterWith(d, 65, 1, 2)].first_batch + 1].first_receiver; },
     "does not follow the one before it"},
    {"an empty batch",
     [](PackData& d) { d.batches[d.clusters[clusterWith(d, 65, 1, 2)].first_batch].receiver_count = 0; },
     "does not follow the one before it"},
    {"a batch of 65",
     [](PackData& d) { d.batches[d.clusters[clusterWith(d, 66, 1, 2)].first_batch].receiver_count = 65; },
     "does not follow the one before it"},
    {"batches that stop early",
     [](PackData& d) {
         const Cluster& c = d.clusters[clusterWith(d, 2, 1)];
         --d.batches[c.first_batch + c.batch_count - 1].receiver_count;
     },
     "do not cover it"},
    {"an address of nobody", [](PackData& d) { d.addresses.push_back(0); }, "do not cover its tables"},
    {"a batch of nobody",
     [](PackData& d) {
         d.batches.push_back({0, 1});
     },
     "do not cover its tables"},
    {"a term of nobody",
     [](PackData& d) {
         d.terms.push_back({0, 0});
     },
     "do not cover its tables"},
};

const Fault term_faults[] = {
    {"no such contribution",
     [](PackData& d) { d.terms.back().contribution = static_cast<uint32_t>(d.contributions.size()); },
     "names contribution"},
    {"terms out of order",
     [](PackData& d) {
         const Cluster& c = d.clusters[clusterWith(d, 1, 2)];
         std::swap(d.terms[c.first_term], d.terms[c.first_term + 1]);
     },
     "out of order"},
    {"a contribution twice",
     [](PackData& d) {
         const Cluster& c = d.clusters[clusterWith(d, 1, 2)];
         d.terms[c.first_term + 1] = d.terms[c.first_term];
     },
     "out of order"},
    {"records of another place", [](PackData& d) { ++d.terms.back().first_record; },
     "cluster 11 misplaces its records"},
    {"fewer records than its clusters use",
     [](PackData& d) { --d.contributions.back().receivers, d.payload.pop_back(); }, "reads past contribution"},
    {"records that no cluster uses", [](PackData& d) { ++d.contributions.back().receivers, d.payload.push_back({}); },
     "belong to no cluster"},
};

const Fault address_faults[] = {
    {"no such page", [](PackData& d) { d.addresses[5] = TexelAddress::pack(2, 0, 0); },
     "outside the pages, at page 2 (0, 0)"},
    {"right of its page", [](PackData& d) { d.addresses[5] = TexelAddress::pack(1, 32, 0); },
     "outside the pages, at page 1 (32"},
    {"below its page", [](PackData& d) { d.addresses[5] = TexelAddress::pack(1, 0, 32); },
     "outside the pages, at page 1 (0, 32)"},
    {"one texel twice", [](PackData& d) { d.addresses[5] = d.addresses[77]; }, "two receivers share the texel"},
    {"batches all over their page",
     [](PackData& d) {
         std::ranges::sort(d.addresses, {}, [](uint32_t a) { return std::pair(TexelAddress::x(a) % 8, a); });
     },
     "in more than 4 tiles, or"},
    {"a batch on two pages",
     [](PackData& d) { d.addresses[d.clusters[clusterWith(d, 65, 1, 2)].first_receiver + 1] ^= 1u << 24; },
     "lies on two pages,"},
    {"an odd batch within its cluster",
     [](PackData& d) {
         size_t b = 0;  // a full one, followed by one with room, of the same cluster
         while (d.batches[b].receiver_count < 64 || d.batches[b + 1].receiver_count == 64) ++b;
         --d.batches[b].receiver_count;
         --d.batches[b + 1].first_receiver;
         ++d.batches[b + 1].receiver_count;
     },
     "an odd number of receivers"},
};

const Fault mesh_faults[] = {
    {"no such page", [](PackData& d) { d.meshes[1].page = 2; }, "mesh 'leaf' lies on page 2"},
    {"no such door", [](PackData& d) { d.meshes[1].door = 6; }, "mesh 'leaf' belongs to no such element"},
    {"a set as door", [](PackData& d) { d.meshes[1].door = 0; }, "mesh 'leaf' belongs to no such element"},
    {"no such set", [](PackData& d) { d.meshes[1].emission_set = 6; }, "mesh 'leaf' belongs to no such element"},
    {"a door as set", [](PackData& d) { d.meshes[1].emission_set = first_door; }, "mesh 'leaf' belongs to no such"},
    {"a corner too few", [](PackData& d) { d.meshes[0].indices.pop_back(); }, "mesh 'floor' has a broken triangle"},
    {"no such vertex", [](PackData& d) { d.meshes[0].indices[4] = 4; }, "mesh 'floor' has an index past"},
    {"reflectance", [](PackData& d) { d.meshes[0].reflectance[1] = nan; }, "mesh 'floor' has no finite colour"},
    {"emission", [](PackData& d) { d.meshes[0].emission_cd_m2[2] = infinity; }, "mesh 'floor' has no finite colour"},
    {"position", [](PackData& d) { d.meshes[0].vertices[3].position_m[0] = infinity; }, "'floor' has a vertex"},
    {"normal", [](PackData& d) { d.meshes[0].vertices[3].normal[2] = nan; }, "'floor' has a vertex"},
    {"lightmap UV", [](PackData& d) { d.meshes[0].vertices[3].lightmap_uv[1] = nan; }, "'floor' has a vertex"},
    {"viewpoint's place", [](PackData& d) { d.viewpoints[1].position_m[0] = nan; }, "viewpoint 'camera'"},
    {"viewpoint's direction", [](PackData& d) { d.viewpoints[1].forward[0] = nan; }, "viewpoint 'camera'"},
    {"viewpoint's angle", [](PackData& d) { d.viewpoints[1].vertical_fov_rad = infinity; }, "viewpoint 'camera'"},
};

void expectFaults(std::span<const Fault> faults) {
    for (const Fault& fault : faults) {
        PackData data = samplePack();
        ASSERT_TRUE(validate(data).has_value()) << validate(data).error().message;
        fault.apply(data);
        const auto result = validate(data);
        ASSERT_FALSE(result.has_value()) << fault.name;
        EXPECT_EQ(result.error().code, ErrorCode::BadInput) << fault.name;
        EXPECT_THAT(result.error().message, testing::HasSubstr(fault.message)) << fault.name;
        // Generators come in through this door.
        EXPECT_FALSE(Pack::fromData(std::move(data)).has_value()) << fault.name;
    }
}

TEST(PackValidate, Pages) {
    expectFaults(page_faults);
}
TEST(PackValidate, Elements) {
    expectFaults(element_faults);
}
TEST(PackValidate, Contributions) {
    expectFaults(contribution_faults);
}
TEST(PackValidate, Clusters) {
    expectFaults(cluster_faults);
}
TEST(PackValidate, Terms) {
    expectFaults(term_faults);
}
TEST(PackValidate, Addresses) {
    expectFaults(address_faults);
}
TEST(PackValidate, MeshesAndViewpoints) {
    expectFaults(mesh_faults);
}

TEST(PackValidate, WhatIsUnusualButSound) {
    PackData data = samplePack();
    data.elements[first_door].name = "set0";  // sets and doors have name spaces of their own
    EXPECT_TRUE(validate(data).has_value());
    data.meshes.push_back({});  // a mesh without triangles
    EXPECT_TRUE(validate(data).has_value());
    data.contributions.push_back({.light_set = 0, .doors_open = {}, .doors_closed = {}});  // a set that reaches nothing
    EXPECT_TRUE(validate(data).has_value());
    // A whole cluster in batches of two: more than need be, and right.
    PackData thin = emptyPack(2, 0);
    thin.page_count = 1, thin.page_width = 16, thin.page_height = 16;
    Random random(1);
    fillPack(thin, std::vector<ClusterPlan>{{{0, 1}, 20}}, random, 2);
    EXPECT_TRUE(validate(thin).has_value());
}

}  // namespace
}  // namespace dimmer::test
