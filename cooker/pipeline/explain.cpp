#include <pipeline/explain.h>

#include <dimmer/cpu_runtime.h>
#include <dimmer/probe_grid.h>
#include <format/probe.h>
#include <pipeline/sample_points.h>
#include <probes/tetrahedron_walk.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

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

Error nothingNear(const Pack& pack, ExplainFrom from, const NearestSurface& surfaces, glm::vec3 point,
                  std::optional<glm::vec3> normal) {
    const auto far = nearest(surfaces, point, normal, std::numeric_limits<float>::infinity());
    return {ErrorCode::NotFound,
            fmt::format("there is no lightmapped surface within {:.0f} cm of {},{},{}{}; {}{}",
                        100.0 * static_cast<double>(surface_reach_m), point.x, point.y, point.z,
                        normal ? " that faces along the normal" : "",
                        far ? fmt::format("the nearest is {:.2f} m away", far->distance_m) : "there is none at all",
                        from == ExplainFrom::Nearest && pack.data().probes.global.empty()
                            ? ", and the pack has no global grid for points in the air"
                            : "")};
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

ReceiverPlace placeOf(const ReceiverView& view, uint32_t receiver) {
    const auto number = [&](const auto& list) {
        const auto after =
            std::ranges::upper_bound(list, receiver, {}, [](const auto& item) { return item.first_receiver; });
        return static_cast<uint32_t>(after - list.begin() - 1);
    };
    return {number(view.clusters), number(view.batches)};
}

// The record of a contribution at a receiver, into the payload.
std::optional<uint32_t> recordOf(const ReceiverView& view, const ReceiverPlace& place, uint32_t receiver,
                                 uint32_t contribution) {
    if (!place.cluster) return std::nullopt;
    const Cluster& cluster = view.clusters[*place.cluster];
    for (const ClusterTerm& term : view.terms.subspan(cluster.first_term, cluster.term_count))
        if (term.contribution == contribution) return term.first_record + (receiver - cluster.first_receiver);
    return std::nullopt;
}

// A texel that the filter may read, and the receiver that it is, where it is one.
struct NearTexel {
    size_t texel;
    uint32_t receiver = 0;
    ReceiverPlace place;
};

// All texels within one step of the place: more than bilinear filtering reads.
std::vector<NearTexel> texelsAround(const PackData& d, uint32_t page, std::array<uint32_t, 2> centre) {
    std::vector<NearTexel> near;
    for (uint32_t y = std::max(centre[1], 1u) - 1; y <= std::min(centre[1] + 1, d.page_height - 1); ++y)
        for (uint32_t x = std::max(centre[0], 1u) - 1; x <= std::min(centre[0] + 1, d.page_width - 1); ++x)
            near.push_back({texelIndex(d, TexelAddress::pack(page, x, y)), 0, {}});
    for (uint32_t r = 0; r < d.addresses.size(); ++r) {
        const size_t texel = texelIndex(d, d.addresses[r]);
        const auto found = std::ranges::find(near, texel, &NearTexel::texel);
        if (found == near.end()) continue;
        found->receiver = r;
        found->place = placeOf(d.texelView(), r);
    }
    return near;
}

uint32_t texelCoordinate(float uv, uint32_t size) {
    return std::min(static_cast<uint32_t>(std::max(0.0f, uv) * static_cast<float>(size)), size - 1);
}

double luminanceOf(const std::array<float, 3>& lux) {
    return static_cast<double>(dimmer::luminance(lux[0], lux[1], lux[2]));
}

std::array<float, 3> scaled(const std::array<float, 3>& lux, const Weight& weight) {
    return {lux[0] * weight.r, lux[1] * weight.g, lux[2] * weight.b};
}

void fillShares(Explanation& e) {
    double sum = luminanceOf(e.base_lux);
    for (const ExplainedContribution& c : e.contributions) sum += luminanceOf(c.lux);
    if (!(sum > 0)) return;
    e.base_share = luminanceOf(e.base_lux) / sum;
    for (ExplainedContribution& c : e.contributions) c.share = luminanceOf(c.lux) / sum;
}

Explanation explainSurface(const Pack& pack, const CpuRuntime& runtime, const SurfacePlace& surface,
                           std::optional<glm::vec3> normal) {
    const PackData& d = pack.data();
    Explanation e;
    ExplainedSurface& at = e.surface.emplace();
    at.place = surface;
    at.texel = {texelCoordinate(surface.uv[0], d.page_width), texelCoordinate(surface.uv[1], d.page_height)};
    const TangentFrame& frame = surface.frame;
    std::array<float, 3> n = {0, 0, 1};
    if (normal)
        n = {glm::dot(*normal, frame.tangent), glm::dot(*normal, frame.bitangent), glm::dot(*normal, frame.normal)};
    const uint32_t page = pack.meshes()[surface.mesh].page;
    const std::vector<NearTexel> near = texelsAround(d, page, at.texel);
    const size_t centre = texelIndex(d, TexelAddress::pack(page, at.texel[0], at.texel[1]));
    const NearTexel& own = *std::ranges::find(near, centre, &NearTexel::texel);
    at.receiver = own.place;

    ScratchPages scratch(pack);
    for (const NearTexel& texel : near) scratch.put(texel.texel, d.base_pages[texel.texel]);
    e.base_lux = scratch.sampleAndClear(page, surface.uv, n);
    for (uint32_t k = 0; k < d.contributions.size(); ++k) {
        ExplainedContribution c{.contribution = k, .weight = weightOf(runtime, d.contributions[k])};
        for (const NearTexel& texel : near)
            if (const auto record = recordOf(d.texelView(), texel.place, texel.receiver, k)) {
                scratch.put(texel.texel, d.payload[*record]);
                c.records += &texel == &own && d.payload[*record].irradiance != 0;
            }
        c.full_lux = scratch.sampleAndClear(page, surface.uv, n);
        c.lux = scaled(c.full_lux, c.weight);
        e.contributions.push_back(c);
    }
    e.lux = sampleLightmap(pack, runtime.irradiancePages(), runtime.directionPages(), page, surface.uv, n);
    return e;
}

std::array<float, 3> luxAt(const Pack& pack, std::span<const uint32_t> probes, glm::vec3 point_m,
                           std::optional<glm::vec3> normal) {
    const GridSampler sampler(pack, probes);
    const std::array<float, 3> point = {point_m.x, point_m.y, point_m.z};
    if (normal) return sampler.sample(point, {normal->x, normal->y, normal->z});
    // The mean of irradiance over all normals: a quarter of what passes through a unit sphere's centre.
    auto lux = sampler.radiance(point).coefficients[0];
    for (float& v : lux) v *= 0.5f * std::sqrt(std::numbers::pi_v<float>);
    return lux;
}

Explanation explainAir(const Pack& pack, const CpuRuntime& runtime, glm::vec3 point_m,
                       std::optional<glm::vec3> normal) {
    const PackData& d = pack.data();
    const ProbeData& probes = d.probes;
    Explanation e;
    const GridPlace place = locate(probes.global, {point_m.x, point_m.y, point_m.z});
    const auto shares = probeWeights(probes.global, place);
    std::array<uint32_t, 4> receivers = {};
    for (size_t i = 0; i < 4; ++i) {
        if (!(shares[i] > 0)) continue;
        const uint32_t number = probes.global.tetrahedra[place.tetrahedron].probes[i];
        ExplainedProbe probe{.number = number, .share = shares[i], .receiver = {}};
        if (const auto r = std::ranges::find(probes.numbers, number); r != probes.numbers.end()) {
            receivers[e.probes.size()] = static_cast<uint32_t>(r - probes.numbers.begin());
            probe.receiver = placeOf(probes.view(), receivers[e.probes.size()]);
        }
        e.probes.push_back(probe);
    }

    // Otherwise black probes, looked up just as blended ones are.
    std::vector<uint32_t> scratch(words_per_probe * probes.base.size(), 0);
    const auto put = [&](uint32_t number, const ProbeRecord& record) {
        const ProbeRecord canonical = canonicalProbe(d.color_format, record);
        uint32_t* words = &scratch[words_per_probe * number];
        words[0] = canonical.light;
        std::ranges::copy(canonical.bands, words + 1);
    };
    for (const ExplainedProbe& probe : e.probes) put(probe.number, probes.base[probe.number]);
    e.base_lux = luxAt(pack, scratch, point_m, normal);
    for (uint32_t k = 0; k < d.contributions.size(); ++k) {
        ExplainedContribution c{.contribution = k, .weight = weightOf(runtime, d.contributions[k])};
        for (size_t i = 0; i < e.probes.size(); ++i) {
            const auto record = recordOf(probes.view(), e.probes[i].receiver, receivers[i], k);
            put(e.probes[i].number, record ? probes.payload[*record] : ProbeRecord{});
            c.records += record && probes.payload[*record].light != 0;
        }
        c.full_lux = luxAt(pack, scratch, point_m, normal);
        c.lux = scaled(c.full_lux, c.weight);
        e.contributions.push_back(c);
    }
    e.lux = luxAt(pack, runtime.probes(), point_m, normal);
    return e;
}

}  // namespace

Expected<Explanation> explain(const Pack& pack, glm::vec3 point_m, std::optional<glm::vec3> normal,
                              std::string_view state, ExplainFrom from) {
    const bool has_grid = !pack.data().probes.global.empty();
    if (from == ExplainFrom::Grid && !has_grid)
        return std::unexpected(Error{ErrorCode::NotFound,
                                     "the pack has no global grid; cook it with --set "
                                     "grids.global=on"});
    CpuRuntime runtime(pack);
    if (auto ok = runtime.apply(state); !ok) return std::unexpected(ok.error());
    runtime.update();
    std::optional<SurfacePlace> surface;
    if (from != ExplainFrom::Grid) {
        const NearestSurface surfaces(pack.meshes(), pack.pageWidth(), pack.pageHeight());
        surface = nearest(surfaces, point_m, normal, surface_reach_m);
        if (!surface && (from == ExplainFrom::Surface || !has_grid))
            return std::unexpected(nothingNear(pack, from, surfaces, point_m, normal));
    }
    Explanation e =
        surface ? explainSurface(pack, runtime, *surface, normal) : explainAir(pack, runtime, point_m, normal);
    fillShares(e);
    return e;
}

}  // namespace dimmer::cook
