#include <fmt/format.h>
#include <scene/light.h>

#include <glm/gtc/constants.hpp>

namespace dimmer::cook {
namespace {

// glTF's lights and cameras look along their node's -Z.
glm::vec3 forward(const glm::dmat4& world_from_node) {
    return glm::normalize(-glm::dvec3(world_from_node[2]));
}

Expected<glm::vec3> intensity(const ImportContext& context, const tinygltf::Light& light, const std::string& owner) {
    glm::dvec3 color(1);
    if (!light.color.empty()) {
        if (light.color.size() != 3)
            return context.error(owner, "its light's colour is not three numbers. Export the level again.");
        color = {light.color[0], light.color[1], light.color[2]};
    }
    const glm::dvec3 product = color * light.intensity;
    if (!isFinite(color) || !isFinite(product))
        return context.error(owner, "its light's colour or intensity is not a finite number. Correct the light.");
    if (light.intensity < 0 || glm::any(glm::lessThan(color, glm::dvec3(0))))
        return context.error(owner, "its light's colour or intensity is negative. Give it 0 or more.");
    return glm::vec3(product);
}

// The parser takes a range of 0 for none.
Expected<void> checkRange(const ImportContext& context, int light, const std::string& owner) {
    const auto extension = context.model.extensions.find("KHR_lights_punctual");
    if (extension == context.model.extensions.end() || !extension->second.Has("lights")) return {};
    const tinygltf::Value& stated = extension->second.Get("lights").Get(static_cast<size_t>(light));
    if (stated.Has("range") && stated.Get("range").GetNumberAsDouble() == 0)
        return context.error(owner, "its light's range is not greater than 0. Correct it or leave it out.");
    return {};
}

Expected<void> cone(const ImportContext& context, const tinygltf::SpotLight& spot, const std::string& owner,
                    PunctualLight& result) {
    const double inner = spot.innerConeAngle, outer = spot.outerConeAngle;
    // A little above pi/2: exporters round it.
    if (!(inner >= 0 && inner <= outer && outer > 0 && outer <= glm::half_pi<double>() + 1e-4))
        return context.error(owner,
                             fmt::format("its spot's cone angles are {} and {}; they must satisfy 0 <= inner <= outer "
                                         "<= pi/2. Correct the light.",
                                         inner, outer));
    result.cone_inner_cos = static_cast<float>(std::cos(inner));
    result.cone_outer_cos = static_cast<float>(std::max(std::cos(outer), 0.0));
    return {};
}

Expected<LightType> lightType(const ImportContext& context, const std::string& type, const std::string& owner) {
    if (type == "point") return LightType::Point;
    if (type == "spot") return LightType::Spot;
    if (type == "directional") return LightType::Directional;
    return context.error(owner, fmt::format("its light's type is '{}'. Use point, spot or directional.", type));
}

}  // namespace

Expected<PunctualLight> importLight(const ImportContext& context, int light, int node,
                                    const glm::dmat4& world_from_node) {
    const tinygltf::Light& source = context.model.lights[static_cast<size_t>(light)];
    const std::string owner = context.nodeLabel(node);
    PunctualLight result;
    const auto type = lightType(context, source.type, owner);
    if (!type) return std::unexpected(type.error());
    result.type = *type;
    const auto radiant = intensity(context, source, owner);
    if (!radiant) return std::unexpected(radiant.error());
    result.intensity = *radiant;
    result.position_m = glm::dvec3(world_from_node[3]);
    result.direction = forward(world_from_node);
    if (result.type == LightType::Spot)
        if (const auto ok = cone(context, source.spot, owner, result); !ok) return std::unexpected(ok.error());
    if (const auto ok = checkRange(context, light, owner); !ok) return std::unexpected(ok.error());
    if (source.range != 0) {  // the parser's 0 is "no range"
        if (!isFiniteFloat(source.range) || !(static_cast<float>(source.range) > 0))
            return context.error(owner, "its light's range is not greater than 0. Correct it or leave it out.");
        result.range_m = static_cast<float>(source.range);
    }
    return result;
}

Expected<SceneViewpoint> importViewpoint(const ImportContext& context, std::optional<int> camera, int node,
                                         const glm::dmat4& world_from_node) {
    SceneViewpoint view;
    view.name = context.model.nodes[static_cast<size_t>(node)].name;
    view.position_m = glm::dvec3(world_from_node[3]);
    view.forward = forward(world_from_node);
    if (!camera) return view;
    const tinygltf::Camera& source = context.model.cameras[static_cast<size_t>(*camera)];
    if (view.name.empty()) view.name = source.name;
    if (source.type != "perspective") return view;
    const double fov = source.perspective.yfov;
    if (!(fov > 0 && fov < glm::pi<double>()))
        return context.error(
            context.nodeLabel(node),
            fmt::format("its camera's yfov is {}; it must be between 0 and pi. Correct the camera.", fov));
    view.vertical_fov_rad = static_cast<float>(fov);
    return view;
}

}  // namespace dimmer::cook
