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
    out.light = Sparse<ReceiverLight>::build(baked.light.rows(), [&](size_t begin, size_t end, auto emit) {
        std::vector<ReceiverLight> row;
        for (size_t i = begin; i < end; ++i) {
            row.clear();
            for (const ReceiverLight& l : baked.light.row(i))
                if (own_index[l.term] != no_term) row.push_back({own_index[l.term], l.light, 0, l.keep});
            emit(std::span<const ReceiverLight>(row));
        }
    });
    return out;
}

void addGroups(std::span<const std::optional<GroupLight>> groups, Baked& baked) {
    const auto terms = termsOfGroups(baked.terms, groups.size());
    std::vector<const GroupLight*> added;
    std::vector<uint32_t> group_of;
    for (uint32_t g = 0; g < groups.size(); ++g) {
        if (!groups[g]) continue;
        added.push_back(&*groups[g]);
        group_of.push_back(g);
        baked.door_flux[g] = groups[g]->door_flux;
        baked.bounces = std::max(baked.bounces, groups[g]->bounces);
        for (size_t k = 0; k < terms[g].size(); ++k) baked.reports[terms[g][k]] = groups[g]->reports[k];
    }
    if (added.empty()) return;
    baked.light = Sparse<ReceiverLight>::build(baked.light.rows(), [&](size_t begin, size_t end, auto emit) {
        std::vector<ReceiverLight> row;
        for (size_t i = begin; i < end; ++i) {
            const auto here = baked.light.row(i);
            row.assign(here.begin(), here.end());
            for (size_t a = 0; a < added.size(); ++a)
                for (const ReceiverLight& l : added[a]->light.row(i))
                    row.push_back({terms[group_of[a]][l.term], l.light, 0, l.keep});
            std::ranges::sort(row, {}, &ReceiverLight::term);
            emit(std::span<const ReceiverLight>(row));
        }
    });
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
