#include <fmt/format.h>
#include <format/texel.h>
#include <pack/batches.h>
#include <pack/pack_data.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

namespace dimmer {
namespace {

template <class... Args>
std::unexpected<Error> unusable(fmt::format_string<Args...> text, Args&&... args) {
    return fail(ErrorCode::BadInput,
                "the pack is not usable: " + fmt::format(text, std::forward<Args>(args)...) + "; cook it again");
}

bool finite(std::span<const float> values) {
    return std::ranges::all_of(values, [](float v) { return std::isfinite(v); });
}

Expected<void> validatePages(const PackData& d) {
    if (auto ok = validatePageSizes(d); !ok) return ok;
    const uint64_t texels = uint64_t{d.page_count} * d.page_width * d.page_height;
    if (d.base_pages.size() != texels)
        return unusable("its base holds {} texels, its pages {}", d.base_pages.size(), texels);
    if (d.color_format != ColorFormat::R11G11B10F && d.color_format != ColorFormat::E5B9G9R9)
        return unusable("its colour format {} is unknown", static_cast<uint32_t>(d.color_format));
    if (d.direction_model != DirectionModel::Ahd && d.direction_model != DirectionModel::Linear)
        return unusable("its directional model {} is unknown", static_cast<uint32_t>(d.direction_model));
    const float brightest = std::ldexp(1.0f, exposure_log2_max);
    if (!(d.exposure >= 1 / brightest && d.exposure <= brightest)) return unusable("its exposure is {}", d.exposure);
    return {};
}

Expected<void> validateElements(const PackData& d) {
    std::set<std::pair<ElementKind, std::string_view>> names;
    bool doors = false;
    for (const Element& e : d.elements) {
        if (e.kind != ElementKind::LightSet && e.kind != ElementKind::Door)
            return unusable("element '{}' is of an unknown kind", e.name);
        if (e.kind == ElementKind::Door) doors = true;
        if (doors && e.kind == ElementKind::LightSet) return unusable("light set '{}' stands behind a door", e.name);
        if (e.name.empty() || !names.emplace(e.kind, e.name).second)
            return unusable("the element name '{}' is empty or used twice", e.name);
        if (!(e.max_weight > 0 && e.max_weight <= max_weight_limit))
            return unusable("element '{}' has a largest weight of {}", e.name, e.max_weight);
    }
    return {};
}

Expected<void> validateContributions(const PackData& d) {
    auto is = [&](uint32_t index, ElementKind kind) {
        return index < d.elements.size() && d.elements[index].kind == kind;
    };
    uint64_t records = 0;
    for (size_t k = 0; k < d.contributions.size(); ++k) {
        const Contribution& c = d.contributions[k];
        if (c.light_set && !is(*c.light_set, ElementKind::LightSet))
            return unusable("contribution {} has no such set", k);
        for (const auto* doors : {&c.doors_open, &c.doors_closed})
            for (uint32_t door : *doors)
                if (!is(door, ElementKind::Door)) return unusable("contribution {} has no such door", k);
        if (!std::isfinite(c.energy_dropped)) return unusable("contribution {} dropped {} energy", k, c.energy_dropped);
        records += c.receivers;
    }
    if (records != d.payload.size())
        return unusable("its contributions list {} records, its payload holds {}", records, d.payload.size());
    return {};
}

// Texels or probes: what their clusters tile, and how many records each contribution has there.
struct Kind {
    ReceiverView view;
    uint64_t receivers;
    std::vector<uint64_t> record_counts;
};

// Terms of a cluster ascend by contribution, and each contribution's records are handed out in cluster order, so every
// record is used exactly once.
Expected<void> validateTerms(const Kind& kind) {
    std::vector<uint64_t> next, ends;
    uint64_t first = 0;
    for (const uint64_t count : kind.record_counts) {
        next.push_back(first);
        ends.push_back(first += count);
    }
    const auto terms = kind.view.terms;
    for (size_t i = 0; i < kind.view.clusters.size(); ++i) {
        const Cluster& c = kind.view.clusters[i];
        for (uint32_t t = c.first_term; t < c.first_term + c.term_count; ++t) {
            const ClusterTerm& term = terms[t];
            if (term.contribution >= next.size())
                return unusable("cluster {} names contribution {}", i, term.contribution);
            if (t > c.first_term && terms[t - 1].contribution >= term.contribution)
                return unusable("the contributions of cluster {} are out of order", i);
            if (term.first_record != next[term.contribution]) return unusable("cluster {} misplaces its records", i);
            next[term.contribution] += c.receiver_count;
            if (next[term.contribution] > ends[term.contribution])
                return unusable("cluster {} reads past contribution {}", i, term.contribution);
        }
    }
    if (next != ends) return unusable("some records belong to no cluster");
    return {};
}

Expected<void> validateClusters(const Kind& kind) {
    const auto batches = kind.view.batches;
    uint64_t receiver = 0, batch = 0, term = 0;
    for (size_t i = 0; i < kind.view.clusters.size(); ++i) {
        const Cluster& c = kind.view.clusters[i];
        if (c.first_receiver != receiver || c.first_batch != batch || c.first_term != term || c.receiver_count == 0)
            return unusable("cluster {} does not follow the one before it", i);
        receiver += c.receiver_count;
        batch += c.batch_count;
        term += c.term_count;
        if (receiver > kind.receivers || batch > batches.size() || term > kind.view.terms.size())
            return unusable("cluster {} reaches past the tables", i);
        uint64_t covered = c.first_receiver;
        for (uint64_t b = c.first_batch; b < batch; ++b) {
            const Batch& item = batches[b];
            if (item.first_receiver != covered || item.receiver_count == 0 || item.receiver_count > batch_receivers_max)
                return unusable("batch {} does not follow the one before it", b);
            covered += item.receiver_count;
        }
        if (covered != receiver) return unusable("the batches of cluster {} do not cover it", i);
    }
    if (receiver != kind.receivers || batch != batches.size() || term != kind.view.terms.size())
        return unusable("its clusters do not cover its tables");
    return {};
}

// What lets a kernel find a batch's texels by a byte each, and take them two at a time; see pack/batches.h.
Expected<void> validateBatchTiles(const PackData& d) {
    for (const Cluster& c : d.clusters)
        for (uint32_t b = c.first_batch; b < c.first_batch + c.batch_count; ++b) {
            const Batch& batch = d.batches[b];
            BatchTiles tiles(d.page_width);
            for (uint32_t i = 0; i < batch.receiver_count; ++i)
                if (!tiles.add(d.addresses[batch.first_receiver + i]))
                    return unusable(
                        "batch {} lies on two pages, in more than {} tiles, or in a third or fourth that does not come "
                        "soon after the one before",
                        b, batch_tiles_max);
            if (batch.receiver_count % 2 != 0 && b + 1 < c.first_batch + c.batch_count)
                return unusable("batch {} has an odd number of receivers and is not its cluster's last", b);
        }
    return {};
}

Expected<void> validateTexels(const PackData& d) {
    Kind kind{d.texelView(), d.addresses.size(), {}};
    for (const Contribution& c : d.contributions) kind.record_counts.push_back(c.receivers);
    if (auto ok = validateClusters(kind); !ok) return ok;
    return validateTerms(kind);
}

Expected<void> validateProbes(const PackData& d) {
    const ProbeData& p = d.probes;
    if (p.base.empty() && p.numbers.empty() && p.payload.empty() && p.clusters.empty() && p.record_counts.empty())
        return {};
    if (p.record_counts.size() != d.contributions.size())
        return unusable("it counts the probes' records of {} contributions, not {}", p.record_counts.size(),
                        d.contributions.size());
    const Kind kind{p.view(), p.numbers.size(), {p.record_counts.begin(), p.record_counts.end()}};
    const uint64_t records = std::accumulate(kind.record_counts.begin(), kind.record_counts.end(), uint64_t{0});
    if (records != p.payload.size())
        return unusable("its contributions list {} records of probes, the payload holds {}", records, p.payload.size());
    std::vector<bool> taken(p.base.size());
    for (const uint32_t number : p.numbers) {
        if (number >= p.base.size() || taken[number])
            return unusable("a receiver is probe {} of {}, or two are", number, p.base.size());
        taken[number] = true;
    }
    if (auto ok = validateClusters(kind); !ok) return ok;
    return validateTerms(kind);
}

Expected<void> validateTetrahedra(const GlobalGrid& grid) {
    const size_t probes = grid.positions.size(), count = grid.tetrahedra.size();
    if (!grid.visibility.empty() && grid.visibility.size() != count)
        return unusable("its visibility is of {} tetrahedra, not {}", grid.visibility.size(), count);
    for (size_t i = 0; i < count; ++i) {
        const Tetrahedron& t = grid.tetrahedra[i];
        for (const uint32_t probe : t.probes)
            if (probe >= probes) return unusable("tetrahedron {} has probe {} of {}", i, probe, probes);
        for (const uint32_t neighbour : t.neighbours)
            if (neighbour >= count && neighbour != no_tetrahedron)
                return unusable("tetrahedron {} has neighbour {} of {}", i, neighbour, count);
    }
    for (const uint32_t start : grid.starts)
        if (start >= count) return unusable("a walk starts in tetrahedron {} of {}", start, count);
    return {};
}

// With this a walk is safe: it takes a bounded number of steps, and every number that it meets is in range and finite.
Expected<void> validateGlobalGrid(const PackData& d) {
    const GlobalGrid& grid = d.probes.global;
    if (grid.positions.size() > d.probes.base.size() || grid.levels.size() != grid.positions.size())
        return unusable("its global grid has {} places and {} levels for {} probes", grid.positions.size(),
                        grid.levels.size(), d.probes.base.size());
    for (const ProbePosition& p : grid.positions)
        if (!std::isfinite(p.x_m) || !std::isfinite(p.y_m) || !std::isfinite(p.z_m))
            return unusable("a probe stands nowhere");
    const StartGrid& start = grid.start;
    if (!finite(start.min_m) || !finite(start.max_m)) return unusable("its global grid's box is not finite");
    uint64_t cells = 1;
    for (size_t axis = 0; axis < 3; ++axis) {
        const float extent_m = start.max_m[axis] - start.min_m[axis];
        if (!grid.empty() && !(extent_m > 1e-30f && extent_m < 1e30f))  // what reciprocal() is good for
            return unusable("its global grid's box is flat or without end");
        // Each factor is at most the number of cells that are there, so that the product cannot overflow.
        if (start.counts[axis] > grid.starts.size()) return unusable("its starts of walks do not fill their box");
        cells = std::min<uint64_t>(cells * start.counts[axis], UINT32_MAX);
    }
    if (grid.starts.size() != cells || (grid.empty() != grid.starts.empty()))
        return unusable("its starts of walks do not fill their box");
    return validateTetrahedra(grid);
}

Expected<void> validateLocalGrids(const PackData& d) {
    for (const LocalGrid& grid : d.probes.local) {
        if (!std::ranges::all_of(grid.counts, [](uint32_t n) { return n >= 1 && n <= local_grid_side_max; }))
            return unusable("local grid '{}' has {} x {} x {} probes", grid.node, grid.counts[0], grid.counts[1],
                            grid.counts[2]);
        if (!finite(grid.origin_m) || !std::ranges::all_of(grid.step_m, [](const auto& s) { return finite(s); }))
            return unusable("local grid '{}' is not finite", grid.node);
        const uint64_t first = d.probes.global.positions.size(), end = d.probes.base.size();
        if (grid.first_probe < first || grid.first_probe > end || grid.probeCount() > end - grid.first_probe)
            return unusable("local grid '{}' has probes that are not there", grid.node);
    }
    return {};
}

Expected<void> validateAddresses(const PackData& d) {
    std::vector<bool> taken(d.base_pages.size());
    for (uint32_t address : d.addresses) {
        const uint32_t page = TexelAddress::page(address), x = TexelAddress::x(address), y = TexelAddress::y(address);
        if (page >= d.page_count || x >= d.page_width || y >= d.page_height)
            return unusable("a receiver lies outside the pages, at page {} ({}, {})", page, x, y);
        const size_t texel = (size_t{page} * d.page_height + y) * d.page_width + x;
        if (taken[texel]) return unusable("two receivers share the texel ({}, {}) of page {}", x, y, page);
        taken[texel] = true;
    }
    return {};
}

Expected<void> validateMeshes(const PackData& d) {
    auto in = [&](std::optional<uint32_t> element, ElementKind kind) {
        return !element || (*element < d.elements.size() && d.elements[*element].kind == kind);
    };
    for (const Mesh& m : d.meshes) {
        if (m.page >= d.page_count) return unusable("mesh '{}' lies on page {}", m.node, m.page);
        if (!in(m.door, ElementKind::Door) || !in(m.emission_set, ElementKind::LightSet))
            return unusable("mesh '{}' belongs to no such element", m.node);
        if (m.indices.size() % 3 != 0) return unusable("mesh '{}' has a broken triangle", m.node);
        if (!std::ranges::all_of(m.indices, [&](uint32_t i) { return i < m.vertices.size(); }))
            return unusable("mesh '{}' has an index past its vertices", m.node);
        if (!finite(m.reflectance) || !finite(m.emission_cd_m2))
            return unusable("mesh '{}' has no finite colour", m.node);
        for (const MeshVertex& v : m.vertices)
            if (!finite(v.position_m) || !finite(v.normal) || !finite(v.lightmap_uv))
                return unusable("mesh '{}' has a vertex that is not finite", m.node);
    }
    for (const Viewpoint& v : d.viewpoints)
        if (!finite(v.position_m) || !finite(v.forward) || !std::isfinite(v.vertical_fov_rad))
            return unusable("viewpoint '{}' is not finite", v.name);
    return {};
}

Expected<void> validateModels(const PackData& d) {
    for (const ModelMesh& m : d.model_meshes) {
        if (!finite(m.min_m) || !finite(m.max_m) || !finite(m.reflectance) || !finite(m.emission_cd_m2))
            return unusable("the mesh of model '{}' has a box or colour that is not finite", m.name);
        const bool no_set = m.emission_set && (*m.emission_set >= d.elements.size() ||
                                               d.elements[*m.emission_set].kind != ElementKind::LightSet);
        if (no_set) return unusable("the mesh of model '{}' shines with no such light set", m.name);
        if (m.indices.size() % 3 != 0) return unusable("the mesh of model '{}' has a broken triangle", m.name);
        if (!std::ranges::all_of(m.indices, [&](uint32_t i) { return i < m.vertices.size(); }))
            return unusable("the mesh of model '{}' has an index past its vertices", m.name);
    }
    for (const PlacedModel& m : d.models) {
        if (m.first_mesh > d.model_meshes.size() || m.mesh_count > d.model_meshes.size() - m.first_mesh)
            return unusable("model '{}' has meshes that are not there", m.node);
        if (m.local_grid && *m.local_grid >= d.probes.local.size())
            return unusable("model '{}' has a light grid that is not there", m.node);
        if (!std::ranges::all_of(m.world_from_model.rows, [](const auto& row) { return finite(row); }) ||
            !finite(m.min_m) || !finite(m.max_m))
            return unusable("model '{}' stands nowhere", m.node);
    }
    return {};
}

}  // namespace

Expected<void> validatePageSizes(const PackData& data) {
    if (data.page_count == 0 || data.page_count > page_count_max || data.page_width == 0 ||
        data.page_width > page_side_max || data.page_height == 0 || data.page_height > page_side_max)
        return unusable("{} pages of {} x {} texels are outside 1..{} pages of 1..{} a side", data.page_count,
                        data.page_width, data.page_height, page_count_max, page_side_max);
    return {};
}

Expected<void> validate(const PackData& data) {
    for (auto* check :
         {validatePages, validateElements, validateContributions, validateTexels, validateAddresses, validateBatchTiles,
          validateProbes, validateGlobalGrid, validateLocalGrids, validateMeshes, validateModels})
        if (auto ok = check(data); !ok) return ok;
    return {};
}

}  // namespace dimmer
