#include <pipeline/explain.h>

#include <dimmer/cpu_runtime.h>
#include <format/texel.h>
#include <pipeline/sample_points.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace dimmer::cook {
namespace {

// The nearest surface; without a normal, whichever way it faces.
std::optional<SurfacePlace> nearest(const NearestSurface& surfaces, glm::vec3 point, std::optional<glm::vec3> normal,
                                    float radius_m) {
    if (normal) return surfaces.find(point, *normal, radius_m);
    std::optional<SurfacePlace> best;
    // Every surface faces one of these within 90 degrees; floors first, where two lie back to back.
    for (const glm::vec3 side : {glm::vec3(0, 1, 0), glm::vec3(0, -1, 0), glm::vec3(1, 0, 0), glm::vec3(-1, 0, 0),
                                 glm::vec3(0, 0, 1), glm::vec3(0, 0, -1)}) {
        const auto found = surfaces.find(point, side, radius_m);
        if (found && (!best || found->distance_m < best->distance_m)) best = found;
    }
    return best;
}

Error nothingNear(const NearestSurface& surfaces, glm::vec3 point, std::optional<glm::vec3> normal) {
    const auto far = nearest(surfaces, point, normal, std::numeric_limits<float>::infinity());
    return {ErrorCode::NotFound,
            fmt::format("there is no lightmapped surface within {:.0f} cm of {},{},{}{}; {}",
                        100.0 * static_cast<double>(surface_reach_m), point.x, point.y, point.z,
                        normal ? " that faces along the normal" : "",
                        far ? fmt::format("the nearest is {:.2f} m away", far->distance_m) : "there is none at all")};
}

Weight weightOf(const LightState& state, const Contribution& contribution) {
    Weight weight = contribution.light_set ? state.weight(LightSet{*contribution.light_set}) : Weight(1);
    float doors = 1;
    for (const uint32_t door : contribution.doors_open) doors *= state.open(Door{door});
    for (const uint32_t door : contribution.doors_closed) doors *= 1 - state.open(Door{door});
    return {weight.r * doors, weight.g * doors, weight.b * doors};
}

// Single texels of otherwise black pages, looked up just as whole pages are.
class ScratchPages {
   public:
    explicit ScratchPages(const Pack& pack)
        : pack_(pack),
          irradiance_(pack.data().base_pages.size(), 0),
          direction_(pack.data().base_pages.size(), direction_none) {}

    void put(size_t texel, TexelRecord record) {
        irradiance_[texel] = record.irradiance;
        direction_[texel] = record.direction;
        used_.push_back(texel);
    }
    std::array<float, 3> sampleAndClear(uint32_t page, std::array<float, 2> uv, std::array<float, 3> normal) {
        const auto lux = sampleLightmap(pack_, irradiance_, direction_, page, uv, normal);
        for (const size_t texel : used_) {
            irradiance_[texel] = 0;
            direction_[texel] = direction_none;
        }
        used_.clear();
        return lux;
    }

   private:
    const Pack& pack_;
    std::vector<uint32_t> irradiance_, direction_;
    std::vector<size_t> used_;
};

// A texel that the filter may read, and the receiver that it is.
struct NearTexel {
    size_t texel;
    std::optional<uint32_t> receiver, cluster;
};

size_t texelOf(const PackData& d, uint32_t address) {
    return (size_t{TexelAddress::page(address)} * d.page_height + TexelAddress::y(address)) * d.page_width +
           TexelAddress::x(address);
}

// All texels within one step of the place: more than bilinear filtering reads.
std::vector<NearTexel> texelsAround(const PackData& d, uint32_t page, std::array<uint32_t, 2> centre) {
    std::vector<NearTexel> near;
    for (uint32_t y = std::max(centre[1], 1u) - 1; y <= std::min(centre[1] + 1, d.page_height - 1); ++y)
        for (uint32_t x = std::max(centre[0], 1u) - 1; x <= std::min(centre[0] + 1, d.page_width - 1); ++x)
            near.push_back({texelOf(d, TexelAddress::pack(page, x, y)), {}, {}});
    for (uint32_t r = 0; r < d.addresses.size(); ++r) {
        const size_t texel = texelOf(d, d.addresses[r]);
        const auto found = std::ranges::find(near, texel, &NearTexel::texel);
        if (found == near.end()) continue;
        const auto after = std::ranges::upper_bound(d.clusters, r, {}, &Cluster::first_receiver);
        found->receiver = r;
        found->cluster = static_cast<uint32_t>(after - d.clusters.begin() - 1);
    }
    return near;
}

std::optional<TexelRecord> recordAt(const PackData& d, const NearTexel& texel, uint32_t contribution) {
    if (!texel.receiver) return std::nullopt;
    const Cluster& cluster = d.clusters[*texel.cluster];
    for (uint32_t t = cluster.first_term; t < cluster.first_term + cluster.term_count; ++t)
        if (d.terms[t].contribution == contribution)
            return d.payload[d.terms[t].first_record + (*texel.receiver - cluster.first_receiver)];
    return std::nullopt;
}

uint32_t texelCoordinate(float uv, uint32_t size) {
    return std::min(static_cast<uint32_t>(std::max(0.0f, uv) * static_cast<float>(size)), size - 1);
}

double luminanceOf(const std::array<float, 3>& lux) {
    return static_cast<double>(dimmer::luminance(lux[0], lux[1], lux[2]));
}

void fillShares(Explanation& e) {
    double sum = luminanceOf(e.base_lux);
    for (const ExplainedContribution& c : e.contributions) sum += luminanceOf(c.lux);
    if (!(sum > 0)) return;
    e.base_share = luminanceOf(e.base_lux) / sum;
    for (ExplainedContribution& c : e.contributions) c.share = luminanceOf(c.lux) / sum;
}

}  // namespace

Expected<Explanation> explain(const Pack& pack, glm::vec3 point_m, std::optional<glm::vec3> normal,
                              std::string_view state) {
    CpuRuntime runtime(pack);
    if (auto ok = runtime.apply(state); !ok) return std::unexpected(ok.error());
    runtime.update();
    const PackData& d = pack.data();
    const NearestSurface surfaces(pack.meshes(), pack.pageWidth(), pack.pageHeight());
    const auto surface = nearest(surfaces, point_m, normal, surface_reach_m);
    if (!surface) return std::unexpected(nothingNear(surfaces, point_m, normal));

    Explanation e{
        .surface = *surface,
        .texel = {texelCoordinate(surface->uv[0], d.page_width), texelCoordinate(surface->uv[1], d.page_height)},
        .cluster = {},
        .batch = {},
        .contributions = {}};
    const TangentFrame& frame = surface->frame;
    std::array<float, 3> n = {0, 0, 1};
    if (normal)
        n = {glm::dot(*normal, frame.tangent), glm::dot(*normal, frame.bitangent), glm::dot(*normal, frame.normal)};
    const uint32_t page = pack.meshes()[surface->mesh].page;
    const std::vector<NearTexel> near = texelsAround(d, page, e.texel);
    const size_t centre = texelOf(d, TexelAddress::pack(page, e.texel[0], e.texel[1]));
    const NearTexel& own = *std::ranges::find(near, centre, &NearTexel::texel);
    if (own.receiver) {
        e.cluster = own.cluster;
        const auto after = std::ranges::upper_bound(d.batches, *own.receiver, {}, &Batch::first_receiver);
        e.batch = static_cast<uint32_t>(after - d.batches.begin() - 1);
    }

    ScratchPages scratch(pack);
    for (const NearTexel& texel : near) scratch.put(texel.texel, d.base_pages[texel.texel]);
    e.base_lux = scratch.sampleAndClear(page, surface->uv, n);
    for (uint32_t k = 0; k < d.contributions.size(); ++k) {
        ExplainedContribution c{.contribution = k, .weight = weightOf(runtime, d.contributions[k])};
        for (const NearTexel& texel : near)
            if (const auto record = recordAt(d, texel, k)) scratch.put(texel.texel, *record);
        c.full_lux = scratch.sampleAndClear(page, surface->uv, n);
        c.lux = {c.full_lux[0] * c.weight.r, c.full_lux[1] * c.weight.g, c.full_lux[2] * c.weight.b};
        c.stored = recordAt(d, own, k).has_value();
        e.contributions.push_back(c);
    }
    e.lux = sampleLightmap(pack, runtime.irradiancePages(), runtime.directionPages(), page, surface->uv, n);
    fillShares(e);
    return e;
}

}  // namespace dimmer::cook
