// A pack with a global light grid whose light is known, for tests of moving models.
#pragma once

#include <format/texel.h>
#include <probes/tetrahedra.h>

#include "random_pack.h"

namespace dimmer::test {

inline constexpr glm::vec3 model_room_m = {12, 4, 12};

// `position` -> even light from everywhere, the coefficient of Y_00 as stored, per channel.
template <class Light>
PackData modelPack(uint32_t seed, uint32_t probe_count, Light&& light) {
    Random random(seed);
    PackData data = emptyPack(3, 0);
    data.contributions.resize(3);
    data.color_format = ColorFormat::E5B9G9R9;
    data.page_count = 1;
    data.page_width = data.page_height = 16;
    const ClusterPlan texels[] = {{{0}, 8}};
    fillPack(data, texels, random);
    std::vector<glm::vec3> points(probe_count);
    for (auto& p : points)
        p = {uniform(random, 0, model_room_m.x), uniform(random, 0, model_room_m.y),
             uniform(random, 0, model_room_m.z)};
    ProbeData& probes = data.probes;
    probes.global = cook::tetrahedralise(points, {glm::vec3(0), model_room_m}).value();
    for (const ProbePosition& p : probes.global.positions) {
        const glm::vec3 value = light(glm::vec3(p.x_m, p.y_m, p.z_m));
        probes.base.push_back({.light = encodeE5B9G9R9(value.x, value.y, value.z), .bands = {}});
    }
    probes.record_counts.assign(data.contributions.size(), 0);
    return data;
}

// Set `set` adds `light` at the global probes for which `lit` holds.
template <class Lit>
void addLightOnProbes(PackData& data, uint32_t set, uint32_t light, Lit&& lit) {
    ProbeData& probes = data.probes;
    Cluster cluster{.first_receiver = static_cast<uint32_t>(probes.numbers.size()),
                    .receiver_count = 0,
                    .first_batch = static_cast<uint32_t>(probes.batches.size()),
                    .batch_count = 0,
                    .first_term = static_cast<uint32_t>(probes.terms.size()),
                    .term_count = 1};
    for (uint32_t i = 0; i < probes.global.positions.size(); ++i) {
        const ProbePosition& p = probes.global.positions[i];
        if (lit(glm::vec3(p.x_m, p.y_m, p.z_m))) probes.numbers.push_back(i);
    }
    cluster.receiver_count = static_cast<uint32_t>(probes.numbers.size()) - cluster.first_receiver;
    for (uint32_t done = 0; done < cluster.receiver_count; done += batch_receivers_max, ++cluster.batch_count)
        probes.batches.push_back(
            {cluster.first_receiver + done, std::min(batch_receivers_max, cluster.receiver_count - done)});
    probes.terms.push_back({set, static_cast<uint32_t>(probes.payload.size())});
    probes.record_counts[set] = cluster.receiver_count;
    probes.payload.resize(probes.payload.size() + cluster.receiver_count, {.light = light, .bands = {}});
    probes.clusters.push_back(cluster);
}

}  // namespace dimmer::test
