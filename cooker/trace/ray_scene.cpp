#include <trace/ray_scene.h>

#include <bake/sampling.h>

#include <embree3/rtcore.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <new>
#include <tuple>
#include <type_traits>

namespace dimmer::cook {
namespace {

// Kinds of surfaces are geometries of their own: what must be asked for its alpha, so that opaque rays skip it, and
// leaves among walls, which collect rays and stop none. Kind k has Embree's ray mask 1 << k.
enum Kind : unsigned { opaque, transparent, opaque_leaf, transparent_leaf, kinds };
constexpr unsigned mask_opaque = 1 << opaque, mask_transparent = 1 << transparent;
constexpr unsigned mask_leaves = 1 << opaque_leaf | 1 << transparent_leaf;
// After passing a transparent surface a ray starts anew this far behind it.
constexpr float step_past_m = 1e-4f;
// A ray that passes more surfaces than this is taken to be stopped; real levels stack a handful.
constexpr int transparent_layers_max = 64;
// A ray that passes a model which is not there may meet many of its surfaces.
constexpr int hits_max = 1024;
// Whether a ray passes is drawn apart from where it goes.
constexpr uint32_t transparency_seed = 0x3f84d5b5u;

// What a ray carries along: where it leaves the leaves that it meets.
struct Collector {
    RTCIntersectContext context;  // first, so that Embree's pointer to it is ours
    LeafHits* leaves;             // null: they are passed by

    explicit Collector(LeafHits* into) : leaves(into) { rtcInitIntersectContext(&context); }
};

void collect(const RTCFilterFunctionNArguments* args) {
    auto* const into = reinterpret_cast<Collector*>(args->context)->leaves;
    const auto* ray = reinterpret_cast<const RTCRay*>(args->ray);
    const auto* hit = reinterpret_cast<const RTCHit*>(args->hit);
    args->valid[0] = 0;  // go on
    if (!into) return;
    LeafHits& leaves = *into;
    const uint32_t triangle = static_cast<const uint32_t*>(args->geometryUserPtr)[hit->primID];
    // A triangle may be split among Embree's nodes, and be met in each.
    if (std::ranges::find(leaves, triangle, &Hit::triangle) != leaves.end()) return;
    const Hit found{triangle, ray->tfar, hit->u, hit->v, false};
    if (leaves.count < LeafHits::max) {
        leaves.hits[leaves.count++] = found;
        return;
    }
    // The nearest are kept: what lies behind the wall, which may not be found yet, must not push them out.
    Hit& farthest = *std::ranges::max_element(leaves, {}, &Hit::distance_m);
    if (found.distance_m < farthest.distance_m) farthest = found;
}

}  // namespace

struct RayScene::Embree {
    struct Release {
        void operator()(RTCDevice d) const { rtcReleaseDevice(d); }
        void operator()(RTCScene s) const { rtcReleaseScene(s); }
    };
    template <class Object>
    using Handle = std::unique_ptr<std::remove_pointer_t<Object>, Release>;

    Handle<RTCDevice> device{rtcNewDevice(nullptr)};
    Handle<RTCScene> scene_owner{rtcNewScene(device.get())};
    RTCScene scene = scene_owner.get();
    std::array<std::vector<uint32_t>, kinds> triangle_of;  // Embree primitive -> level triangle

    Embree(const RayScene& level, Surfaces surfaces) {
        for (uint32_t t = 0; t < level.triangles().size(); ++t) {
            const LevelTriangle& triangle = level.triangles()[t];
            const bool is_transparent = level.scene().materials[triangle.material].alpha_mode != AlphaMode::Opaque;
            const bool collects = surfaces == Surfaces::Walls && triangle.condition != no_condition;
            triangle_of[collects ? (is_transparent ? transparent_leaf : opaque_leaf)
                                 : (is_transparent ? transparent : opaque)]
                .push_back(t);
        }
        for (unsigned kind = 0; kind < kinds; ++kind) attach(kind, level);
        // Robust: rays must not slip through the edges that closed rooms are made of.
        rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
        rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
        rtcCommitScene(scene);
        // Without memory a scene is empty, and would be all sky.
        if (rtcGetDeviceError(device.get()) != RTC_ERROR_NONE) throw std::bad_alloc();
    }

    bool anyTransparent() const { return !triangle_of[transparent].empty(); }

    void attach(unsigned kind, const RayScene& level) {
        const auto& list = triangle_of[kind];
        if (list.empty()) return;
        RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* positions = static_cast<float*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), list.size() * 3));
        auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), list.size()));
        if (!positions || !indices) {
            rtcReleaseGeometry(geometry);
            throw std::bad_alloc();
        }
        for (size_t t = 0; t < list.size(); ++t)
            for (int i = 0; i < 3; ++i) {
                const glm::vec3 p = level.corner(list[t], i);
                const size_t vertex = t * 3 + static_cast<size_t>(i);
                positions[vertex * 3] = p.x;
                positions[vertex * 3 + 1] = p.y;
                positions[vertex * 3 + 2] = p.z;
                indices[vertex] = static_cast<unsigned>(vertex);
            }
        rtcSetGeometryMask(geometry, 1u << kind);
        if ((mask_leaves >> kind & 1) != 0) {
            rtcSetGeometryUserData(geometry, const_cast<uint32_t*>(list.data()));
            rtcSetGeometryIntersectFilterFunction(geometry, collect);
            rtcSetGeometryOccludedFilterFunction(geometry, collect);
        }
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(scene, geometry, kind);
        rtcReleaseGeometry(geometry);
    }

    static void prepare(RTCRayHit& ray_hit, glm::vec3 origin, glm::vec3 direction, float near_m, float far_m,
                        unsigned mask) {
        ray_hit.ray = {.org_x = origin.x,
                       .org_y = origin.y,
                       .org_z = origin.z,
                       .tnear = near_m,
                       .dir_x = direction.x,
                       .dir_y = direction.y,
                       .dir_z = direction.z,
                       .time = 0,
                       .tfar = far_m,
                       .mask = mask,
                       .id = 0,
                       .flags = 0};
        ray_hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    }

    bool intersect(RTCRayHit& ray_hit, glm::vec3 origin, glm::vec3 direction, float near_m, float far_m, unsigned mask,
                   LeafHits* leaves = nullptr) const {
        prepare(ray_hit, origin, direction, near_m, far_m, leaves ? mask | mask_leaves : mask);
        Collector collector(leaves);
        rtcIntersect1(scene, &collector.context, &ray_hit);
        return ray_hit.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    }

    bool occluded(glm::vec3 origin, glm::vec3 direction, float far_m, unsigned mask, LeafHits* leaves = nullptr) const {
        RTCRay ray{.org_x = origin.x,
                   .org_y = origin.y,
                   .org_z = origin.z,
                   .tnear = 0,
                   .dir_x = direction.x,
                   .dir_y = direction.y,
                   .dir_z = direction.z,
                   .time = 0,
                   .tfar = far_m,
                   .mask = leaves ? mask | mask_leaves : mask,
                   .id = 0,
                   .flags = 0};
        Collector collector(leaves);
        rtcOccluded1(scene, &collector.context, &ray);
        return ray.tfar < 0;
    }
};

RayScene::RayScene(const Scene& scene) : scene_(scene) {
    bounds_min_ = glm::vec3(std::numeric_limits<float>::max());
    bounds_max_ = glm::vec3(std::numeric_limits<float>::lowest());
    bool any_leaf = false;
    for (uint32_t m = 0; m < scene.meshes.size(); ++m) {
        const SceneMesh& mesh = scene.meshes[m];
        if (mesh.lighting == Lighting::Dynamic) continue;
        any_leaf |= mesh.door.has_value();
        if (mesh.door && !mesh.positions_m.empty()) {
            glm::vec3 low = mesh.positions_m[0], high = low;
            for (const glm::vec3 p : mesh.positions_m) low = glm::min(low, p), high = glm::max(high, p);
            leaf_boxes_.add(low, high);
        }
        for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
            const auto level_triangle = static_cast<uint32_t>(triangles_.size());
            triangles_.push_back({.mesh = m,
                                  .triangle = t,
                                  .material = mesh.triangle_materials[t],
                                  .normal = {},
                                  .condition = mesh.door ? 2 * *mesh.door + mesh.is_open_leaf : no_condition,
                                  .model = mesh.model.value_or(no_model)});
            const glm::vec3 a = corner(level_triangle, 0), b = corner(level_triangle, 1), c = corner(level_triangle, 2);
            triangles_.back().normal = glm::normalize(glm::cross(b - a, c - a));
            bounds_min_ = glm::min(bounds_min_, glm::min(a, glm::min(b, c)));
            bounds_max_ = glm::max(bounds_max_, glm::max(a, glm::max(b, c)));
        }
    }
    all_ = std::make_unique<Embree>(*this, Surfaces::All);
    if (!any_leaf) return;
    walls_ = std::make_unique<Embree>(*this, Surfaces::Walls);
}

RayScene::~RayScene() = default;

const RayScene::Embree& RayScene::embree(Surfaces surfaces) const {
    return surfaces == Surfaces::Walls && walls_ ? *walls_ : *all_;
}

glm::vec3 RayScene::corner(uint32_t triangle, int i) const {
    const LevelTriangle& t = triangles_[triangle];
    const SceneMesh& mesh = scene_.meshes[t.mesh];
    return mesh.positions_m[mesh.triangles[t.triangle][i]];
}

glm::vec3 RayScene::pointOn(uint32_t triangle, float u, float v) const {
    return (1 - u - v) * corner(triangle, 0) + u * corner(triangle, 1) + v * corner(triangle, 2);
}

glm::vec4 RayScene::surfaceColor(uint32_t triangle, float u, float v) const {
    const LevelTriangle& t = triangles_[triangle];
    const SceneMesh& mesh = scene_.meshes[t.mesh];
    const Material& material = scene_.materials[t.material];
    glm::vec4 color(material.base_color, material.alpha);
    if (material.base_color_texture && !mesh.uv0.empty()) {
        const glm::uvec3 index = mesh.triangles[t.triangle];
        const glm::vec2 uv = (1 - u - v) * mesh.uv0[index.x] + u * mesh.uv0[index.y] + v * mesh.uv0[index.z];
        color *= scene_.textures[*material.base_color_texture]->sample(uv);
    }
    return color;
}

float RayScene::alphaAt(uint32_t triangle, float u, float v) const {
    const Material& material = scene_.materials[triangles_[triangle].material];
    if (material.alpha_mode == AlphaMode::Opaque) return 1;
    const float alpha = surfaceColor(triangle, u, v).a;
    if (material.alpha_mode == AlphaMode::Mask) return alpha >= material.alpha_cutoff ? 1.0f : 0.0f;
    return std::clamp(alpha, 0.0f, 1.0f);
}

std::optional<Hit> RayScene::nearest(glm::vec3 origin, glm::vec3 direction, float distance_max_m, uint32_t seed,
                                     Surfaces surfaces, uint32_t ignored, LeafHits* leaves) const {
    const Embree& among = embree(surfaces);
    RTCRayHit r;
    std::optional<Hit> found;
    if (among.intersect(r, origin, direction, 0, distance_max_m, mask_opaque | mask_transparent, leaves)) {
        found = hitOf(among.triangle_of[r.hit.geomID][r.hit.primID], r.ray.tfar, r.hit.u, r.hit.v, direction);
        if (r.hit.geomID != opaque || ignored != no_model)
            found = throughLayers(among, {origin, direction, distance_max_m}, *found, seed, ignored, leaves);
    }
    if (leaves) finish(*leaves, direction, found ? found->distance_m : distance_max_m);
    return found;
}

Hit RayScene::hitOf(uint32_t triangle, float distance_m, float u, float v, glm::vec3 direction) const {
    return {triangle, distance_m, u, v, glm::dot(direction, triangles_[triangle].normal) > 0};
}

// What lets a ray pass is stepped over; the wall behind it is asked for by itself, from where that is: decals lie
// nearer to walls than a step.
std::optional<Hit> RayScene::throughLayers(const Embree& among, const Way& way, Hit hit, uint32_t seed,
                                           uint32_t ignored, LeafHits* leaves) const {
    const auto next = [&](float near_m, float far_m, unsigned mask, LeafHits* into) -> std::optional<Hit> {
        RTCRayHit r;
        if (!among.intersect(r, way.origin, way.direction, near_m, far_m, mask, into)) return std::nullopt;
        return hitOf(among.triangle_of[r.hit.geomID][r.hit.primID], r.ray.tfar, r.hit.u, r.hit.v, way.direction);
    };
    const auto isThere = [&](const Hit& h) { return ignored == no_model || triangles_[h.triangle].model != ignored; };
    std::optional<Hit> wall;
    bool knows_wall = false;
    for (int hits = 0, layers = 0; hits < hits_max; ++hits) {
        if (isThere(hit)) {
            if (scene_.materials[triangles_[hit.triangle].material].alpha_mode == AlphaMode::Opaque) return hit;
            if (++layers == transparent_layers_max) return hit;
            const float chance = unitFloat(hash(seed ^ transparency_seed, static_cast<uint32_t>(layers)));
            if (chance < alphaAt(hit.triangle, hit.u, hit.v)) return hit;
            if (!knows_wall) {
                wall = next(std::max(0.0f, hit.distance_m - step_past_m), way.length_m, mask_opaque, leaves);
                knows_wall = !wall || isThere(*wall);  // else the ray comes by it again
            }
        }
        const float near_m = hit.distance_m + step_past_m;
        const auto behind = knows_wall ? next(near_m, wall ? wall->distance_m : way.length_m, mask_transparent, nullptr)
                                       : next(near_m, way.length_m, mask_opaque | mask_transparent, leaves);
        if (!behind) return knows_wall ? wall : std::nullopt;
        hit = *behind;
    }
    return std::nullopt;
}

float RayScene::transmittanceWithout(uint32_t model, const Embree& among, glm::vec3 origin, glm::vec3 direction,
                                     float distance_m, LeafHits* leaves) const {
    float passed = 1, near_m = 0;
    for (int hits = 0, layers = 0; layers < transparent_layers_max && hits < hits_max && passed > 0; ++hits) {
        RTCRayHit r;
        if (!among.intersect(r, origin, direction, near_m, distance_m, mask_opaque | mask_transparent, leaves))
            return passed;
        const uint32_t triangle = among.triangle_of[r.hit.geomID][r.hit.primID];
        if (triangles_[triangle].model != model) {
            passed *= 1 - alphaAt(triangle, r.hit.u, r.hit.v);
            ++layers;
        }
        near_m = r.ray.tfar + step_past_m;
    }
    return 0;
}

float RayScene::transmittance(glm::vec3 origin, glm::vec3 direction, float distance_m, Surfaces surfaces,
                              uint32_t ignored, LeafHits* leaves) const {
    const Embree& among = embree(surfaces);
    float passed = 1;
    if (ignored != no_model) {
        passed = transmittanceWithout(ignored, among, origin, direction, distance_m, leaves);
    } else {
        if (among.occluded(origin, direction, distance_m, mask_opaque, leaves)) return 0;
        if (among.anyTransparent()) passed = throughTransparent(among, origin, direction, distance_m);
    }
    if (leaves && passed > 0) finish(*leaves, direction, distance_m);
    return passed;
}

float RayScene::throughTransparent(const Embree& among, glm::vec3 origin, glm::vec3 direction, float distance_m) const {
    float passed = 1, near_m = 0;
    for (int layer = 0; layer < transparent_layers_max; ++layer) {
        RTCRayHit r;
        if (!among.intersect(r, origin, direction, near_m, distance_m, mask_transparent)) return passed;
        passed *= 1 - alphaAt(among.triangle_of[transparent][r.hit.primID], r.hit.u, r.hit.v);
        if (passed <= 0) return 0;
        near_m = r.ray.tfar + step_past_m;
    }
    return 0;
}

// Rays meet leaves in no order, and some behind what stopped them.
void RayScene::finish(LeafHits& leaves, glm::vec3 direction, float distance_m) const {
    if (leaves.count == 0) return;
    const auto behind =
        std::remove_if(leaves.begin(), leaves.end(), [&](const Hit& h) { return h.distance_m > distance_m; });
    leaves.count = static_cast<uint32_t>(behind - leaves.begin());
    std::sort(leaves.begin(), leaves.end(), [](const Hit& a, const Hit& b) {
        return std::tie(a.distance_m, a.triangle) < std::tie(b.distance_m, b.triangle);
    });
    for (Hit& hit : leaves) hit.back = glm::dot(direction, triangles_[hit.triangle].normal) > 0;
}

bool RayScene::blocked(glm::vec3 from, glm::vec3 to) const {
    const float distance_m = glm::length(to - from);
    return distance_m > 0 && all_->occluded(from, (to - from) / distance_m, distance_m, mask_opaque);
}

}  // namespace dimmer::cook
