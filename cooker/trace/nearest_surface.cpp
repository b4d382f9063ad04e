#include <trace/nearest_surface.h>

#include <trace/embree_device.h>

#include <algorithm>
#include <cmath>
#include <new>

namespace dimmer::cook {
namespace {

glm::vec3 vec(const std::array<float, 3>& a) {
    return {a[0], a[1], a[2]};
}

// Barycentric weights of the point of triangle abc nearest to p (C. Ericson, Real-Time Collision Detection, 5.1.5).
glm::vec3 nearestWeights(glm::vec3 p, glm::vec3 a, glm::vec3 b, glm::vec3 c) {
    const glm::vec3 ab = b - a, ac = c - a, ap = p - a;
    const float d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
    const glm::vec3 bp = p - b;
    const float d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
    const float vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
    const glm::vec3 cp = p - c;
    const float d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
    const float vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
    const float va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        const float w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return {0, 1 - w, w};
    }
    const float sum = va + vb + vc;
    return {va / sum, vb / sum, vc / sum};
}

}  // namespace

struct NearestSurface::Impl {
    struct Triangle {
        uint32_t mesh;
        std::array<uint32_t, 3> corner;
    };
    struct Query {
        const Impl* self;
        glm::vec3 point, normal;
        uint32_t best = UINT32_MAX;
        glm::vec3 weights{0};
        float distance_m = 0, facing = 0;
    };

    std::span<const Mesh> meshes;
    glm::vec2 page_size;
    std::vector<Triangle> triangles;
    RTCDevice device = newEmbreeDevice();
    RTCScene scene = rtcNewScene(device);

    ~Impl() {
        rtcReleaseScene(scene);
        rtcReleaseDevice(device);
    }

    glm::vec3 position(const Triangle& t, size_t i) const {
        return vec(meshes[t.mesh].vertices[t.corner[i]].position_m);
    }
    glm::vec3 normalOf(const Triangle& t) const {
        return glm::normalize(glm::cross(position(t, 1) - position(t, 0), position(t, 2) - position(t, 0)));
    }

    bool isLeaf(const Triangle& t) const { return meshes[t.mesh].door.has_value(); }

    static bool visit(RTCPointQueryFunctionArguments* arguments) {
        auto& q = *static_cast<Query*>(arguments->userPtr);
        const Triangle& t = q.self->triangles[arguments->primID];
        const float facing = glm::dot(q.self->normalOf(t), q.normal);
        if (!(facing > 0)) return false;
        const glm::vec3 a = q.self->position(t, 0), b = q.self->position(t, 1), c = q.self->position(t, 2);
        const glm::vec3 w = nearestWeights(q.point, a, b, c);
        const float distance = glm::distance(q.point, w.x * a + w.y * b + w.z * c);
        if (!(distance <= arguments->query->radius)) return false;
        constexpr float same_m = 1e-4f;  // coordinates in a file are rounded: nearer than this is equally near
        const auto isBetterOfTwoAlike = [&] {
            const bool leaf = q.self->isLeaf(t), other_leaf = q.self->isLeaf(q.self->triangles[q.best]);
            return leaf != other_leaf ? other_leaf : distance < q.distance_m;
        };
        const bool better = q.best == UINT32_MAX || distance < q.distance_m - same_m ||
                            (distance < q.distance_m + same_m &&
                             (facing > q.facing + 1e-4f || (facing > q.facing - 1e-4f && isBetterOfTwoAlike())));
        if (!better) return false;
        q.best = arguments->primID;
        q.weights = w;
        q.distance_m = distance;
        q.facing = facing;
        arguments->query->radius = std::min(arguments->query->radius, distance + same_m);
        return true;
    }
};

NearestSurface::NearestSurface(std::span<const Mesh> meshes, uint32_t page_width, uint32_t page_height)
    : impl_(std::make_unique<Impl>()) {
    impl_->meshes = meshes;
    impl_->page_size = {page_width, page_height};
    for (uint32_t m = 0; m < meshes.size(); ++m)
        for (size_t i = 0; i + 2 < meshes[m].indices.size(); i += 3) {
            const Impl::Triangle t{m, {meshes[m].indices[i], meshes[m].indices[i + 1], meshes[m].indices[i + 2]}};
            const glm::vec3 a = impl_->position(t, 0);
            if (glm::length(glm::cross(impl_->position(t, 1) - a, impl_->position(t, 2) - a)) > 0)
                impl_->triangles.push_back(t);
        }
    if (impl_->triangles.empty()) return;
    RTCGeometry geometry = newTriangles(impl_->device, impl_->triangles.size(),
                                        [&](size_t t, int i) { return impl_->position(impl_->triangles[t], i); });
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(impl_->scene, geometry, 0);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(impl_->scene);
    if (rtcGetDeviceError(impl_->device) != RTC_ERROR_NONE) throw std::bad_alloc();
}

NearestSurface::~NearestSurface() = default;

std::optional<SurfacePlace> NearestSurface::find(glm::vec3 point, glm::vec3 normal, float radius_m) const {
    if (impl_->triangles.empty()) return std::nullopt;
    Impl::Query q{.self = impl_.get(), .point = point, .normal = normal};
    RTCPointQuery query{.x = point.x, .y = point.y, .z = point.z, .time = 0, .radius = radius_m};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(impl_->scene, &query, &context, &Impl::visit, &q);
    if (q.best == UINT32_MAX) return std::nullopt;
    const Impl::Triangle& t = impl_->triangles[q.best];
    std::array<glm::vec3, 3> positions;
    std::array<glm::vec2, 3> uv_texels;
    glm::vec2 uv(0);
    for (size_t i = 0; i < 3; ++i) {
        const MeshVertex& v = impl_->meshes[t.mesh].vertices[t.corner[i]];
        positions[i] = vec(v.position_m);
        uv_texels[i] = glm::vec2(v.lightmap_uv[0], v.lightmap_uv[1]) * impl_->page_size;
        uv += q.weights[static_cast<int>(i)] * glm::vec2(v.lightmap_uv[0], v.lightmap_uv[1]);
    }
    float texel_area_m2 = 0;
    return SurfacePlace{
        t.mesh, q.distance_m, {uv.x, uv.y}, tangentFrame(positions, uv_texels, impl_->normalOf(t), texel_area_m2)};
}

}  // namespace dimmer::cook
