#include <trace/ray_scene.h>

#include <bake/sampling.h>
#include <trace/embree_device.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <new>
#include <tuple>
#include <type_traits>

namespace dimmer::cook {
namespace {

// Kinds of surfaces are geometries of their own: what must be asked for its alpha, so that opaque rays skip it, and
// leaves among walls, which collect rays and stop none. Kind k has Embree's ray mask 1 << k.
// And of models, each of which some rays pass as if it were not there.
enum Kind : unsigned { opaque, transparent, opaque_leaf, transparent_leaf, opaque_model, transparent_model, kinds };
constexpr unsigned mask_opaque = 1 << opaque | 1 << opaque_model;
constexpr unsigned mask_transparent = 1 << transparent | 1 << transparent_model;
constexpr unsigned mask_leaves = 1 << opaque_leaf | 1 << transparent_leaf;
// After passing a transparent surface a ray starts anew this far behind it.
constexpr float step_past_m = 1e-4f;
// A ray that passes more surfaces than this is taken to be stopped; real levels stack a handful.
constexpr int transparent_layers_max = 64;
// Whether a ray passes is drawn apart from where it goes.
constexpr uint32_t transparency_seed = 0x3f84d5b5u;

// Where a ray goes on behind a surface that it passed: far away the step is less than floats tell apart.
float behind(float distance_m) {
    return std::max(distance_m + step_past_m, std::nextafter(distance_m, std::numeric_limits<float>::infinity()));
}

// What a ray carries along: where it leaves the leaves that it meets, and the model that is not there.
struct Collector {
    RTCIntersectContext context;  // first, so that Embree's pointer to it is ours
    LeafHits* leaves;             // null: they are passed by
    const LevelTriangle* triangles;
    uint32_t ignored;

    Collector(LeafHits* into, const LevelTriangle* of_level, uint32_t not_there)
        : leaves(into), triangles(of_level), ignored(not_there) {
        rtcInitIntersectContext(&context);
    }
};

// Of two skins of a wall in one plane, back to back, a ray meets the one that faces it. Farther apart than this they
// are a wall with a thickness.
float skinsApart(float distance_m) {
    return std::max(1e-5f, 4e-6f * distance_m);
}

void leaveOut(const RTCFilterFunctionNArguments* args) {
    const auto* const ray = reinterpret_cast<const Collector*>(args->context);
    const auto* hit = reinterpret_cast<const RTCHit*>(args->hit);
    const uint32_t triangle = static_cast<const uint32_t*>(args->geometryUserPtr)[hit->primID];
    if (ray->triangles[triangle].model == ray->ignored) args->valid[0] = 0;
}

// Asks for what faces a ray alone.
using TrianglesOfKinds = std::array<std::vector<uint32_t>, kinds>;
struct Facing {
    Collector collector;  // first, as above
    const TrianglesOfKinds& triangle_of;
};

bool isBack(const RTCFilterFunctionNArguments* args) {
    const auto* const asked = reinterpret_cast<const Facing*>(args->context);
    const auto* const ray = reinterpret_cast<const RTCRay*>(args->ray);
    const auto* const hit = reinterpret_cast<const RTCHit*>(args->hit);
    const LevelTriangle& triangle = asked->collector.triangles[asked->triangle_of[hit->geomID][hit->primID]];
    return glm::dot(glm::vec3(ray->dir_x, ray->dir_y, ray->dir_z), triangle.normal) > 0;
}
void leaveOutBacks(const RTCFilterFunctionNArguments* args) {
    if (isBack(args)) args->valid[0] = 0;
}
void leaveOutFronts(const RTCFilterFunctionNArguments* args) {
    if (!isBack(args)) args->valid[0] = 0;
}

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

    Handle<RTCDevice> device{newEmbreeDevice()};
    Handle<RTCScene> scene_owner{rtcNewScene(device.get())};
    RTCScene scene = scene_owner.get();
    const LevelTriangle* triangles;
    TrianglesOfKinds triangle_of;  // Embree primitive -> level triangle

    Embree(const RayScene& level, Surfaces surfaces) : triangles(level.triangles().data()) {
        for (uint32_t t = 0; t < level.triangles().size(); ++t) {
            const LevelTriangle& triangle = level.triangles()[t];
            const bool is_transparent = level.scene().materials[triangle.material].alpha_mode != AlphaMode::Opaque;
            const bool collects = surfaces == Surfaces::Walls && triangle.condition != no_condition;
            const Kind solid = collects ? opaque_leaf : triangle.model != no_model ? opaque_model : opaque;
            triangle_of[solid + is_transparent].push_back(t);  // each kind's transparent one comes next
        }
        for (unsigned kind = 0; kind < kinds; ++kind) attach(kind, level);
        // Robust: rays must not slip through the edges that closed rooms are made of. The other is for preferFront().
        rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
        rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
        rtcCommitScene(scene);
        // Without memory a scene is empty, and would be all sky.
        if (rtcGetDeviceError(device.get()) != RTC_ERROR_NONE) throw std::bad_alloc();
    }

    bool anyTransparent() const { return !triangle_of[transparent].empty() || !triangle_of[transparent_model].empty(); }
    static bool isTransparent(unsigned kind) { return (mask_transparent >> kind & 1) != 0; }

    void attach(unsigned kind, const RayScene& level) {
        const auto& list = triangle_of[kind];
        if (list.empty()) return;
        RTCGeometry geometry =
            newTriangles(device.get(), list.size(), [&](size_t t, int i) { return level.corner(list[t], i); });
        rtcSetGeometryMask(geometry, 1u << kind);
        if (kind != opaque && kind != transparent) {
            const bool is_leaf = (mask_leaves >> kind & 1) != 0;
            rtcSetGeometryUserData(geometry, const_cast<uint32_t*>(list.data()));
            rtcSetGeometryIntersectFilterFunction(geometry, is_leaf ? collect : leaveOut);
            rtcSetGeometryOccludedFilterFunction(geometry, is_leaf ? collect : leaveOut);
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
                   uint32_t ignored, LeafHits* leaves = nullptr) const {
        prepare(ray_hit, origin, direction, near_m, far_m, leaves ? mask | mask_leaves : mask);
        Collector collector(leaves, triangles, ignored);
        rtcIntersect1(scene, &collector.context, &ray_hit);
        return ray_hit.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    }

    // What else is met at a distance, but for what the filter leaves out.
    bool meet(RTCRayHit& other, glm::vec3 origin, glm::vec3 direction, float distance_m, uint32_t ignored,
              RTCFilterFunctionN leave_out) const {
        const float apart_m = skinsApart(distance_m);
        prepare(other, origin, direction, std::max(0.0f, distance_m - apart_m), distance_m + apart_m, mask_opaque);
        Facing facing{Collector(nullptr, triangles, ignored), triangle_of};
        facing.collector.context.filter = leave_out;
        rtcIntersect1(scene, &facing.collector.context, &other);
        return other.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    }

    // A front in the plane of a back that was met. `ray_hit`: as it was where there is none.
    void preferFront(RTCRayHit& ray_hit, glm::vec3 origin, glm::vec3 direction, uint32_t ignored) const {
        RTCRayHit front;
        if (meet(front, origin, direction, ray_hit.ray.tfar, ignored, leaveOutBacks)) ray_hit = front;
    }

    bool occluded(glm::vec3 origin, glm::vec3 direction, float far_m, unsigned mask, uint32_t ignored,
                  LeafHits* leaves = nullptr) const {
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
        Collector collector(leaves, triangles, ignored);
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
    if (material.base_color_texture) {
        glm::vec2 uv(0);
        const glm::uvec3 index = mesh.triangles[t.triangle];
        if (!mesh.uv0.empty()) uv = (1 - u - v) * mesh.uv0[index.x] + u * mesh.uv0[index.y] + v * mesh.uv0[index.z];
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
    if (among.intersect(r, origin, direction, 0, distance_max_m, mask_opaque | mask_transparent, ignored, leaves)) {
        found = hitOf(among.triangle_of[r.hit.geomID][r.hit.primID], r.ray.tfar, r.hit.u, r.hit.v, direction);
        if (found->back && !scene_.materials[triangles_[found->triangle].material].double_sided) {
            among.preferFront(r, origin, direction, ignored);
            found = hitOf(among.triangle_of[r.hit.geomID][r.hit.primID], r.ray.tfar, r.hit.u, r.hit.v, direction);
        }
        if (Embree::isTransparent(r.hit.geomID))
            found = throughLayers(among, {origin, direction, distance_max_m}, *found, seed, ignored, leaves);
    }
    if (leaves) finish(*leaves, direction, found ? found->distance_m : distance_max_m);
    return found;
}

bool RayScene::liesOnBack(const Hit& hit, glm::vec3 origin, glm::vec3 direction, Surfaces surfaces,
                          uint32_t ignored) const {
    const Embree& among = embree(surfaces);
    RTCRayHit back;
    if (!among.meet(back, origin, direction, hit.distance_m, ignored, leaveOutFronts)) return false;
    const uint32_t triangle = among.triangle_of[back.hit.geomID][back.hit.primID];
    return !scene_.materials[triangles_[triangle].material].double_sided;
}

float RayScene::reach(glm::vec3 origin, glm::vec3 direction, float distance_max_m, Surfaces surfaces) const {
    float from_m = 0;
    for (int layer = 0; layer <= transparent_layers_max; ++layer) {
        const auto hit = nearest(origin + direction * from_m, direction, distance_max_m - from_m, 0, surfaces);
        if (!hit) return distance_max_m;
        const bool stopped = !(alphaAt(hit->triangle, hit->u, hit->v) < 1);
        if (stopped) return from_m + hit->distance_m;
        from_m = behind(from_m + hit->distance_m);
    }
    return distance_max_m;
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
        if (!among.intersect(r, way.origin, way.direction, near_m, far_m, mask, ignored, into)) return std::nullopt;
        return hitOf(among.triangle_of[r.hit.geomID][r.hit.primID], r.ray.tfar, r.hit.u, r.hit.v, way.direction);
    };
    const auto lets = [&](const Hit& h, int layer) {
        const float chance = unitFloat(hash(seed ^ transparency_seed, static_cast<uint32_t>(layer)));
        return layer < transparent_layers_max && chance >= alphaAt(h.triangle, h.u, h.v);
    };
    if (!lets(hit, 1)) return hit;
    const auto wall = next(std::max(0.0f, hit.distance_m - step_past_m), way.length_m, mask_opaque, leaves);
    const float far_m = wall ? wall->distance_m : way.length_m;
    for (int layer = 2;; ++layer) {
        const auto layer_hit = next(behind(hit.distance_m), far_m, mask_transparent, nullptr);
        if (!layer_hit) return wall;
        hit = *layer_hit;
        if (!lets(hit, layer)) return hit;
    }
}

float RayScene::transmittance(glm::vec3 origin, glm::vec3 direction, float distance_m, Surfaces surfaces,
                              uint32_t ignored, LeafHits* leaves) const {
    const Embree& among = embree(surfaces);
    if (among.occluded(origin, direction, distance_m, mask_opaque, ignored, leaves)) return 0;
    const float passed =
        among.anyTransparent() ? throughTransparent(among, {origin, direction, distance_m}, ignored) : 1;
    if (leaves && passed > 0) finish(*leaves, direction, distance_m);
    return passed;
}

float RayScene::throughTransparent(const Embree& among, const Way& way, uint32_t ignored) const {
    float passed = 1, near_m = 0;
    for (int layer = 0; layer < transparent_layers_max; ++layer) {
        RTCRayHit r;
        if (!among.intersect(r, way.origin, way.direction, near_m, way.length_m, mask_transparent, ignored))
            return passed;
        passed *= 1 - alphaAt(among.triangle_of[r.hit.geomID][r.hit.primID], r.hit.u, r.hit.v);
        if (passed <= 0) return 0;
        near_m = behind(r.ray.tfar);
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
    return distance_m > 0 && all_->occluded(from, (to - from) / distance_m, distance_m, mask_opaque, no_model);
}

}  // namespace dimmer::cook
