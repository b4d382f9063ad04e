#include <pipeline/lamps_apart.h>

#include <bake/sampling.h>

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

namespace dimmer::cook {
namespace {

bool emits(const Scene& scene, const SceneMesh& mesh) {
    return std::ranges::any_of(mesh.triangle_materials,
                               [&](uint32_t m) { return scene.materials[m].emission_cd_m2 != glm::vec3(0); });
}

// A light group's lamps that are baked, and whether it has emissive surfaces or the sky.
struct GroupParts {
    std::vector<uint32_t> lamps;
    bool surfaces = false;
    size_t count() const { return lamps.size() + surfaces; }
};

std::vector<GroupParts> partsOfGroups(const Scene& scene) {
    std::vector<GroupParts> parts(1 + scene.light_sets.size());
    for (uint32_t l = 0; l < scene.lights.size(); ++l)
        if (scene.lights[l].bake != BakeMode::None) parts[groupOf(scene.lights[l].light_set)].lamps.push_back(l);
    for (const SceneMesh& mesh : scene.meshes)
        if (emits(scene, mesh)) parts[groupOf(mesh.light_set)].surfaces = true;
    if (scene.sky_radiance_cd_m2 != glm::vec3(0)) parts[always_group].surfaces = true;
    return parts;
}

// No set's own name has a comma.
class PartNames {
   public:
    // `part`: a node may have any name.
    std::string of(const std::string& set, std::string part) {
        std::ranges::replace_if(
            part, [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
        std::string name = fmt::format("{}, {}", set, part);
        for (int n = 2; !used_.insert(name).second; ++n) name = fmt::format("{}, {} ({})", set, part, n);
        return name;
    }

   private:
    std::set<std::string> used_;
};

// Terms of parts, as terms of the sets in the same order: free ones first, then by path.
struct WholeTerms {
    std::vector<Term> terms;
    std::vector<uint32_t> of_part;  // per term of a part
};

WholeTerms wholeTerms(const LampGroups& parts, std::span<const Term> terms) {
    using Name = std::tuple<uint32_t, std::vector<uint32_t>, std::vector<uint32_t>>;
    WholeTerms out;
    std::map<Name, uint32_t> number;
    for (const Term& part : terms) {
        const Term whole{parts.whole[part.group], part.doors_open, part.doors_closed};
        const auto [it, fresh] = number.try_emplace({whole.group, whole.doors_open, whole.doors_closed},
                                                    static_cast<uint32_t>(out.terms.size()));
        if (fresh) out.terms.push_back(whole);
        out.of_part.push_back(it->second);
    }
    return out;
}

template <class Entry>
Sparse<Entry> together(const Sparse<Entry>& light, std::span<const uint32_t> whole_of) {
    return Sparse<Entry>::build(light.rows(), [&](size_t begin, size_t end, auto emit) {
        std::vector<Entry> parts, row;
        for (size_t i = begin; i < end; ++i) {
            parts.assign(light.row(i).begin(), light.row(i).end());
            for (Entry& l : parts) l.term = whole_of[l.term];
            std::ranges::stable_sort(parts, {}, &Entry::term);
            row.clear();
            for (const Entry& l : parts) {
                if (row.empty() || row.back().term != l.term) {
                    row.push_back(l);
                    continue;
                }
                row.back().light += l.light;
                row.back().variance += l.variance;
                row.back().keep = std::max(row.back().keep, l.keep);
            }
            emit(std::span<const Entry>(row));
        }
    });
}

// Energies of parts are in units of their scales.
std::vector<TermReport> wholeReports(const WholeTerms& terms, const SetScales& scales, const Baked& baked) {
    std::vector<TermReport> reports(terms.terms.size());
    for (size_t t = 0; t < terms.of_part.size(); ++t) {
        const TermReport& part = baked.reports[t];
        TermReport& whole = reports[terms.of_part[t]];
        const auto scale = static_cast<double>(luminance(scales.of_group[baked.terms[t].group]));
        whole.measured_over = std::max(whole.measured_over, part.measured_over);
        whole.energy += scale * part.energy;
        whole.energy_dropped += scale * part.energy * part.energy_dropped;
    }
    for (TermReport& whole : reports)
        if (whole.energy > 0) whole.energy_dropped /= whole.energy;
    return reports;
}

}  // namespace

std::vector<float> LampGroups::ofParts(const std::vector<float>& of_groups) const {
    if (none()) return of_groups;
    std::vector<float> out;
    for (const uint32_t g : whole) out.push_back(of_groups[g]);
    return out;
}

LampGroups takeLampsApart(Scene& scene, uint32_t lamps_max) {
    const std::vector<GroupParts> parts = partsOfGroups(scene);
    const auto isApart = [&](const GroupParts& p) { return p.count() > 1 && p.count() <= lamps_max; };
    LampGroups out;
    if (std::ranges::none_of(parts, isApart)) return out;
    out.whole = {always_group};
    std::vector<std::vector<uint32_t>> parts_of(parts.size());  // into the new sets
    std::vector<std::optional<uint32_t>> set_of_lamp(scene.lights.size());
    std::vector<SceneLightSet> sets;
    PartNames names;
    const auto add = [&](uint32_t group, SceneLightSet set) {
        parts_of[group].push_back(static_cast<uint32_t>(sets.size()));
        out.whole.push_back(group);
        sets.push_back(std::move(set));
    };
    const auto addLamps = [&](uint32_t group, const std::string& whole, SceneLightSet set) {
        for (const uint32_t lamp : parts[group].lamps) {
            set_of_lamp[lamp] = static_cast<uint32_t>(sets.size());
            set.name = names.of(whole, "lamp " + scene.lights[lamp].node);
            add(group, set);
        }
    };
    for (uint32_t g = 1; g < parts.size(); ++g) {
        const SceneLightSet& whole = scene.light_sets[g - 1];
        if (!isApart(parts[g])) {
            add(g, whole);
            continue;
        }
        SceneLightSet part{.name = "", .max_weight = whole.max_weight, .part_of = whole.name};
        if (parts[g].surfaces) {
            part.name = names.of(whole.name, "surfaces");
            add(g, part);
        }
        addLamps(g, whole.name, part);
    }
    if (isApart(parts[always_group])) addLamps(always_group, "always-on light", {.name = "", .always_on = true});

    for (uint32_t l = 0; l < scene.lights.size(); ++l)
        if (std::optional<uint32_t>& set = scene.lights[l].light_set; set_of_lamp[l])
            set = set_of_lamp[l];
        else if (set)
            set = parts_of[groupOf(set)].front();
    for (SceneMesh& mesh : scene.meshes)
        if (mesh.light_set) mesh.light_set = parts_of[groupOf(mesh.light_set)].front();
    out.sets = std::exchange(scene.light_sets, std::move(sets));
    out.combinations = std::exchange(scene.combinations, {});
    for (const auto& combination : out.combinations) {
        const auto set = std::ranges::find(combination, false, &ElementRef::is_door);
        if (set == combination.end()) {
            scene.combinations.push_back(combination);
            continue;
        }
        for (const uint32_t part : parts_of[1 + set->index]) {
            scene.combinations.push_back(combination);
            scene.combinations.back()[static_cast<size_t>(set - combination.begin())].index = part;
        }
    }
    return out;
}

void putTogether(const LampGroups& parts, const SetScales& scales, Scene& scene, Baked& baked) {
    if (parts.none()) return;
    const WholeTerms terms = wholeTerms(parts, baked.terms);
    baked.light = together(baked.light, terms.of_part);
    baked.local_light = together(baked.local_light, terms.of_part);
    baked.grid.light = together(baked.grid.light, terms.of_part);
    baked.reports = wholeReports(terms, scales, baked);
    const auto count = [&](const auto& light) {
        for (size_t i = 0; i < light.rows(); ++i)
            for (const auto& l : light.row(i)) ++baked.reports[l.term].receivers;
    };
    count(baked.light);
    count(baked.local_light);
    count(baked.grid.light);
    baked.terms = terms.terms;
    baked.door_flux.clear();
    const auto restore = [&](std::optional<uint32_t>& set) {
        if (const uint32_t group = parts.whole[groupOf(set)]; group != always_group)
            set = group - 1;
        else
            set.reset();
    };
    for (PunctualLight& light : scene.lights) restore(light.light_set);
    for (SceneMesh& mesh : scene.meshes) restore(mesh.light_set);
    scene.light_sets = parts.sets;
    scene.combinations = parts.combinations;
}

}  // namespace dimmer::cook
