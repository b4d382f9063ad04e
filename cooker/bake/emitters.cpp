#include <bake/emitters.h>

#include <bake/sampling.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

// An emitter with less than this share of its group's light in a cell is left to the gather rays: they still find it,
// with full weight, so nothing is lost.
constexpr float choice_share_min = 1e-3f;
// A group that fills less than this share of the hemisphere from a cell is left to them too.
constexpr float coverage_min = 1e-5f;

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

    grid_ = {rays.boundsMin(), rays.boundsMax()};
    cells_.resize(grid_.count());
    const float radius = 0.5f * std::sqrt(3.0f) * grid_.cellSize();
    tbb::parallel_for(size_t{0}, cells_.size(), [&](size_t i) { fillCell(cells_[i], grid_.centre(i), radius); });
    first_range_.push_back(0);
    for (Cell& cell : cells_) {
        for (GroupRange r : cell.ranges) {
            r.first += static_cast<uint32_t>(choices_.size());
            ranges_.push_back(r);
        }
        choices_.insert(choices_.end(), cell.choices.begin(), cell.choices.end());
        first_range_.push_back(static_cast<uint32_t>(ranges_.size()));
    }
    cells_ = {};
}

void EmitterSampler::fillCell(Cell& cell, glm::vec3 centre, float radius_m) const {
    for (size_t begin = 0; begin < emitters_.size();) {
        const uint32_t group = emitters_[begin].group;
        const size_t first = cell.choices.size();
        float sum = 0, brightest = 0;
        size_t end = begin;
        for (; end < emitters_.size() && emitters_[end].group == group; ++end) {
            const Emitter& e = emitters_[end];
            const glm::vec3 to_centre = centre - (e.corner + (e.edge1 + e.edge2) / 3.0f);
            brightest = std::max(brightest, luminance(e.radiance_cd_m2));
            if (!e.double_sided && glm::dot(centre - e.corner, e.normal) < -radius_m) continue;
            const float near2 = radius_m * radius_m + e.area_m2;
            const float weight =
                luminance(e.radiance_cd_m2) * e.area_m2 / std::max(glm::dot(to_centre, to_centre), near2);
            cell.choices.push_back({static_cast<uint32_t>(end), weight, 0});
            sum += weight;
        }
        begin = end;
        auto keep = [&](const Choice& c) { return c.probability >= choice_share_min * sum; };
        const auto tail =
            std::stable_partition(cell.choices.begin() + static_cast<long>(first), cell.choices.end(), keep);
        cell.choices.erase(tail, cell.choices.end());
        if (!(sum > coverage_min * pi * brightest) || cell.choices.size() == first) {
            cell.choices.resize(first);
            continue;
        }
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

EmitterSample EmitterSampler::sample(const GroupRange& range, glm::vec3 point, float choice,
                                     glm::vec2 on_triangle) const {
    const auto begin = choices_.begin() + range.first, end = begin + range.count;
    auto it = std::upper_bound(begin, end, choice, [](float v, const Choice& c) { return v < c.cumulative; });
    if (it == end) --it;
    const Emitter& e = emitters_[it->emitter];
    // Uniform on a triangle: fold the unit square.
    const float root = std::sqrt(on_triangle.x);
    const glm::vec3 target = e.corner + e.edge1 * (root * (1 - on_triangle.y)) + e.edge2 * (root * on_triangle.y);
    const glm::vec3 to_target = target - point;
    const float distance2 = glm::dot(to_target, to_target);
    if (!(distance2 > 0)) return {};
    const float distance = std::sqrt(distance2);
    const glm::vec3 direction = to_target / distance;
    float cos_emitter = -glm::dot(direction, e.normal);
    if (e.double_sided) cos_emitter = std::abs(cos_emitter);
    if (!(cos_emitter > 0)) return {};
    return {direction, distance, e.radiance_cd_m2, e.triangle, it->probability * distance2 / (e.area_m2 * cos_emitter)};
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
