#include <bake/emitters.h>

#include <bake/sampling.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace dimmer::cook {
namespace {

// The faintest emitters of a group in a cell, which have this share of its light there together, are left to the gather
// rays: they still find them, with full weight, so nothing is lost, but seldom.
constexpr float left_share_max = 1e-3f;
// So is a group where it has less than this share of its mean light in the cells that it shines into.
constexpr float cell_share_min = 1e-3f;
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

// Takes those of the least weight out, from `first` on, that have `left_max` together at most. Keeps the order.
void leaveFaintest(auto& choices, size_t first, float left_max) {
    std::vector<float> weights;
    for (size_t i = first; i < choices.size(); ++i) weights.push_back(choices[i].probability);
    std::ranges::sort(weights);
    float left = 0;
    size_t count = 0;
    while (count + 1 < weights.size() && left + weights[count] <= left_max) left += weights[count++];
    const auto tail = std::remove_if(choices.begin() + static_cast<long>(first), choices.end(),
                                     [&](const auto& c) { return c.probability < weights[count]; });
    choices.erase(tail, choices.end());
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
    std::vector<double> light(identities_.size()), cells(identities_.size());
    for (const Cell& cell : cells_)
        for (size_t r = 0; r < cell.ranges.size(); ++r) {
            light[cell.ranges[r].group] += static_cast<double>(cell.light[r]);
            ++cells[cell.ranges[r].group];
        }
    first_range_.push_back(0);
    for (const Cell& cell : cells_) {
        for (size_t r = 0; r < cell.ranges.size(); ++r) {
            GroupRange range = cell.ranges[r];
            if (static_cast<double>(cell.light[r] / cell_share_min) * cells[range.group] < light[range.group]) continue;
            const auto choices = std::span(cell.choices).subspan(range.first, range.count);
            range.first = static_cast<uint32_t>(choices_.size());
            choices_.insert(choices_.end(), choices.begin(), choices.end());
            ranges_.push_back(range);
        }
        first_range_.push_back(static_cast<uint32_t>(ranges_.size()));
    }
    cells_ = {};
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
    Cell& cell = cells_[index];
    const glm::vec3 centre = grid_.centre(index);
    const float radius_m = 0.5f * std::sqrt(3.0f) * grid_.cellSize();
    for (size_t begin = 0, g = 0; begin < emitters_.size(); ++g) {
        const uint32_t group = emitters_[begin].group;
        const size_t first = cell.choices.size();
        float sum = 0;
        size_t end = begin;
        while (end < emitters_.size() && emitters_[end].group == group) ++end;
        const size_t range_begin = std::exchange(begin, end);
        if (!lit[g][index]) continue;
        for (size_t i = range_begin; i < end; ++i) {
            const Emitter& e = emitters_[i];
            const glm::vec3 to_centre = centre - (e.corner + (e.edge1 + e.edge2) / 3.0f);
            if (!e.double_sided && glm::dot(centre - e.corner, e.normal) < -radius_m) continue;
            const float near2 = radius_m * radius_m + e.area_m2;
            const float weight =
                luminance(e.radiance_cd_m2) * e.area_m2 / std::max(glm::dot(to_centre, to_centre), near2);
            cell.choices.push_back({static_cast<uint32_t>(i), weight, 0});
            sum += weight;
        }
        if (!(sum > 0)) {
            cell.choices.resize(first);
            continue;
        }
        leaveFaintest(cell.choices, first, left_share_max * sum);
        cell.light.push_back(sum);
        float kept = 0, cumulative = 0;
        for (size_t i = first; i < cell.choices.size(); ++i) kept += cell.choices[i].probability;
        for (size_t i = first; i < cell.choices.size(); ++i) {
            cell.choices[i].probability /= kept;
            cumulative += cell.choices[i].probability;
            cell.choices[i].cumulative = cumulative;
        }
        cell.ranges.push_back({group, identities_[group], static_cast<uint32_t>(first),
                               static_cast<uint32_t>(cell.choices.size() - first)});
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
