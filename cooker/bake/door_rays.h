// Shadow rays where there are doors.
#pragma once

#include <bake/door_paths.h>

#include <array>

namespace dimmer::cook {

// visit(share, path) for every way that light has from `origin` along `direction` over `distance_m`: the share of it
// that passes, 0 to 1, while the doors stand as the path needs them. Ways of paths that are not kept count for those
// kept instead, or are left out (DoorPaths::with). `own`: the condition under which the receiver is there; `ignored`: a
// model that is not.
void forEachWay(const RayScene& rays, const DoorPaths& paths, uint32_t own, uint32_t ignored, glm::vec3 origin,
                glm::vec3 direction, float distance_m, auto&& visit) {
    LeafHits leaves;
    const float passed =
        rays.transmittance(origin, direction, distance_m, Surfaces::Walls, ignored, rays.anyLeaf() ? &leaves : nullptr);
    if (!(passed > 0)) return;
    if (leaves.count == 0) return visit(passed, free_path);
    struct Way {
        float share;
        uint32_t path;
    };
    constexpr uint32_t ways_max = 16;  // more than one only where leaves let some light through
    std::array<Way, ways_max> ways;
    ways[0] = {passed, free_path};
    uint32_t count = 1;
    for (const Hit& hit : leaves) {
        const uint32_t condition = rays.triangles()[hit.triangle].condition;
        const float stopped = rays.alphaAt(hit.triangle, hit.u, hit.v);
        const uint32_t before = count;
        for (uint32_t i = 0; i < before; ++i) {
            Way& way = ways[i];
            const Leaf leaf = way.path == no_path ? Leaf::Absent : paths.leaf(way.path, own, condition);
            if (leaf == Leaf::Absent) continue;
            if (leaf == Leaf::Either && stopped > 0) {
                // What the leaf would stop goes through where it stands otherwise.
                const Way through{way.share * stopped, paths.with(way.path, condition ^ 1)};
                if (through.path == way.path) continue;  // nobody asks how this door stands: both ways are one
                if (stopped >= 1)
                    way = through;
                else if (through.path != no_path && count < ways_max)
                    ways[count++] = through;
            } else if (stopped >= 1) {
                way.path = no_path;
            }
            if (stopped < 1) way.share *= 1 - stopped;
        }
    }
    for (uint32_t i = 0; i < count; ++i)
        if (ways[i].path != no_path) visit(ways[i].share, ways[i].path);
}

}  // namespace dimmer::cook
