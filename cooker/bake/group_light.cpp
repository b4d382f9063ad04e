#include <bake/group_light.h>

namespace dimmer::cook {
namespace {

// What a group keeps of a receiver's light: all but the noise, which is of no use later.
ReceiverLight inTerm(const ReceiverLight& l, uint32_t term) {
    return {term, l.light, 0, l.keep};
}
ProbeTermLight inTerm(const ProbeTermLight& l, uint32_t term) {
    return {term, l.light, 0, 0};
}
TermLight inTerm(const TermLight& l, uint32_t term) {
    return l.in(term);
}

// Of `group`, whose terms are counted by themselves.
template <class Entry>
Sparse<Entry> partOf(const Sparse<Entry>& light, const DoorPaths& paths, uint32_t group) {
    return Sparse<Entry>::build(light.rows(), [&](size_t begin, size_t end, auto emit) {
        std::vector<Entry> row;
        for (size_t i = begin; i < end; ++i) {
            row.clear();
            for (const Entry& l : light.row(i))
                if (paths.terms()[l.term].group == group) row.push_back(inTerm(l, paths.numberInGroup(l.term)));
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
            std::ranges::sort(row, {}, term_of);
            emit(std::span<const Entry>(row));
        }
    });
}

}  // namespace

bool fits(const GroupLight& light, const DoorPaths& paths, uint32_t group, size_t texels, size_t probes) {
    const size_t terms = paths.termsOf(group).size();
    return light.reports.size() == terms && fits(light.light, texels, terms) && fits(light.local_light, probes, terms);
}

GroupLight lightOfGroup(const Baked& baked, const DoorPaths& paths, uint32_t group, uint32_t bounces) {
    GroupLight out;
    out.bounces = bounces;
    out.door_flux = baked.door_flux[group];
    for (const uint32_t t : paths.termsOf(group)) out.reports.push_back(baked.reports[t]);
    out.light = partOf(baked.light, paths, group);
    out.local_light = partOf(baked.local_light, paths, group);
    return out;
}

void addGroups(std::span<const std::optional<GroupLight>> groups, const DoorPaths& paths, Baked& baked) {
    std::vector<Part<ReceiverLight>> texels;
    std::vector<Part<ProbeTermLight>> probes;
    for (uint32_t g = 0; g < groups.size(); ++g) {
        if (!groups[g]) continue;
        const auto& terms = paths.termsOf(g);
        texels.push_back({&groups[g]->light, &terms});
        probes.push_back({&groups[g]->local_light, &terms});
        baked.door_flux[g] = groups[g]->door_flux;
        baked.bounces = std::max(baked.bounces, groups[g]->bounces);
        for (size_t k = 0; k < terms.size(); ++k) baked.reports[terms[k]] = groups[g]->reports[k];
    }
    if (texels.empty()) return;
    baked.light = withParts(baked.light, texels);
    baked.local_light = withParts(baked.local_light, probes);
}

SparseLight radianceOfGroup(const SparseLight& radiance, const DoorPaths& paths, uint32_t group) {
    return partOf(radiance, paths, group);
}

void addRadiance(std::span<const std::optional<SparseLight>> groups, const DoorPaths& paths, SparseLight& radiance) {
    std::vector<Part<TermLight>> parts;
    for (uint32_t g = 0; g < groups.size(); ++g)
        if (groups[g]) parts.push_back({&*groups[g], &paths.termsOf(g)});
    if (parts.empty()) return;
    if (radiance.rows() == 0) radiance = SparseLight::Builder(parts[0].light->rows()).finish();
    radiance = withParts(radiance, parts);
}

}  // namespace dimmer::cook
