#include <scene/ies_light.h>
#include <scene/uri.h>

#include <scene/gltf_file.h>

#include <fmt/format.h>

#include <charconv>
#include <filesystem>

namespace dimmer::cook {
namespace {

constexpr const char* extension_name = "EXT_lights_ies";

using Bytes = std::vector<unsigned char>;

// Where a node that carries the light puts its directions: -Z is the nadir. Scale changes nothing, a mirror does.
glm::mat3 profileFromWorld(const glm::dmat4& world_from_node) {
    const glm::dvec3 z = glm::normalize(glm::dvec3(world_from_node[2]));
    const glm::dvec3 x =
        glm::normalize(glm::dvec3(world_from_node[0]) - z * glm::dot(z, glm::dvec3(world_from_node[0])));
    glm::dvec3 y = glm::cross(z, x);
    if (glm::dot(y, glm::dvec3(world_from_node[1])) < 0) y = -y;
    return glm::transpose(glm::dmat3(x, y, z));
}

}  // namespace

bool hasLightProfile(const tinygltf::Node& node) {
    return node.extensions.contains(extension_name);
}

Expected<LightProfiles::Profile> LightProfiles::read(const tinygltf::Value& source, const std::string& label) {
    Bytes bytes;
    std::string file = context_.scene.file + ": " + label;
    if (source.Has("uri") && source.Get("uri").IsString()) {
        const std::string& uri = source.Get("uri").Get<std::string>();
        if (uri.starts_with("data:")) {
            if (!decodeDataUri(uri, bytes))
                return context_.error(label, "its data URI is not base64. Export the level again.");
        } else {
            const auto path = std::filesystem::path(context_.scene.file).parent_path() / percentDecoded(uri);
            auto content = readFile(path);
            if (!content) return context_.error(label, "needs a file of its own: " + content.error().message);
            bytes = std::move(*content);
            file = path.string();
        }
    } else if (source.Has("bufferView") && source.Get("bufferView").IsInt()) {
        const int index = source.Get("bufferView").Get<int>();
        const auto& views = context_.model.bufferViews;
        if (index < 0 || static_cast<size_t>(index) >= views.size())
            return context_.error(label, fmt::format("refers to buffer view {}, but the file has {}. Export the level "
                                                     "again.",
                                                     index, views.size()));
        const tinygltf::BufferView& view = views[static_cast<size_t>(index)];  // its range was checked by checkModel
        const auto begin = context_.model.buffers[static_cast<size_t>(view.buffer)].data.begin() +
                           static_cast<std::ptrdiff_t>(view.byteOffset);
        bytes.assign(begin, begin + static_cast<std::ptrdiff_t>(view.byteLength));
    } else {
        return context_.error(label, "has neither a 'uri' nor a 'bufferView'. Export the level again.");
    }
    auto parsed = parseLightProfile({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, file);
    if (!parsed) return context_.error(label, "its luminaire is not usable: " + parsed.error().message);
    for (const std::string& note : parsed->notes) context_.scene.warnings.push_back(note);
    return std::make_shared<const LightProfile>(std::move(parsed->profile));
}

Expected<LightProfiles::Profile> LightProfiles::profile(int index, const std::string& owner) {
    if (const auto known = read_.find(index); known != read_.end()) return known->second;
    const auto root = context_.model.extensions.find(extension_name);
    const bool listed = root != context_.model.extensions.end() && root->second.Has("lights");
    const tinygltf::Value lights = listed ? root->second.Get("lights") : tinygltf::Value();
    const size_t count = lights.IsArray() ? lights.ArrayLen() : 0;
    if (index < 0 || static_cast<size_t>(index) >= count)
        return context_.error(
            owner,
            fmt::format("refers to light profile {}, but the file has {}. Export the level again.", index, count));
    auto profile = read(lights.Get(static_cast<size_t>(index)), fmt::format("light profile {}", index));
    if (profile) read_.emplace(index, *profile);
    return profile;
}

Expected<PunctualLight> LightProfiles::place(int node, const glm::dmat4& world_from_node) {
    const std::string owner = context_.nodeLabel(node);
    const tinygltf::Value& values = context_.model.nodes[static_cast<size_t>(node)].extensions.at(extension_name);
    if (!values.Has("light") || !values.Get("light").IsInt())
        return context_.error(owner, "its EXT_lights_ies names no light. Export the level again.");
    const auto profile = this->profile(values.Get("light").Get<int>(), owner);
    if (!profile) return std::unexpected(profile.error());

    double multiplier = 1;
    if (values.Has("multiplier")) {
        const tinygltf::Value& value = values.Get("multiplier");
        multiplier = value.IsNumber() ? value.GetNumberAsDouble() : -1;
    }
    glm::dvec3 color(1);
    if (values.Has("color")) {
        const tinygltf::Value& value = values.Get("color");
        const bool triple = value.IsArray() && value.ArrayLen() == 3;
        for (int c = 0; c < 3; ++c) {
            const tinygltf::Value channel = triple ? value.Get(c) : tinygltf::Value();
            color[c] = channel.IsNumber() ? channel.GetNumberAsDouble() : -1;
        }
    }
    const glm::dvec3 peak_cd = glm::min(color, glm::dvec3(1)) * (multiplier * static_cast<double>((*profile)->peak_cd));
    if (!(multiplier >= 0) || glm::any(glm::lessThan(color, glm::dvec3(0))) || !isFinite(peak_cd))
        return context_.error(
            owner,
            "its EXT_lights_ies needs a multiplier of 0 or more and a colour of three numbers within 0 "
            "and 1. Correct the light.");
    PunctualLight light;
    light.position_m = glm::dvec3(world_from_node[3]);
    light.direction = glm::normalize(-glm::dvec3(world_from_node[2]));
    light.intensity = peak_cd;
    light.profile = *profile;
    light.profile_from_world = profileFromWorld(world_from_node);
    return light;
}

}  // namespace dimmer::cook
