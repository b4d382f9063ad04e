#include <pipeline/write_level.h>

#include <pipeline/charted_level.h>
#include <scene/gltf_file.h>
#include <scene/node_walk.h>
#include <scene/uri.h>
#include <write/gltf_prune.h>
#include <write/pack_writer.h>

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

namespace dimmer::cook {
namespace {

using Json = GlbDocument::Json;

// Vertices of one material, in the node's own space.
class PrimitiveBuilder {
   public:
    void add(const SceneMesh& from, uint32_t vertex, std::optional<glm::vec2> uv, bool back,
             const glm::dmat4& node_from_world) {
        const glm::vec2 key_uv = uv.value_or(glm::vec2(0));
        const auto [it, fresh] = index_.try_emplace({vertex, key_uv.x, key_uv.y}, static_cast<uint32_t>(index_.size()));
        indices_.push_back(it->second);
        if (!fresh) return;
        push(positions_, glm::vec3(node_from_world * glm::dvec4(from.positions_m[vertex], 1)));
        // A normal's node_from_world is the inverse transpose of a point's: the transpose of world_from_node.
        const glm::dmat3 world_from_node = glm::inverse(glm::dmat3(node_from_world));
        const glm::dvec3 normal = glm::transpose(world_from_node) * glm::dvec3(from.normals[vertex]);
        push(normals_, glm::vec3(glm::normalize(back ? -normal : normal)));
        if (!from.uv0.empty()) push(uv0_, from.uv0[vertex]);
        if (uv) push(uv1_, *uv);
    }

    Json write(GlbDocument& document) const {
        Json primitive = {
            {"attributes",
             {{"POSITION", document.addVectors(positions_, 3, true)}, {"NORMAL", document.addVectors(normals_, 3)}}}};
        if (!uv0_.empty()) primitive["attributes"]["TEXCOORD_0"] = document.addVectors(uv0_, 2);
        if (!uv1_.empty()) primitive["attributes"]["TEXCOORD_1"] = document.addVectors(uv1_, 2);
        primitive["indices"] = document.addIndices(indices_);
        return primitive;
    }

   private:
    template <class Vector>
    static void push(std::vector<float>& values, Vector v) {
        for (int i = 0; i < v.length(); ++i) values.push_back(v[i]);
    }
    std::map<std::tuple<uint32_t, float, float>, uint32_t> index_;
    std::vector<float> positions_, normals_, uv0_, uv1_;
    std::vector<uint32_t> indices_;
};

// What of a node becomes one glTF mesh: a scene mesh's faces on one page, or a scene mesh that has no lightmap.
struct Part {
    bool emissive = false;                                             // emissive parts come first
    std::map<std::pair<uint32_t, bool>, PrimitiveBuilder> primitives;  // by material, and whether it is the back side
};
using Parts = std::map<std::pair<uint32_t, uint32_t>, Part>;  // of a node, by scene mesh and page (or no_index)

class LevelWriter {
   public:
    LevelWriter(const ChartedLevel& level, const GltfSource& source, std::vector<std::string>& warnings)
        : level_(level), source_(source), warnings_(warnings) {}

    Expected<std::vector<std::byte>> write(const std::filesystem::path& from, const std::filesystem::path& to) {
        if (auto ok = collect(); !ok) return std::unexpected(ok.error());
        Json original = Json::parse(source_.json);
        for (const auto& [node, parts] : nodes_) release(original, node);
        dropMorphAnimations(original);
        adoptUsed(document_, std::move(original), source_.model);
        for (auto& [node, parts] : nodes_) place(static_cast<size_t>(node), parts);
        normaliseTextures();
        moveReferences(from, to);
        document_.json["asset"]["generator"] = "Dimmer";
        auto bytes = document_.bytes();
        if (bytes) return bytes;
        return fail(bytes.error().code, fmt::format("{}: {}", to.string(), bytes.error().message));
    }

   private:
    Expected<void> collect() {
        Scene ignored;
        const ImportContext context{source_.model, ignored};
        const auto placed = placeNodes(context);
        if (!placed) return std::unexpected(placed.error());
        for (const PlacedNode& at : *placed)
            if (at.singular == -1) node_from_world_[at.node] = glm::inverse(at.world_from_node);
        std::vector<bool> lit(level_.scene.meshes.size());
        const glm::vec2 page_size(level_.charts.page_width, level_.charts.page_height);
        for (uint32_t f = 0; f < level_.charts.faces.size(); ++f) {
            const Face face = level_.charts.faces[f];
            const LevelTriangle& t = level_.rays->triangles()[face.triangle];
            lit[t.mesh] = true;
            std::array<glm::vec2, 3> uv = level_.charts.uv_texels[f];
            for (glm::vec2& corner : uv) corner /= page_size;
            add(t.mesh, t.triangle, level_.charts.charts[level_.charts.face_chart[f]].page, &uv, face.back);
        }
        for (uint32_t m = 0; m < lit.size(); ++m)
            for (uint32_t t = 0; !lit[m] && t < level_.scene.meshes[m].triangles.size(); ++t)
                add(m, t, no_index, nullptr, false);
        return {};
    }

    void add(uint32_t mesh, uint32_t triangle, uint32_t page, const std::array<glm::vec2, 3>* uv, bool back) {
        const SceneMesh& from = level_.scene.meshes[mesh];
        if (from.is_open_leaf) return;
        const glm::dmat4& node_from_world = node_from_world_.at(from.gltf_node);
        const uint32_t material = from.triangle_materials[triangle];
        Part& part = nodes_[from.gltf_node][{mesh, page}];
        part.emissive = part.emissive || level_.scene.materials[material].emission_cd_m2 != glm::vec3(0);
        PrimitiveBuilder& primitive = part.primitives[{material, back}];
        // glTF turns the triangles of mirrored nodes itself.
        const bool mirrored = glm::determinant(glm::dmat3(node_from_world)) < 0;
        for (const int i : back != mirrored ? std::array{0, 2, 1} : std::array{0, 1, 2}) {
            const auto corner = uv ? std::optional((*uv)[static_cast<size_t>(i)]) : std::nullopt;
            primitive.add(from, from.triangles[triangle][i], corner, back, node_from_world);
        }
    }

    // Which one becomes TEXCOORD_0 is the material's choice; joints and weights go with the skin.
    static bool isWritten(const std::string& attribute) {
        return attribute == "POSITION" || attribute == "NORMAL" || attribute.starts_with("TEXCOORD_") ||
               attribute.starts_with("JOINTS_") || attribute.starts_with("WEIGHTS_");
    }

    // The node's mesh gives way to what will be made of it.
    void release(Json& original, int node) {
        Json& n = original["nodes"][static_cast<size_t>(node)];
        original_mesh_[node] = original["meshes"][n["mesh"].get<size_t>()];
        n.erase("mesh");
        const auto warn = [&](const std::string& what) {
            warnings_.push_back(fmt::format("node '{}': {}", n.value("name", fmt::format("node_{}", node)), what));
        };
        if (n.contains("skin")) warn("its skin is not written; the mesh stands as its node places it");
        std::set<std::string> lost;
        for (const Json& primitive : original_mesh_[node]["primitives"]) {
            for (const auto& attribute : primitive["attributes"].items())
                if (!isWritten(attribute.key())) lost.insert(attribute.key());
            if (primitive.contains("targets")) lost.insert("its morph targets");
            if (primitive.contains("extras")) lost.insert("extras of its primitives");
            addExtensions(primitive, lost);
        }
        addExtensions(original_mesh_[node], lost);
        if (!lost.empty())
            warn(fmt::format("{} {} not written", fmt::join(lost, ", "), lost.size() > 1 ? "are" : "is"));
        n.erase("skin");
        n.erase("weights");
    }

    // But for what said only how the file held it.
    static void addExtensions(const Json& of, std::set<std::string>& lost) {
        if (!of.contains("extensions")) return;
        for (const auto& extension : of["extensions"].items())
            if (extension.key() != "KHR_draco_mesh_compression") lost.insert(extension.key());
    }

    // Channels that move morph targets which are no longer there.
    void dropMorphAnimations(Json& original) {
        if (!original.contains("animations")) return;
        Json kept = Json::array();
        for (Json& animation : original["animations"]) {
            Json channels = Json::array();
            for (Json& channel : animation["channels"])
                if (channel["target"].value("path", "") != "weights") channels.push_back(std::move(channel));
            if (channels.empty()) continue;
            animation["channels"] = std::move(channels);
            kept.push_back(std::move(animation));
        }
        original["animations"] = std::move(kept);
    }

    void place(size_t node, Parts& parts) {
        std::vector<std::pair<std::pair<uint32_t, uint32_t>, Part*>> order;
        for (auto& [key, part] : parts) order.emplace_back(key, &part);
        std::ranges::stable_sort(order,
                                 [](const auto& a, const auto& b) { return a.second->emissive > b.second->emissive; });
        for (size_t i = 0; i < order.size(); ++i) {
            const size_t holder = i == 0 ? node : addChild(node, i, order[i].second->emissive);
            const size_t mesh = addMesh(node, *order[i].second, order[i].first.second);
            document_.json["nodes"][holder]["mesh"] = mesh;
        }
    }

    // A light set belongs to what shines.
    static void dropLightSet(Json& extras) {
        extras.erase("dimmer_light_set");
        extras.erase("dimmer_max_weight");
    }

    // A door holds for what is below its node, too, and its pose is in that node's axes.
    static void dropDoor(Json& extras) {
        for (const char* key : {"dimmer_door", "dimmer_door_open", "dimmer_door_rotation", "dimmer_door_translation"})
            extras.erase(key);
    }

    size_t addChild(size_t node, size_t number, bool emissive) {
        Json& nodes = document_.json["nodes"];
        const size_t child = nodes.size();
        Json made = {
            {"name", fmt::format("{}.part{}", nodes[node].value("name", fmt::format("node_{}", node)), number + 1)}};
        if (nodes[node].contains("extras") && nodes[node]["extras"].is_object()) {
            made["extras"] = nodes[node]["extras"];
            dropDoor(made["extras"]);
            if (!emissive) dropLightSet(made["extras"]);
        }
        nodes.push_back(std::move(made));
        nodes[node]["children"].push_back(child);
        return child;
    }

    size_t addMesh(size_t node, const Part& part, uint32_t page) {
        const Json& original = original_mesh_.at(static_cast<int>(node));
        Json mesh = {{"primitives", Json::array()}};
        if (original.contains("name")) mesh["name"] = original["name"];
        if (original.contains("extras") && original["extras"].is_object()) {
            mesh["extras"] = original["extras"];
            if (!part.emissive) dropLightSet(mesh["extras"]);
        }
        if (page != no_index) mesh["extras"]["lightmap_page"] = page;
        for (const auto& [key, builder] : part.primitives) {
            Json primitive = builder.write(document_);
            if (const auto material = materialFor(key.first, page != no_index)) primitive["material"] = *material;
            mesh["primitives"].push_back(std::move(primitive));
        }
        document_.json["meshes"].push_back(std::move(mesh));
        return document_.json["meshes"].size() - 1;
    }

    // The file's material; a single-sided copy where each side has texels of its own. None: glTF's default.
    std::optional<size_t> materialFor(uint32_t material, bool lit) {
        const bool double_sided = level_.scene.materials[material].double_sided;
        material = level_.scales.copy_of[material];
        if (material >= source_.model.materials.size()) return std::nullopt;
        if (!lit || !double_sided) return material;
        const auto [it, fresh] = single_sided_.try_emplace(material, document_.json["materials"].size());
        if (fresh) {
            Json copy = document_.json["materials"][material];
            copy["doubleSided"] = false;
            document_.json["materials"].push_back(std::move(copy));
        }
        return it->second;
    }

    // TEXCOORD_0 is what the base colour's texture wants, with its transform applied; TEXCOORD_1 the lightmap's.
    void normaliseTextures() {
        if (!document_.json.contains("materials")) return;
        for (Json& material : document_.json["materials"]) {
            // As the importer has it: the emissive texture's where the base colour has none.
            Json::json_pointer base("/pbrMetallicRoughness/baseColorTexture");
            if (!material.contains(base)) base = Json::json_pointer("/emissiveTexture");
            size_t wanted = 0;
            if (material.contains(base)) wanted = normaliseBase(material, material[base]);
            for (const char* other : {"/pbrMetallicRoughness/metallicRoughnessTexture", "/normalTexture",
                                      "/occlusionTexture", "/emissiveTexture"})
                if (const Json::json_pointer place(other); place != base && material.contains(place))
                    if (!followsBase(material[place], wanted))
                        warnings_.push_back(
                            fmt::format("material '{}': {} wants TEXCOORD_{}, which is not written; TEXCOORD_0 is the "
                                        "base colour's now, TEXCOORD_1 the lightmap's",
                                        material.value("name", ""), place.back(), coordinatesOf(material[place])));
        }
    }

    // Returns the coordinates that it wanted.
    size_t normaliseBase(const Json& material, Json& texture) {
        const size_t wanted = coordinatesOf(texture);
        texture.erase("texCoord");
        if (!texture.contains("extensions")) return wanted;
        const Json::json_pointer transform("/extensions/KHR_texture_transform");
        if (texture.contains(transform)) {
            texture["extensions"].erase("KHR_texture_transform");
            warnings_.push_back(
                fmt::format("material '{}': its texture's transform is in TEXCOORD_0 now; textures "
                            "other than the base colour's may lie elsewhere",
                            material.value("name", "")));
        }
        if (texture["extensions"].empty()) texture.erase("extensions");
        return wanted;
    }

    static size_t coordinatesOf(const Json& texture) {
        const Json::json_pointer own("/extensions/KHR_texture_transform/texCoord");
        return texture.contains(own) ? texture[own].get<size_t>() : texture.value("texCoord", size_t{0});
    }

    // Points it to where the base colour's coordinates are now, if it shares them.
    static bool followsBase(Json& texture, size_t wanted) {
        if (coordinatesOf(texture) != wanted) return false;
        texture.erase("texCoord");
        const Json::json_pointer transform("/extensions/KHR_texture_transform");
        if (texture.contains(transform)) texture[transform].erase("texCoord");
        return true;
    }

    // Without links and "..": a ".." leads to the folder around what a link stands for, not around the link.
    static std::filesystem::path realFolderOf(const std::filesystem::path& file) {
        std::error_code error;
        const auto folder = std::filesystem::absolute(file).parent_path();
        const auto real = std::filesystem::weakly_canonical(folder, error);
        return error ? folder.lexically_normal() : real;
    }

    // Files that the level names relative to itself, seen from the new place.
    void moveReferences(const std::filesystem::path& from, const std::filesystem::path& to) {
        const auto old_folder = realFolderOf(from), new_folder = realFolderOf(behindLinks(to).value_or(to));
        // A file that is a link itself is read from two folders.
        const bool by_two_names = realFolderOf(to) != new_folder;
        if (old_folder == new_folder && !by_two_names) return;
        const auto moved = [&](const std::string& path) {
            const auto file = old_folder / path, seen = file.lexically_relative(new_folder);
            return (seen.empty() || by_two_names ? file : seen).generic_string();
        };
        Json& d = document_.json;
        const Json::json_pointer sky("/scenes/" + std::to_string(d.value("scene", 0)) + "/extras/dimmer_sky_image");
        if (d.contains(sky)) d[sky] = moved(d[sky].get<std::string>());
        const Json::json_pointer ies("/extensions/EXT_lights_ies/lights");
        if (d.contains(ies))
            for (Json& light : d[ies])
                if (const std::string uri = light.value("uri", "data:"); !uri.starts_with("data:"))
                    light["uri"] = percentEncoded(moved(percentDecoded(uri)));
    }

    const ChartedLevel& level_;
    const GltfSource& source_;
    std::vector<std::string>& warnings_;
    GlbDocument document_;
    std::map<int, glm::dmat4> node_from_world_;
    std::map<int, Parts> nodes_;
    std::map<int, Json> original_mesh_;
    std::map<uint32_t, size_t> single_sided_;
};

}  // namespace

Expected<void> writeLevel(const std::filesystem::path& level, const PackData& pack, const std::filesystem::path& out,
                          std::vector<std::string>& warnings) {
    const auto charted = chartAgain(level, pack);
    if (!charted) return std::unexpected(charted.error());
    const auto source = readGltfSource(level);
    if (!source) return std::unexpected(source.error());
    try {
        const auto bytes = LevelWriter(**charted, *source, warnings).write(level, out);
        if (!bytes) return std::unexpected(bytes.error());
        return writeFileAtomically(out, *bytes);
    } catch (const nlohmann::json::exception& problem) {
        return fail(ErrorCode::BadInput,
                    fmt::format("{}: cannot be written again: {}", level.string(), problem.what()));
    } catch (const std::out_of_range&) {
        return fail(ErrorCode::BadInput,
                    fmt::format("{}: cannot be written again: an index is out of range", level.string()));
    }
}

}  // namespace dimmer::cook
