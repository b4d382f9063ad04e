#include <scene/open_pose.h>

namespace dimmer::cook {

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
        if (!mesh.door || !scene.doors[*mesh.door].pose || mesh.lighting == Lighting::Dynamic) continue;
        SceneMesh open = inOpenPose(mesh);
        scene.meshes.push_back(std::move(open));
    }
}

}  // namespace dimmer::cook
