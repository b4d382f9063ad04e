#include <bake/group_light.h>

namespace dimmer::cook {
namespace {

// Per light group, its terms in ascending order.
std::vector<std::vector<uint32_t>> termsOfGroups(const std::vector<Term>& terms, size_t groups) {
    std::vector<std::vector<uint32_t>> of_group(groups);
    for (uint32_t t = 0; t < terms.size(); ++t)
        if (terms[t].group < groups) of_group[terms[t].group].push_back(t);
    return of_group;
}

// What a group keeps of a receiver's light: all but the noise, which is of no use later.
ReceiverLight inTerm(const ReceiverLight& l, uint32_t term) {
    return {term, l.light, 0, l.keep};
}
ProbeTermLight inTerm(const ProbeTermLight& l, uint32_t term) {
    return {term, l.light, 0, 0};
}

template <class Entry>
Sparse<Entry> partOf(const Sparse<Entry>& light, std::span<const uint32_t> own_index) {
    return Sparse<Entry>::build(light.rows(), [&](size_t begin, size_t end, auto emit) {
        std::vector<Entry> row;
        for (size_t i = begin; i < end; ++i) {
            row.clear();
            for (const Entry& l : light.row(i))
                if (own_index[l.term] != no_term) row.push_back(inTerm(l, own_index[l.term]));
            emit(std::span<const Entry>(row));
        }
    });
}

// One group's light, and the terms that it counts as its own.
template <class Entry>
struct Part {
    const Sparse<Entry>* light;
    const std::vector<uint32_t>* terms;
};

template <class Entry>
Sparse<Entry> withParts(const Sparse<Entry>& light, const std::vector<Part<Entry>>& parts) {
    return Sparse<Entry>::build(light.rows(), [&](size_t begin, size_t end, auto emit) {
        std::vector<Entry> row;
        for (size_t i = begin; i < end; ++i) {
            const auto here = light.row(i);
            row.assign(here.begin(), here.end());
            for (const Part<Entry>& part : parts)
                for (const Entry& l : part.light->row(i)) row.push_back(inTerm(l, (*part.terms)[l.term]));
            std::ranges::sort(row, {}, &Entry::term);
            emit(std::span<const Entry>(row));
        }
    });
}

}  // namespace

GroupLight lightOfGroup(const Baked& baked, uint32_t group, uint32_t bounces) {
    GroupLight out;
    out.bounces = bounces;
    out.door_flux = baked.door_flux[group];
    std::vector<uint32_t> own_index(baked.terms.size(), no_term);
    for (uint32_t t = 0; t < baked.terms.size(); ++t) {
        if (baked.terms[t].group != group) continue;
        own_index[t] = static_cast<uint32_t>(out.reports.size());
        out.reports.push_back(baked.reports[t]);
    }
    out.light = partOf(baked.light, own_index);
    out.local_light = partOf(baked.local_light, own_index);
    return out;
}

void addGroups(std::span<const std::optional<GroupLight>> groups, Baked& baked) {
    const auto terms = termsOfGroups(baked.terms, groups.size());
    std::vector<Part<ReceiverLight>> texels;
    std::vector<Part<ProbeTermLight>> probes;
    for (uint32_t g = 0; g < groups.size(); ++g) {
        if (!groups[g]) continue;
        texels.push_back({&groups[g]->light, &terms[g]});
        probes.push_back({&groups[g]->local_light, &terms[g]});
        baked.door_flux[g] = groups[g]->door_flux;
        baked.bounces = std::max(baked.bounces, groups[g]->bounces);
        for (size_t k = 0; k < terms[g].size(); ++k) baked.reports[terms[g][k]] = groups[g]->reports[k];
    }
    if (texels.empty()) return;
    baked.light = withParts(baked.light, texels);
    baked.local_light = withParts(baked.local_light, probes);
}

SparseLight radianceOfGroup(const SparseLight& radiance, const DoorPaths& paths, uint32_t group) {
    const std::vector<uint32_t> terms = termsOfGroups(paths.terms(), paths.groupCount())[group];
    return SparseLight::build(radiance.rows(), [&](size_t begin, size_t end, auto emit) {
        std::vector<TermLight> row;
        for (size_t i = begin; i < end; ++i) {
            row.clear();
            for (const TermLight& l : radiance.row(i))
                if (const auto own = std::ranges::lower_bound(terms, l.term); own != terms.end() && *own == l.term)
                    row.push_back({static_cast<uint32_t>(own - terms.begin()), l.value});
            emit(std::span<const TermLight>(row));
        }
    });
}

void addRadiance(std::span<const std::optional<SparseLight>> groups, const DoorPaths& paths, size_t receivers,
                 SparseLight& radiance) {
    const auto terms = termsOfGroups(paths.terms(), groups.size());
    radiance = SparseLight::build(receivers, [&](size_t begin, size_t end, auto emit) {
        std::vector<TermLight> row;
        for (size_t i = begin; i < end; ++i) {
            row.clear();
            if (radiance.rows() > 0) row.assign(radiance.row(i).begin(), radiance.row(i).end());
            for (size_t g = 0; g < groups.size(); ++g)
                if (groups[g])
                    for (const TermLight& l : groups[g]->row(i)) row.push_back({terms[g][l.term], l.value});
            std::ranges::sort(row, {}, &TermLight::term);
            emit(std::span<const TermLight>(row));
        }
    });
}

}  // namespace dimmer::cook
