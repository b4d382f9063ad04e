#include <models/model_receivers.h>

#include <bake/sampling.h>
#include <models/scene_models.h>
#include <probes/free_space.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace dimmer::cook {
namespace {

// Probes stand on the floor that a model stands on: shares of the way to the model's middle that are tried.
constexpr std::array<float, 7> ways_in = {0.03f, 0.06f, 0.1f, 0.18f, 0.3f, 0.45f, 0.6f};
constexpr float clearance_m = 0.02f;
// Points of a model's surface: so many to a triangle at least, and one to each quarter of the probes' spacing, squared.
constexpr uint32_t points_per_triangle = 16, points_per_triangle_max = 4096;
constexpr float spacings_per_point = 0.25f;
constexpr size_t points_per_receiver = 16;
constexpr float lift_m = 1e-3f;

struct NearNormals {
    std::array<uint32_t, 3> index;
    std::array<float, 3> share;
};

// The corners of an octahedron (+x -x +y -y +z -z), then the middles of its edges.
uint32_t cornerIndex(int axis, bool negative) {
    return static_cast<uint32_t>(2 * axis) + negative;
}
// Of the edge between two axes, the one that `third` is not; by the signs of the two.
uint32_t edgeIndex(int third, bool negative_a, bool negative_b) {
    return 6 + static_cast<uint32_t>(4 * third) + 2 * negative_a + negative_b;
}

glm::vec3 normalAt(uint32_t index) {
    glm::vec3 n(0);
    if (index < 6) {
        n[static_cast<int>(index / 2)] = index % 2 ? -1.0f : 1.0f;
        return n;
    }
    const auto third = static_cast<int>((index - 6) / 4);
    const int a = (third + 1) % 3, b = (third + 2) % 3;
    n[a] = (index - 6) / 2 % 2 ? -1.0f : 1.0f;
    n[b] = (index - 6) % 2 ? -1.0f : 1.0f;
    return n * std::sqrt(0.5f);
}

// Linear over the octahedron's faces, each cut in four.
NearNormals nearNormals(glm::vec3 n) {
    const glm::vec3 size = glm::abs(n), share = size / (size.x + size.y + size.z);
    const auto edge = [&](int third) { return edgeIndex(third, n[(third + 1) % 3] < 0, n[(third + 2) % 3] < 0); };
    for (int axis = 0; axis < 3; ++axis) {
        if (!(share[axis] > 0.5f)) continue;
        const int b = (axis + 1) % 3, c = (axis + 2) % 3;
        return {{cornerIndex(axis, n[axis] < 0), edge(c), edge(b)}, {2 * share[axis] - 1, 2 * share[b], 2 * share[c]}};
    }
    return {{edge(0), edge(1), edge(2)}, {1 - 2 * share[0], 1 - 2 * share[1], 1 - 2 * share[2]}};
}

template <size_t count>
uint32_t drawn(const std::array<uint32_t, count>& from, const std::array<float, count>& shares, float chance) {
    for (size_t i = 0; i + 1 < count; ++i)
        if ((chance -= shares[i]) < 0) return from[i];
    return from[count - 1];
}

float areaPerPoint(const SceneModel& model) {
    const glm::vec3 spacing = (model.max_m - model.min_m) / glm::vec3(model.probes - 1u);
    const float side = spacings_per_point * std::max({spacing.x, spacing.y, spacing.z});
    return side * side;
}

// What light finds at a point of a surface.
struct Reflector {
    float alpha = 1;  // the share that is stopped there
    glm::vec3 reflectance{0};
};

// visit(point, normal, area, reflector) for points spread over a model's lit sides.
void forSurface(const RayScene& rays, uint32_t model, auto&& visit) {
    const Scene& scene = rays.scene();
    const float area_per_point = areaPerPoint(scene.models[model]);
    forTriangles(rays, model, [&](uint32_t t, const LevelTriangle& triangle) {
        const Material& material = scene.materials[triangle.material];
        const glm::vec3 a = rays.corner(t, 0);
        const float area = 0.5f * glm::length(glm::cross(rays.corner(t, 1) - a, rays.corner(t, 2) - a));
        const float by_area =
            std::ceil(std::min(area / std::max(area_per_point, 1e-12f), float{points_per_triangle_max}));
        const uint32_t points = std::max(points_per_triangle, static_cast<uint32_t>(by_area));
        for (uint32_t i = 0; i < points; ++i) {
            const glm::vec2 on = uniformOnTriangle(sequence2d(i, t));
            const glm::vec3 point_m = rays.pointOn(t, on.x, on.y);
            const Reflector at{rays.alphaAt(t, on.x, on.y),
                               material.reflectance(glm::vec3(rays.surfaceColor(t, on.x, on.y)))};
            visit(point_m, triangle.normal, area / static_cast<float>(points), at);
            if (material.double_sided) visit(point_m, -triangle.normal, area / static_cast<float>(points), at);
        }
    });
}

// Of the points of a surface that count for a receiver, some are drawn without replacement, by weight (Efraimidis and
// Spirakis 2006). A surface may lie in other geometry for the most part: more are kept than are needed.
class DrawnPoints {
   public:
    void offer(uint32_t point, float weight, uint32_t chance) {
        if (!(weight > 0)) return;
        drawn_.emplace_back(-std::log(1 - unitFloat(chance)) / weight, point);
        if (drawn_.size() >= 2 * kept) prune();
    }
    void prune() {
        std::ranges::sort(drawn_);
        drawn_.resize(std::min(drawn_.size(), kept));
    }
    // Ascending in order of the draw, with numbers of points.
    std::span<const std::pair<float, uint32_t>> drawn() const { return drawn_; }

   private:
    static constexpr size_t kept = 4 * points_per_receiver;
    std::vector<std::pair<float, uint32_t>> drawn_;
};

// Per point, whether it is in the open; asked for those that were drawn.
std::vector<uint8_t> openAmong(const RayScene& rays, uint32_t model, std::span<const glm::vec3> points,
                               std::span<DrawnPoints> drawn) {
    std::vector<uint8_t> asked(points.size()), open(points.size());
    for (DrawnPoints& d : drawn) {
        d.prune();
        for (const auto& [order, point] : d.drawn()) asked[point] = 1;
    }
    tbb::parallel_for(size_t{0}, points.size(),
                      [&](size_t i) { open[i] = asked[i] && inTheOpen(rays, points[i], model, 0); });
    return open;
}

}  // namespace

NearProbes nearProbes(const SceneModel& model, glm::vec3 point_m) {
    const glm::vec3 inside = glm::transpose(model.world_from_model) * (point_m - model.origin_m) - model.min_m;
    const glm::vec3 last = glm::vec3(model.probes - 1u);
    const glm::vec3 at = glm::clamp(inside / (model.max_m - model.min_m) * last, glm::vec3(0), last);
    const glm::uvec3 low = glm::min(glm::uvec3(at), model.probes - 2u);
    const glm::vec3 along = at - glm::vec3(low);
    NearProbes near;
    for (uint32_t corner = 0; corner < 8; ++corner) {
        const glm::uvec3 step(corner & 1, corner >> 1 & 1, corner >> 2), cell = low + step;
        near.number[corner] = cell.x + model.probes.x * (cell.y + model.probes.y * cell.z);
        near.share[corner] = 1;
        for (int i = 0; i < 3; ++i) near.share[corner] *= step[i] ? along[i] : 1 - along[i];
    }
    return near;
}

TangentFrame receiverFrame(uint32_t face) {
    TangentFrame frame;
    frame.normal = normalAt(face - first_receiver_face);
    orthonormalBasis(frame.normal, frame.tangent, frame.bitangent);
    return frame;
}

ProbePlaces probePlaces(const RayScene& rays) {
    return ModelReceivers(rays, false).places();
}

ModelReceivers::ModelReceivers(const RayScene& rays) : ModelReceivers(rays, true) {}

ModelReceivers::ModelReceivers(const RayScene& rays, bool with_receivers) : rays_(rays) {
    const auto& models = rays.scene().models;
    if (std::ranges::none_of(models, [](const SceneModel& m) { return !m.moves; })) return;
    models_.resize(models.size());
    for (uint32_t m = 0; m < models.size(); ++m) {
        if (models[m].moves) continue;
        placeProbes(m);
        if (with_receivers) makeReceivers(m);
    }
    first_point_.push_back(static_cast<uint32_t>(points_.size()));
}

void ModelReceivers::placeProbes(uint32_t index) {
    const SceneModel& model = rays_.scene().models[index];
    const uint32_t first = models_[index].first_probe = static_cast<uint32_t>(places_.position_m.size());
    const uint32_t count = model.probes.x * model.probes.y * model.probes.z;
    const glm::vec3 middle = model.world(0.5f * (model.min_m + model.max_m));
    std::vector<uint8_t> open(count);
    places_.position_m.resize(first + count);
    places_.source.resize(first + count);
    model_of_probe_.resize(first + count, index);
    tbb::parallel_for(0u, count, [&](uint32_t i) {
        const glm::vec3 corner = probePosition(model, i);
        places_.position_m[first + i] = corner;
        for (const float way : ways_in) {
            const glm::vec3 p = glm::mix(corner, middle, way);
            open[i] = inTheOpen(rays_, p, index, clearance_m);
            if (!open[i]) continue;
            places_.position_m[first + i] = p;
            return;
        }
    });
    for (uint32_t i = 0; i < count; ++i) {
        places_.source[first + i] = no_index;
        float nearest = std::numeric_limits<float>::infinity();
        for (uint32_t k = 0; k < count; ++k) {
            const float distance = glm::distance(probePosition(model, i), probePosition(model, k));
            if (open[k] && distance < nearest) nearest = distance, places_.source[first + i] = first + k;
        }
    }
}

// A receiver for each probe that is in the open and each normal that is near to one of the surface's.
void ModelReceivers::makeReceivers(uint32_t index) {
    Model& model = models_[index];
    const SceneModel& scene_model = rays_.scene().models[index];
    model.slots.fill(no_index);
    glm::vec3 reflected(0);
    float stopping_m2 = 0;  // without what is cut out, where no ray ends
    forSurface(rays_, index, [&](glm::vec3, glm::vec3 normal, float area, const Reflector& at) {
        const NearNormals near = nearNormals(normal);
        for (size_t i = 0; i < 3; ++i)
            if (near.share[i] > 0 && model.slots[near.index[i]] == no_index)
                model.slots[near.index[i]] = model.slot_count++;
        const float stops_m2 = at.alpha * area;
        reflected += stops_m2 * at.reflectance;
        stopping_m2 += stops_m2;
    });
    if (stopping_m2 > 0) model.reflectance = reflected / stopping_m2;
    model.first_receiver = static_cast<uint32_t>(model_.size());
    const uint32_t probes = scene_model.probes.x * scene_model.probes.y * scene_model.probes.z;
    const size_t first = area_m2_.size(), count = size_t{probes} * model.slot_count;
    area_m2_.resize(first + count);
    model_.resize(first + count, index);
    std::vector<DrawnPoints> drawn(count);
    std::vector<glm::vec3> surface;
    forSurface(rays_, index, [&](glm::vec3 point, glm::vec3 normal, float area, const Reflector&) {
        const NearNormals normals = nearNormals(normal);
        const NearProbes near = nearProbes(scene_model, point);
        const auto number = static_cast<uint32_t>(surface.size());
        surface.push_back(point + lift_m * normal);
        for (size_t n = 0; n < 3; ++n)
            for (size_t k = 0; k < 8; ++k) {
                const uint32_t source = places_.source[model.first_probe + near.number[k]];
                const uint32_t slot = model.slots[normals.index[n]];
                if (source == no_index || slot == no_index) continue;
                const uint32_t receiver = (source - model.first_probe) * model.slot_count + slot;
                const float share = area * normals.share[n] * near.share[k];
                area_m2_[first + receiver] += share;
                drawn[receiver].offer(number, share, hash(number, receiver));
            }
    });
    const std::vector<uint8_t> open = openAmong(rays_, index, surface, drawn);
    for (uint32_t p = 0; p < probes; ++p)
        for (uint32_t s = 0; s < model.slot_count; ++s) {
            const auto normal = static_cast<uint32_t>(std::ranges::find(model.slots, s) - model.slots.begin());
            const size_t first_point = points_.size();
            first_point_.push_back(static_cast<uint32_t>(first_point));
            for (const auto& [order, point] : drawn[size_t{p} * model.slot_count + s].drawn())
                if (open[point] && points_.size() < first_point + points_per_receiver)
                    points_.push_back({surface[point], first_receiver_face + normal});
            if (points_.size() == first_point)
                points_.push_back({places_.position_m[model.first_probe + p], first_receiver_face + normal});
        }
}

uint32_t ModelReceivers::pick(uint32_t index, glm::vec3 point_m, glm::vec3 normal, uint32_t chance) const {
    const Model& model = models_[index];
    const NearNormals normals = nearNormals(normal);
    const NearProbes near = nearProbes(rays_.scene().models[index], point_m);
    const uint32_t probe = drawn(near.number, near.share, unitFloat(hash(chance, 1)));
    const uint32_t source = places_.source[model.first_probe + probe];
    const uint32_t slot = model.slots[drawn(normals.index, normals.share, unitFloat(hash(chance, 2)))];
    if (source == no_index || slot == no_index) return no_index;
    return model.first_receiver + (source - model.first_probe) * model.slot_count + slot;
}

}  // namespace dimmer::cook
