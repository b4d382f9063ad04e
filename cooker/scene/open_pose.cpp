#include <fmt/format.h>
#include <scene/mesh.h>
#include <scene/open_pose.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

bool opensByPose(const Scene& scene, const SceneMesh& mesh) {
    return mesh.door && scene.doors[*mesh.door].pose && mesh.lighting != Lighting::Dynamic;
}

// Of axes that are unit and at right angles but for rounding.
constexpr double bend_max = 1e-3;

bool isRigid(const glm::dmat4& movement) {
    const glm::dmat3 axes(movement), square = glm::transpose(axes) * axes;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            if (!(std::abs(square[i][j] - (i == j ? 1 : 0)) <= bend_max)) return false;
    return true;
}

}  // namespace

Expected<void> checkOpenPoses(const ImportContext& context) {
    for (const SceneMesh& mesh : context.scene.meshes) {
        if (opensByPose(context.scene, mesh) && !isRigid(mesh.open_from_closed))
            return context.error(context.nodeLabel(mesh.gltf_node),
                                 "its open pose would bend the leaf: a node above it is scaled unevenly and the leaf "
                                 "turned against that. Scale that node evenly, or apply its scale to the meshes.");
        const auto isNear = [&](const glm::vec3& p) {
            return glm::length(glm::dvec3(mesh.open_from_closed * glm::dvec4(p, 1))) <= coordinate_max_m;
        };
        if (opensByPose(context.scene, mesh) && !std::ranges::all_of(mesh.positions_m, isNear))
            return context.error(context.nodeLabel(mesh.gltf_node),
                                 fmt::format("its open pose reaches more than {:.0f} km from the origin. Correct the "
                                             "door's 'dimmer_door_translation' (metres).",
                                             coordinate_max_m / 1000));
    }
    return {};
}

SceneMesh inOpenPose(SceneMesh closed) {
    const glm::dmat3 rotation(closed.open_from_closed);
    for (glm::vec3& p : closed.positions_m) p = glm::vec3(closed.open_from_closed * glm::dvec4(p, 1));
    for (glm::vec3& n : closed.normals) n = glm::vec3(glm::normalize(rotation * glm::dvec3(n)));
    closed.is_open_leaf = true;
    return closed;
}

void addOpenLeaves(Scene& scene) {
    const size_t count = scene.meshes.size();
    for (size_t m = 0; m < count; ++m) {
        const SceneMesh& mesh = scene.meshes[m];
        if (!opensByPose(scene, mesh)) continue;
        SceneMesh open = inOpenPose(mesh);
        scene.meshes.push_back(std::move(open));
    }
}

}  // namespace dimmer::cook
