#include <bake/emitters.h>

#include <bake/sampling.h>
#include <scene/emission.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace dimmer::cook {
namespace {

// The faintest emitters of a group in a cell, which have this share of its light there together, are left to the gather
// rays: they still find them, with full weight, so nothing is lost, but seldom.
constexpr float left_share_max = 1e-3f;
// So is a group where it has less than this share of its mean light in the cells that it shines into, and fills less
// than that share of the hemisphere.
constexpr float cell_share_min = 1e-3f, coverage_min = 1e-5f;
// Choices take 8 bytes for each cell: a group of more emitters has patches of them.
constexpr uint32_t single_max = 1024, patches_max = 128;  // a power of two
// Halves of a patch lie apart along its longest side, or their normals do: these are so long, of its diagonal.
constexpr float normal_length = 0.6f;
// Every emitter sends out some of its group's rays, up to so many in all.
constexpr uint32_t rays_per_emitter = 128, probe_rays_max = 65536;
constexpr float lift_m = 1e-3f;  // off the emitter
// The house's receivers ask 3.6 of 16 groups, of which 1.1 shine there, and 5.8 with cells of 2 m.
constexpr float emitter_cell_min_m = 1;

glm::vec3 pointOn(const Emitter& e, glm::vec2 at) {
    return e.corner + e.edge1 * at.x + e.edge2 * at.y;
}

using Choice = EmitterSampler::Choice;

// Takes those of the least weight out that have `left_max` together at most. Keeps the order.
void leaveFaintest(std::vector<Choice>& choices, float left_max) {
    std::vector<float> weights;
    for (const Choice& c : choices) weights.push_back(c.cumulative);
    std::ranges::sort(weights);
    float left = 0;
    size_t count = 0;
    while (count + 1 < weights.size() && left + weights[count] <= left_max) left += weights[count++];
    std::erase_if(choices, [&](const Choice& c) { return c.cumulative < weights[count]; });
}

// Of weights. Summed up in double: a hundred thousand of them would add up to a thousandth more than 1.
void makeCumulative(std::vector<Choice>& choices) {
    double sum = 0, cumulative = 0;
    for (const Choice& c : choices) sum += static_cast<double>(c.cumulative);
    for (Choice& c : choices)
        c.cumulative = static_cast<float>((cumulative += static_cast<double>(c.cumulative)) / sum);
    if (!choices.empty()) choices.back().cumulative = 1;
}

// Of the numbers that choose, as they are rounded.
float probability(std::span<const Choice> choices, size_t i) {
    return choices[i].cumulative - (i == 0 ? 0 : choices[i - 1].cumulative);
}

struct Bounds {
    glm::vec3 low{INFINITY}, high{-INFINITY};
    void add(glm::vec3 p) { low = glm::min(low, p), high = glm::max(high, p); }
    glm::vec3 size() const { return high - low; }
};

glm::vec3 middleOf(const Emitter& e) {
    return e.corner + (e.edge1 + e.edge2) / 3.0f;
}

// Orders the emitters so that both halves lie together or face alike.
void splitInHalves(std::span<Emitter> emitters) {
    Bounds places, normals;
    for (const Emitter& e : emitters) {
        places.add(middleOf(e));
        normals.add(e.normal);
    }
    const auto longest = [](glm::vec3 v) { return v.x >= v.y && v.x >= v.z ? 0 : v.y >= v.z ? 1 : 2; };
    const int along = longest(places.size()), among = longest(normals.size());
    const bool by_normal = normal_length * glm::length(places.size()) * normals.size()[among] > places.size()[along];
    std::ranges::stable_sort(emitters, {},
                             [&](const Emitter& e) { return by_normal ? e.normal[among] : middleOf(e)[along]; });
}

}  // namespace

std::vector<uint32_t> meshGroups(const Scene& scene) {
    std::vector<uint32_t> groups;
    for (const SceneMesh& mesh : scene.meshes) groups.push_back(groupOf(mesh.light_set));
    return groups;
}

EmitterSampler::EmitterSampler(const RayScene& rays, std::span<const uint32_t> mesh_groups, size_t choices_max) {
    const Scene& scene = rays.scene();
    emitter_of_.assign(rays.triangles().size(), UINT32_MAX);
    for (uint32_t t = 0; t < rays.triangles().size(); ++t) {
        const LevelTriangle& triangle = rays.triangles()[t];
        const glm::vec3 radiance_cd_m2 = emissionOf(scene, scene.meshes[triangle.mesh], triangle.triangle);
        if (radiance_cd_m2 == glm::vec3(0)) continue;
        Emitter e{.triangle = t,
                  .group = mesh_groups[triangle.mesh],
                  .corner = rays.corner(t, 0),
                  .edge1 = rays.corner(t, 1) - rays.corner(t, 0),
                  .edge2 = rays.corner(t, 2) - rays.corner(t, 0),
                  .normal = triangle.normal,
                  .radiance_cd_m2 = radiance_cd_m2,
                  .double_sided = scene.materials[triangle.material].double_sided};
        e.area_m2 = 0.5f * glm::length(glm::cross(e.edge1, e.edge2));
        emitters_.push_back(e);
    }
    std::ranges::stable_sort(emitters_, {}, &Emitter::group);
    if (emitters_.empty()) return;
    for (uint32_t g = 0; g <= scene.light_sets.size(); ++g) identities_.push_back(groupIdentity(scene, g));
    makePatches();
    for (uint32_t i = 0; i < emitters_.size(); ++i) emitter_of_[emitters_[i].triangle] = i;

    grid_ = {rays.boundsMin(), rays.boundsMax(), emitter_cell_min_m};
    cells_.resize(grid_.count());
    std::vector<std::vector<uint8_t>> lit(identities_.size());
    tbb::parallel_for(size_t{0}, lit.size(), [&](size_t g) {
        const auto own = std::ranges::equal_range(emitters_, static_cast<uint32_t>(g), {}, &Emitter::group);
        if (!own.empty()) lit[g] = litCells(rays, {own.begin(), own.end()});
    });
    std::atomic<size_t> kept = 0;
    tbb::parallel_for(size_t{0}, cells_.size(),
                      [&](size_t i) { fillCell(static_cast<uint32_t>(i), lit, kept, choices_max); });
    leaveFaintGroups();
}

// Takes groups out of the cells where they are faint.
void EmitterSampler::leaveFaintGroups() {
    struct Group {
        double light = 0, cells = 0;
    };
    std::vector<Group> groups(identities_.size());
    for (const Cell& cell : cells_)
        for (const CellGroup& c : cell) {
            groups[c.group].light += static_cast<double>(c.light);
            ++groups[c.group].cells;
        }
    for (Cell& cell : cells_)
        std::erase_if(cell, [&](const CellGroup& c) {
            const double mean = groups[c.group].light / groups[c.group].cells;
            return !c.wide && static_cast<double>(c.light) < static_cast<double>(cell_share_min) * mean;
        });
}

// One for each emitter of a group, or, where these are many, halves of halves.
void EmitterSampler::makePatches() {
    patches_of_group_.resize(identities_.size());
    for (uint32_t begin = 0, end = 0; begin < emitters_.size(); begin = end) {
        while (end < emitters_.size() && emitters_[end].group == emitters_[begin].group) ++end;
        PatchRange& own = patches_of_group_[emitters_[begin].group];
        own.begin = static_cast<uint32_t>(patches_.size());
        if (end - begin <= single_max)
            for (uint32_t i = begin; i < end; ++i) addPatch(i, i + 1);
        else
            addHalves(begin, end, patches_max);
        own.end = static_cast<uint32_t>(patches_.size());
    }
}

void EmitterSampler::addHalves(uint32_t begin, uint32_t end, uint32_t patches) {
    if (patches == 1) return addPatch(begin, end);
    splitInHalves(std::span(emitters_).subspan(begin, end - begin));
    const uint32_t middle = begin + (end - begin) / 2;
    addHalves(begin, middle, patches / 2);
    addHalves(middle, end, patches / 2);
}

void EmitterSampler::addPatch(uint32_t begin, uint32_t end) {
    Patch p{.begin = begin, .end = end};
    const auto powerOf = [](const Emitter& e) { return luminance(e.radiance_cd_m2) * e.area_m2; };
    const auto own = std::span<const Emitter>(emitters_).subspan(begin, end - begin);
    std::vector<Choice> chances;
    for (const Emitter& e : own) {
        chances.push_back({0, powerOf(e)});
        p.power += powerOf(e);
        p.area_m2 += e.area_m2;
        p.brightest = std::max(p.brightest, luminance(e.radiance_cd_m2));
        p.double_sided = p.double_sided || e.double_sided;
        p.centre += middleOf(e) / static_cast<float>(own.size());
        p.normal += e.normal;
    }
    makeCumulative(chances);
    const float length = glm::length(p.normal);
    p.normal = length > 0 ? p.normal / length : own[0].normal;
    for (size_t i = 0; i < own.size(); ++i) {
        p.radius_m = std::max(p.radius_m, glm::distance(p.centre, middleOf(own[i])));
        p.normal_spread =
            std::max(p.normal_spread, std::acos(std::clamp(glm::dot(p.normal, own[i].normal), -1.0f, 1.0f)));
        within_.push_back(chances[i].cumulative);
        patch_of_emitter_.push_back(static_cast<uint32_t>(patches_.size()));
    }
    patches_.push_back(p);
}

// The largest cosine at a patch, about, of a way to a place within so much of the centre: of a lamp that is a ball half
// of the surface looks elsewhere.
float EmitterSampler::facing(const Patch& patch, glm::vec3 to_centre, float radius_m) {
    const float distance_m = glm::length(to_centre), reach_m = radius_m + patch.radius_m;
    if (distance_m <= reach_m) return 1;
    float cosine = glm::dot(to_centre, patch.normal) / distance_m;
    if (patch.double_sided) cosine = std::abs(cosine);
    if (patch.normal_spread > 0)
        cosine = std::cos(std::max(0.0f, std::acos(std::clamp(cosine, -1.0f, 1.0f)) - patch.normal_spread));
    return std::clamp(cosine + reach_m / distance_m, 0.0f, 1.0f);
}

std::vector<uint8_t> EmitterSampler::litCells(const RayScene& rays, std::span<const Emitter> of_group) const {
    const auto emitters = static_cast<uint32_t>(of_group.size());
    const uint32_t count = std::clamp(rays_per_emitter * emitters, emitter_probe_rays, probe_rays_max);
    const uint32_t seed = identities_[of_group[0].group];
    // No direction of a hemisphere is further from its nearest ray; those of neighbouring emitters help one another.
    const float far_m = glm::length(rays.boundsMax() - rays.boundsMin());
    const float spread = std::sqrt(2 * pi / static_cast<float>(std::min(count, emitter_probe_rays)));
    std::vector<uint8_t> marks(grid_.count());
    for (uint32_t i = 0; i < count; ++i) {
        const Emitter& e = of_group[i % emitters];
        const uint32_t own = i / emitters;
        const bool back = e.double_sided && own % 2 == 1;
        const glm::vec3 normal = back ? -e.normal : e.normal;
        glm::vec3 t, b;
        orthonormalBasis(normal, t, b);
        const glm::vec3 d = cosineDirection(sequence2d(own, hash(seed, 2 * e.triangle)));
        const glm::vec3 world = t * d.x + b * d.y + normal * d.z;
        const glm::vec3 from =
            pointOn(e, uniformOnTriangle(sequence2d(own, hash(seed, 2 * e.triangle + 1)))) + normal * lift_m;
        // Through doors, as what is behind them is lit once they open, and through panes, however little they let by.
        grid_.mark(from, world, rays.reach(from, world, far_m, Surfaces::Walls), spread, marks);
    }
    return marks;
}

EmitterSampler::Chances EmitterSampler::chancesAt(uint32_t cell, uint32_t group) const {
    const glm::vec3 centre = grid_.centre(cell);
    const float radius_m = 0.5f * std::sqrt(3.0f) * grid_.cellSize();
    Chances out;
    float brightest = 0;
    for (uint32_t i = patches_of_group_[group].begin; i < patches_of_group_[group].end; ++i) {
        const Patch& p = patches_[i];
        brightest = std::max(brightest, p.brightest);
        const glm::vec3 to_centre = centre - p.centre;
        const float near2 = radius_m * radius_m + p.area_m2;
        const float weight = p.power * facing(p, to_centre, radius_m) / std::max(glm::dot(to_centre, to_centre), near2);
        if (!(weight > 0)) continue;
        out.choices.push_back({i, weight});
        out.light += weight;
    }
    out.wide = out.light > coverage_min * pi * brightest;
    if (!(out.light > 0)) return {};
    leaveFaintest(out.choices, left_share_max * out.light);
    makeCumulative(out.choices);
    return out;
}

void EmitterSampler::fillCell(uint32_t cell, std::span<const std::vector<uint8_t>> lit, std::atomic<size_t>& kept,
                              size_t choices_max) {
    for (uint32_t g = 0; g < lit.size(); ++g) {
        if (lit[g].empty() || !lit[g][cell]) continue;
        Chances chances = chancesAt(cell, g);
        if (chances.choices.empty()) continue;
        // Which of them are kept changes nothing but time.
        if (kept.fetch_add(chances.choices.size()) + chances.choices.size() > choices_max) chances.choices = {};
        chances.choices.shrink_to_fit();
        cells_[cell].push_back({g, identities_[g], chances.light, chances.wide, cell, std::move(chances.choices)});
    }
}

std::span<const EmitterSampler::Choice> EmitterSampler::choicesOf(const CellGroup& from) const {
    if (!from.choices.empty()) return from.choices;
    auto& slots = recent_.local().slots;
    auto& slot = slots[hash(from.cell, from.identity) % slots.size()];
    if (slot.cell != from.cell || slot.group != from.group)
        slot = {from.cell, from.group, chancesAt(from.cell, from.group).choices};
    return slot.choices;
}

size_t EmitterSampler::keptChoices() const {
    size_t sum = 0;
    for (const Cell& cell : cells_)
        for (const CellGroup& group : cell) sum += group.choices.size();
    return sum;
}

std::span<const EmitterSampler::CellGroup> EmitterSampler::groups(uint32_t cell) const {
    if (emitters_.empty()) return {};
    return cells_[cell];
}

// As within_ is rounded.
float EmitterSampler::chanceWithin(uint32_t emitter) const {
    const uint32_t first = patches_[patch_of_emitter_[emitter]].begin;
    return within_[emitter] - (emitter == first ? 0 : within_[emitter - 1]);
}

EmitterSample EmitterSampler::sample(const CellGroup& from, glm::vec3 point, float choice, glm::vec2 u) const {
    const std::span<const Choice> choices = choicesOf(from);
    auto it = std::ranges::upper_bound(choices, choice, {}, &Choice::cumulative);
    if (it == choices.end()) --it;
    const auto index = static_cast<size_t>(it - choices.begin());
    float chance = probability(choices, index);
    const Patch& patch = patches_[it->patch];
    uint32_t emitter = patch.begin;
    if (patch.end - patch.begin > 1) {
        // What is left of the number that chose the patch.
        const float rest = (choice - (it->cumulative - chance)) / chance;
        const auto first = within_.begin() + patch.begin, last = within_.begin() + patch.end;
        emitter = std::min(static_cast<uint32_t>(std::upper_bound(first, last, rest) - within_.begin()), patch.end - 1);
        chance *= chanceWithin(emitter);
    }
    const Emitter& e = emitters_[emitter];
    const glm::vec2 at = uniformOnTriangle(u);
    const glm::vec3 to_target = pointOn(e, at) - point;
    const float distance2 = glm::dot(to_target, to_target);
    if (!(distance2 > 0)) return {};
    const float distance = std::sqrt(distance2);
    const glm::vec3 direction = to_target / distance;
    float cos_emitter = -glm::dot(direction, e.normal);
    if (e.double_sided) cos_emitter = std::abs(cos_emitter);
    if (!(cos_emitter > 0)) return {};
    const float pdf = chance * distance2 / (e.area_m2 * cos_emitter);
    return {direction, distance, e.radiance_cd_m2, e.triangle, at, pdf};
}

const Emitter* EmitterSampler::emitterOf(uint32_t triangle) const {
    return emitters_.empty() || emitter_of_[triangle] == UINT32_MAX ? nullptr : &emitters_[emitter_of_[triangle]];
}

float EmitterSampler::pdf(uint32_t cell, const Emitter& emitter, float distance_m, float cos_emitter) const {
    const auto index = static_cast<uint32_t>(&emitter - emitters_.data());
    for (const CellGroup& from : groups(cell)) {
        if (from.group != emitter.group) continue;
        const uint32_t patch = patch_of_emitter_[index];
        const std::span<const Choice> choices = choicesOf(from);
        const auto it = std::ranges::lower_bound(choices, patch, {}, &Choice::patch);
        if (it == choices.end() || it->patch != patch) return 0;
        return probability(choices, static_cast<size_t>(it - choices.begin())) * chanceWithin(index) * distance_m *
               distance_m / (emitter.area_m2 * std::max(cos_emitter, 1e-6f));
    }
    return 0;
}

}  // namespace dimmer::cook
