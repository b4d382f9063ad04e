#include <scene/node_walk.h>

#include <glm/gtc/matrix_access.hpp>
#include <glm/gtc/quaternion.hpp>
#include <ranges>

namespace dimmer::cook {
namespace {

// Volume of the transformed unit cube relative to its edges: below this, a box has become a plane.
constexpr double flatness_min = 1e-9;
constexpr double scale_min = 1e-9;

bool isSingular(const glm::dmat4& m) {
    const glm::dmat3 linear(m);
    double edges = 1;
    for (int c = 0; c < 3; ++c) {
        const double edge = glm::length(linear[c]);
        if (!(edge > scale_min)) return true;
        edges *= edge;
    }
    return !(std::abs(glm::determinant(linear)) > flatness_min * edges);
}

bool isFinite(const glm::dmat4& m) {
    for (int c = 0; c < 4; ++c)
        for (int r = 0; r < 4; ++r)
            if (!isFiniteFloat(m[c][r])) return false;
    return true;
}

std::unexpected<Error> malformed(const ImportContext& context, int node, const char* what) {
    return context.error(context.nodeLabel(node), std::string("its ") + what + " Export the level again.");
}

Expected<glm::dvec3> triple(const ImportContext& context, int node, const std::vector<double>& values,
                            glm::dvec3 otherwise) {
    if (values.empty()) return otherwise;
    if (values.size() != 3) return malformed(context, node, "translation or scale is not three numbers.");
    return glm::dvec3(values[0], values[1], values[2]);
}

Expected<glm::dmat4> matrixOf(const ImportContext& context, int node, const std::vector<double>& values) {
    if (values.size() != 16) return malformed(context, node, "matrix is not sixteen numbers.");
    glm::dmat4 matrix;
    for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = values[static_cast<size_t>(i)];
    constexpr double rounding = 1e-5;
    const glm::dvec4 last_row(0, 0, 0, 1), off = glm::abs(glm::row(matrix, 3) - last_row);
    if (!glm::all(glm::lessThan(off, glm::dvec4(rounding))))
        return malformed(context, node, "matrix has a last row other than 0 0 0 1.");
    return glm::row(matrix, 3, last_row);
}

Expected<glm::dmat4> localTransform(const ImportContext& context, int index) {
    const tinygltf::Node& node = context.model.nodes[static_cast<size_t>(index)];
    if (!node.matrix.empty()) return matrixOf(context, index, node.matrix);
    const auto translation = triple(context, index, node.translation, glm::dvec3(0));
    if (!translation) return std::unexpected(translation.error());
    const auto scale = triple(context, index, node.scale, glm::dvec3(1));
    if (!scale) return std::unexpected(scale.error());
    glm::dquat rotation(1, 0, 0, 0);
    if (!node.rotation.empty()) {
        if (node.rotation.size() != 4) return malformed(context, index, "rotation is not four numbers.");
        rotation = glm::dquat(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
        const double length = glm::length(rotation);
        if (!(length > 1e-6) || !isFiniteFloat(length))
            return malformed(context, index, "rotation is not a quaternion of length 1.");
        rotation /= length;
    }
    glm::dmat4 local = glm::mat4_cast(rotation);
    for (int c = 0; c < 3; ++c) local[c] *= (*scale)[c];
    local[3] = glm::dvec4(*translation, 1);
    return local;
}

}  // namespace

Expected<std::vector<PlacedNode>> placeNodes(const ImportContext& context) {
    const auto& scene = context.model.scenes[static_cast<size_t>(std::max(context.model.defaultScene, 0))];
    std::vector<PlacedNode> placed, open;
    for (const int root : scene.nodes | std::views::reverse) open.push_back({root, -1, glm::dmat4(1), -1});
    while (!open.empty()) {
        PlacedNode at = open.back();  // holds its parent's transform until here
        open.pop_back();
        const auto local = localTransform(context, at.node);
        if (!local) return std::unexpected(local.error());
        at.world_from_node = at.world_from_node * *local;
        if (!isFinite(at.world_from_node))
            return context.error(context.nodeLabel(at.node),
                                 "its transform is NaN or infinite. Correct the transform.");
        if (at.singular == -1 && isSingular(at.world_from_node)) at.singular = at.node;
        for (const int child : context.model.nodes[static_cast<size_t>(at.node)].children | std::views::reverse)
            open.push_back({child, at.node, at.world_from_node, at.singular});
        placed.push_back(at);
    }
    return placed;
}

}  // namespace dimmer::cook
