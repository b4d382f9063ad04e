// A pack in memory: what the reader has validated and the executors use. Arrays, no pointers between them.
#pragma once

#include <dimmer/pack.h>
#include <pack/grid_data.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace dimmer {

// A stored lightmap texel, 8 bytes; see runtime/format/texel.h.
struct TexelRecord {
    uint32_t irradiance = 0;  // in the pack's ColorFormat
    uint32_t direction = 0;   // A2B10G10R10_UNORM_PACK32
    bool operator==(const TexelRecord&) const = default;
};
static_assert(sizeof(TexelRecord) == 8);

// A stored light probe; see runtime/format/probe.h.
struct ProbeRecord {
    uint32_t light = 0;                  // band 0, in the pack's ColorFormat
    std::array<uint32_t, 6> bands = {};  // bands 1 and 2, 24 signed bytes
    bool operator==(const ProbeRecord&) const = default;
};
static_assert(sizeof(ProbeRecord) == 28);

// One contribution of a cluster and where its records are.
struct ClusterTerm {
    uint32_t contribution = 0;
    uint32_t first_record = 0;  // into payload, one record per receiver of the cluster, in its order
};

// Receivers with the same list of contributions; some of their records may be without light.
struct Cluster {
    uint32_t first_receiver = 0, receiver_count = 0;
    uint32_t first_batch = 0, batch_count = 0;
    uint32_t first_term = 0, term_count = 0;  // terms ascend by contribution
};

// Up to 64 consecutive receivers of one cluster: what kernels take as one item.
struct Batch {
    uint32_t first_receiver = 0, receiver_count = 0;
};

inline constexpr uint32_t batch_receivers_max = 64;

// Where a receiver lives: x and y within a page of at most 4096 x 4096, up to 256 pages.
struct TexelAddress {
    static constexpr uint32_t pack(uint32_t page, uint32_t x, uint32_t y) { return page << 24 | y << 12 | x; }
    static constexpr uint32_t page(uint32_t address) { return address >> 24; }
    static constexpr uint32_t x(uint32_t address) { return address & 0xfff; }
    static constexpr uint32_t y(uint32_t address) { return address >> 12 & 0xfff; }
};
inline constexpr uint32_t page_side_max = 4096;
inline constexpr uint32_t page_count_max = 256;

// What planning needs to know of receivers of one kind.
struct ReceiverView {
    std::span<const Cluster> clusters;
    std::span<const ClusterTerm> terms;
    std::span<const Batch> batches;
    uint32_t record_bytes = 0, place_bytes = 0;  // that kernels move per receiver
};

// The light probes of a level: receivers like texels, with clusters of their own.
struct ProbeData {
    std::vector<ProbeRecord> base;  // by the probe's number
    std::vector<Cluster> clusters;  // as in PackData, as are the next two
    std::vector<ClusterTerm> terms;
    std::vector<Batch> batches;
    std::vector<uint32_t> numbers;        // per receiver, the probe that it is
    std::vector<uint32_t> record_counts;  // per contribution; empty where there are no receivers
    std::vector<ProbeRecord> payload;     // contribution-major
    GlobalGrid global;                    // of the first probes
    std::vector<LocalGrid> local;         // of the others
    ReceiverView view() const { return {clusters, terms, batches, sizeof(ProbeRecord), sizeof(uint32_t)}; }
};

struct PackData {
    float exposure = 1;
    ColorFormat color_format = ColorFormat::R11G11B10F;
    DirectionModel direction_model = DirectionModel::Ahd;
    uint32_t page_width = 0, page_height = 0, page_count = 0;
    std::vector<Element> elements;            // light sets first, then doors
    std::vector<Contribution> contributions;  // without the base
    std::vector<TexelRecord> base_pages;      // page_count * page_height * page_width
    std::vector<Cluster> clusters;            // in order of first_receiver; they tile the receivers
    std::vector<ClusterTerm> terms;
    std::vector<Batch> batches;        // in order of first_receiver; they tile the receivers
    std::vector<uint32_t> addresses;   // TexelAddress per receiver
    std::vector<TexelRecord> payload;  // contribution-major: all records of contribution 0, then 1, ...
    ProbeData probes;
    std::vector<Mesh> meshes;
    std::vector<Viewpoint> viewpoints;
    std::vector<ModelMesh> model_meshes;
    std::vector<PlacedModel> models;
    std::string settings_json;  // every resolved setting of the cook and where it came from

    // Texels' places are those in their batch, a byte each.
    ReceiverView texelView() const { return {clusters, terms, batches, sizeof(TexelRecord), 1}; }
};

// Of base_pages, and of pages like them.
inline size_t texelIndex(const PackData& data, uint32_t address) {
    return (size_t{TexelAddress::page(address)} * data.page_height + TexelAddress::y(address)) * data.page_width +
           TexelAddress::x(address);
}

// Checks everything that an executor relies on: every index in range, clusters and batches tile the receivers,
// addresses inside the pages and unique, finite floats. Linear in the size of the data.
Expected<void> validate(const PackData& data);
// Its first check alone, for who is about to make pages: how many there are and how large, by the numbers that say so.
Expected<void> validatePageSizes(const PackData& data);

}  // namespace dimmer
