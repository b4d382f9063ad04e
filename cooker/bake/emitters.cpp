#include <bake/emitters.h>

#include <bake/sampling.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace dimmer::cook {
namespace {

// The faintest emitters of a group in a cell, which have this share of its light there together, are left to the gather
// rays: they still find them, with full weight, so nothing is lost, but seldom.
constexpr float left_share_max = 1e-3f;
// So is a group where it has less than this share of its mean light in the cells that it shines into, and fills less
// than that share of the hemisphere.
constexpr float cell_share_min = 1e-3f, coverage_min = 1e-5f;
// Choices take 12 bytes for each cell: of more, all cells share those by power. So many more are not even sorted.
constexpr size_t choices_max = 1024, sorted_max = 8 * choices_max;
// Every emitter sends out some of its group's rays, up to so many in all.
constexpr uint32_t rays_per_emitter = 128, probe_rays_max = 65536;
constexpr float lift_m = 1e-3f;  // off the emitter
// The house's receivers ask 3.6 of 16 groups, of which 1.1 shine there, and 5.8 with cells of 2 m.
constexpr float emitter_cell_min_m = 1;

// Uniform on a triangle: the unit square, folded. As Hit::u and v.
glm::vec2 onTriangle(glm::vec2 u) {
    return std::sqrt(u.x) * glm::vec2(1 - u.y, u.y);
}
glm::vec3 pointOn(const Emitter& e, glm::vec2 at) {
    return e.corner + e.edge1 * at.x + e.edge2 * at.y;
}

// Takes those of the least weight out that have `left_max` together at most. Keeps the order.
void leaveFaintest(auto& choices, float left_max) {
    std::vector<float> weights;
    for (const auto& c : choices) weights.push_back(c.probability);
    std::ranges::sort(weights);
    float left = 0;
    size_t count = 0;
    while (count + 1 < weights.size() && left + weights[count] <= left_max) left += weights[count++];
    std::erase_if(choices, [&](const auto& c) { return c.probability < weights[count]; });
}

// Of weights, as probabilities. Summed up in double: a hundred thousand of them would add up to a thousandth more
// than 1.
void makeProbabilities(auto& choices) {
    double sum = 0, cumulative = 0;
    for (const auto& c : choices) sum += static_cast<double>(c.probability);
    for (auto& c : choices) {
        cumulative += static_cast<double>(c.probability);
        c.probability = static_cast<float>(static_cast<double>(c.probability) / sum);
        c.cumulative = static_cast<float>(cumulative / sum);
    }
}

}  // namespace

std::vector<uint32_t> meshGroups(const Scene& scene) {
    std::vector<uint32_t> groups;
    for (const SceneMesh& mesh : scene.meshes) groups.push_back(groupOf(mesh.light_set));
    return groups;
}

EmitterSampler::EmitterSampler(const RayScene& rays, std::span<const uint32_t> mesh_groups) {
    const Scene& scene = rays.scene();
    emitter_of_.assign(rays.triangles().size(), UINT32_MAX);
    for (uint32_t t = 0; t < rays.triangles().size(); ++t) {
        const LevelTriangle& triangle = rays.triangles()[t];
        const Material& material = scene.materials[triangle.material];
        if (material.emission_cd_m2 == glm::vec3(0)) continue;
        Emitter e{.triangle = t,
                  .group = mesh_groups[triangle.mesh],
                  .corner = rays.corner(t, 0),
                  .edge1 = rays.corner(t, 1) - rays.corner(t, 0),
                  .edge2 = rays.corner(t, 2) - rays.corner(t, 0),
                  .normal = triangle.normal,
                  .radiance_cd_m2 = material.emission_cd_m2,
                  .double_sided = material.double_sided};
        e.area_m2 = 0.5f * glm::length(glm::cross(e.edge1, e.edge2));
        emitters_.push_back(e);
    }
    std::ranges::stable_sort(emitters_, {}, &Emitter::group);
    for (uint32_t i = 0; i < emitters_.size(); ++i) emitter_of_[emitters_[i].triangle] = i;
    if (emitters_.empty()) return;
    for (uint32_t g = 0; g <= scene.light_sets.size(); ++g) identities_.push_back(groupIdentity(scene, g));

    grid_ = {rays.boundsMin(), rays.boundsMax(), emitter_cell_min_m};
    cells_.resize(grid_.count());
    std::vector<std::span<const Emitter>> groups;
    for (size_t begin = 0, end = 0; begin < emitters_.size(); begin = end) {
        while (end < emitters_.size() && emitters_[end].group == emitters_[begin].group) ++end;
        groups.push_back({&emitters_[begin], end - begin});
    }
    std::vector<std::vector<uint8_t>> lit(groups.size());
    tbb::parallel_for(size_t{0}, groups.size(), [&](size_t g) { lit[g] = litCells(rays, groups[g]); });
    tbb::parallel_for(size_t{0}, cells_.size(), [&](size_t i) { fillCell(i, lit); });
    gatherCells();
}

// All cells' ranges and choices in one array each, without the groups that are faint there.
void EmitterSampler::gatherCells() {
    struct Group {
        double light = 0, cells = 0;
        std::optional<GroupRange> by_power;
    };
    std::vector<Group> groups(identities_.size());
    for (const Cell& cell : cells_)
        for (const CellRange& r : cell) {
            groups[r.group].light += static_cast<double>(r.light);
            ++groups[r.group].cells;
        }
    first_range_.push_back(0);
    for (Cell& cell : cells_) {
        for (const CellRange& r : cell) {
            Group& group = groups[r.group];
            const double least = static_cast<double>(cell_share_min) * group.light / group.cells;
            if (!r.wide && static_cast<double>(r.light) < least) continue;
            if (r.choices.empty() && !group.by_power) group.by_power = store(r.group, choicesByPower(r.group));
            ranges_.push_back(r.choices.empty() ? *group.by_power : store(r.group, r.choices));
        }
        first_range_.push_back(static_cast<uint32_t>(ranges_.size()));
        cell = {};
    }
    cells_ = {};
}

EmitterSampler::GroupRange EmitterSampler::store(uint32_t group, std::span<const Choice> choices) {
    const auto first = static_cast<uint32_t>(choices_.size());
    choices_.insert(choices_.end(), choices.begin(), choices.end());
    return {group, identities_[group], first, static_cast<uint32_t>(choices.size())};
}

std::vector<EmitterSampler::Choice> EmitterSampler::choicesByPower(uint32_t group) const {
    std::vector<Choice> choices;
    for (uint32_t i = 0; i < emitters_.size(); ++i)
        if (emitters_[i].group == group)
            choices.push_back({i, luminance(emitters_[i].radiance_cd_m2) * emitters_[i].area_m2, 0});
    makeProbabilities(choices);
    return choices;
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
            pointOn(e, onTriangle(sequence2d(own, hash(seed, 2 * e.triangle + 1)))) + normal * lift_m;
        // Through doors: what is behind them is lit once they open.
        const auto hit = rays.nearest(from, world, far_m, hash(seed, i), Surfaces::Walls);
        grid_.mark(from, world, hit ? hit->distance_m : far_m, spread, marks);
    }
    return marks;
}

void EmitterSampler::fillCell(size_t index, std::span<const std::vector<uint8_t>> lit) {
    const glm::vec3 centre = grid_.centre(index);
    const float radius_m = 0.5f * std::sqrt(3.0f) * grid_.cellSize();
    for (size_t begin = 0, g = 0; begin < emitters_.size(); ++g) {
        size_t end = begin;
        while (end < emitters_.size() && emitters_[end].group == emitters_[begin].group) ++end;
        const size_t range_begin = std::exchange(begin, end);
        if (!lit[g][index]) continue;
        std::vector<Choice> choices;
        float sum = 0, brightest = 0;
        for (size_t i = range_begin; i < end; ++i) {
            const Emitter& e = emitters_[i];
            const glm::vec3 to_centre = centre - (e.corner + (e.edge1 + e.edge2) / 3.0f);
            brightest = std::max(brightest, luminance(e.radiance_cd_m2));
            if (!e.double_sided && glm::dot(centre - e.corner, e.normal) < -radius_m) continue;
            const float near2 = radius_m * radius_m + e.area_m2;
            const float weight =
                luminance(e.radiance_cd_m2) * e.area_m2 / std::max(glm::dot(to_centre, to_centre), near2);
            choices.push_back({static_cast<uint32_t>(i), weight, 0});
            sum += weight;
        }
        if (!(sum > 0)) continue;
        if (choices.size() <= sorted_max) leaveFaintest(choices, left_share_max * sum);
        if (choices.size() > choices_max) choices = {};
        makeProbabilities(choices);
        choices.shrink_to_fit();
        cells_[index].push_back(
            {emitters_[range_begin].group, sum, sum > coverage_min * pi * brightest, std::move(choices)});
    }
}

std::span<const EmitterSampler::GroupRange> EmitterSampler::groups(uint32_t cell) const {
    if (emitters_.empty()) return {};
    return {ranges_.data() + first_range_[cell], first_range_[cell + 1] - first_range_[cell]};
}

EmitterSample EmitterSampler::sample(const GroupRange& range, glm::vec3 point, float choice, glm::vec2 u) const {
    const auto begin = choices_.begin() + range.first, end = begin + range.count;
    auto it = std::upper_bound(begin, end, choice, [](float v, const Choice& c) { return v < c.cumulative; });
    if (it == end) --it;
    const Emitter& e = emitters_[it->emitter];
    const glm::vec2 at = onTriangle(u);
    const glm::vec3 to_target = pointOn(e, at) - point;
    const float distance2 = glm::dot(to_target, to_target);
    if (!(distance2 > 0)) return {};
    const float distance = std::sqrt(distance2);
    const glm::vec3 direction = to_target / distance;
    float cos_emitter = -glm::dot(direction, e.normal);
    if (e.double_sided) cos_emitter = std::abs(cos_emitter);
    if (!(cos_emitter > 0)) return {};
    const float pdf = it->probability * distance2 / (e.area_m2 * cos_emitter);
    return {direction, distance, e.radiance_cd_m2, e.triangle, at, pdf};
}

const Emitter* EmitterSampler::emitterOf(uint32_t triangle) const {
    return emitters_.empty() || emitter_of_[triangle] == UINT32_MAX ? nullptr : &emitters_[emitter_of_[triangle]];
}

float EmitterSampler::pdf(uint32_t cell, const Emitter& emitter, float distance_m, float cos_emitter) const {
    const auto index = static_cast<uint32_t>(&emitter - emitters_.data());
    for (const GroupRange& r : groups(cell)) {
        if (r.group != emitter.group) continue;
        const auto begin = choices_.begin() + r.first, end = begin + r.count;
        const auto it = std::lower_bound(begin, end, index, [](const Choice& c, uint32_t i) { return c.emitter < i; });
        if (it == end || it->emitter != index) return 0;
        return it->probability * distance_m * distance_m / (emitter.area_m2 * std::max(cos_emitter, 1e-6f));
    }
    return 0;
}

}  // namespace dimmer::cook
