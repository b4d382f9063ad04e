// importLevel: from the file to the scene, node by node.
#include <fmt/format.h>
#include <scene/elements.h>
#include <scene/extras.h>
#include <scene/gltf_check.h>
#include <scene/gltf_file.h>
#include <scene/ies_light.h>
#include <scene/leftovers.h>
#include <scene/light.h>
#include <scene/material.h>
#include <scene/mesh.h>
#include <scene/misplaced_keys.h>
#include <scene/node_walk.h>
#include <scene/open_pose.h>
#include <scene/sky.h>

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <new>
#include <numeric>
#include <stdexcept>

namespace dimmer::cook {
namespace {

constexpr std::string_view player_start = "player_start";
constexpr double texel_density_max = 256;  // per metre, as in profiles

class LevelImporter {
   public:
    // `animated`: per node, whether an animation moves it.
    LevelImporter(const tinygltf::Model& model, std::string file, std::vector<bool> animated)
        : model_(model), animated_(std::move(animated)) {
        scene_.file = std::move(file);
    }

    Expected<Scene> run() {
        for (const auto step :
             {&LevelImporter::prepare, &LevelImporter::nodes, &LevelImporter::sky, &LevelImporter::conclude})
            if (const auto ok = (this->*step)(); !ok) return std::unexpected(ok.error());
        return std::move(scene_);
    }

   private:
    Expected<void> prepare() {
        if (const auto ok = checkModel(context_); !ok) return ok;
        warnOfExtensions(context_);
        warnOfOtherScenes(context_);
        auto placed = placeNodes(context_);
        if (!placed) return std::unexpected(placed.error());
        placed_ = std::move(*placed);
        auto mappings = importMaterials(context_, usedMaterials());
        if (!mappings) return std::unexpected(mappings.error());
        meshes_.emplace(context_, std::move(*mappings));
        warnKeys();
        return {};
    }

    // By meshes of the scene's nodes: images of other materials may be missing.
    std::vector<bool> usedMaterials() const {
        std::vector<bool> used(model_.materials.size());
        for (const PlacedNode& at : placed_) {
            const int mesh = model_.nodes[static_cast<size_t>(at.node)].mesh;
            if (mesh < 0) continue;
            for (const tinygltf::Primitive& p : model_.meshes[static_cast<size_t>(mesh)].primitives)
                if (p.material >= 0) used[static_cast<size_t>(p.material)] = true;
        }
        return used;
    }

    const tinygltf::Value& sceneExtras() const {
        return model_.scenes[static_cast<size_t>(std::max(model_.defaultScene, 0))].extras;
    }

    void warnKeys() {
        const auto warnAll = [&](const auto& all, std::string (ImportContext::*label)(int) const) {
            for (int i = 0; const auto& item : all) {
                warnUnknownKeys(context_, item.extras, ExtrasPlace::Node, (context_.*label)(i));
                ++i;
            }
        };
        warnAll(model_.nodes, &ImportContext::nodeLabel);
        warnAll(model_.meshes, &ImportContext::meshLabel);
        warnAll(model_.lights, &ImportContext::lightLabel);
        warnAll(model_.materials, &ImportContext::materialLabel);
        warnUnknownKeys(context_, sceneExtras(), ExtrasPlace::Scene, "scene");
        warnUnknownKeys(context_, model_.extras, ExtrasPlace::File, "the file's own extras");
    }

    Expected<void> nodes() {
        door_of_node_.resize(model_.nodes.size());
        for (const PlacedNode& at : placed_)
            if (const auto ok = node(at); !ok) return ok;
        return {};
    }

    Expected<void> node(const PlacedNode& at) {
        const tinygltf::Node& node = model_.nodes[static_cast<size_t>(at.node)];
        const std::string owner = context_.nodeLabel(at.node);
        const std::optional<int> light = lightOf(node);
        const bool shines = isLight(node);
        const bool has_content = node.mesh >= 0 || shines || node.camera >= 0 || node.name == player_start;
        if (has_content && at.singular != -1) return singular(at, owner);

        const Extras of_light = extrasOf(at, light), extras = withMaterials(of_light, node.mesh);
        if (const auto ok = door(at, extras, owner); !ok) return ok;
        const auto play_area = extras.flag("dimmer_play_area");
        if (!play_area) return std::unexpected(play_area.error());
        if (*play_area && at.singular != -1) return singular(at, owner);
        if (*play_area)
            if (const auto ok = playArea(at); !ok) return ok;

        if (!carriesLight(at.node)) {
            const NodeContent content{node.mesh >= 0, shines, shines && of_light.has("dimmer_bake")};
            if (const auto ok = warnOfMisplacedKeys(context_, extras, owner, content); !ok) return ok;
        }
        if (node.mesh >= 0 && !*play_area)
            if (const auto ok = mesh(at, extras, owner); !ok) return ok;
        if (shines && door_of_node_[static_cast<size_t>(at.node)].door)
            context_.warn(owner,
                          "is a lamp below a door; lamps do not move with doors, and it shines from where it is.");
        if (shines)
            if (const auto ok = this->light(at, light, of_light); !ok) return ok;
        if (node.mesh < 0 && !shines)
            if (const auto ok = withoutMeshOrLight(at, extras, owner); !ok) return ok;
        if (node.camera >= 0 || node.name == player_start) return viewpoint(at);
        return {};
    }

    // The cube -1..1 of the node, or the box of its mesh.
    Expected<void> playArea(const PlacedNode& at) {
        glm::dvec3 centre(0), half(1);
        const int mesh_index = model_.nodes[static_cast<size_t>(at.node)].mesh;
        if (mesh_index >= 0) {
            std::vector<size_t> all(model_.meshes[static_cast<size_t>(mesh_index)].primitives.size());
            std::iota(all.begin(), all.end(), size_t{0});
            const auto mesh = meshes_->import(at.node, all, glm::dmat4(1));
            if (!mesh) return std::unexpected(mesh.error());
            if (mesh->positions_m.empty()) return {};
            glm::dvec3 low(mesh->positions_m[0]), high = low;
            for (const glm::vec3& p : mesh->positions_m) {
                low = glm::min(low, glm::dvec3(p));
                high = glm::max(high, glm::dvec3(p));
            }
            centre = 0.5 * (low + high);
            half = glm::max(0.5 * (high - low), 1e-3);  // a flat mesh has a box too
        }
        const glm::dmat4 world_from_box = glm::scale(glm::translate(at.world_from_node, centre), half);
        scene_.play_areas.push_back({glm::mat4(glm::inverse(world_from_box))});
        return {};
    }

    std::unexpected<Error> singular(const PlacedNode& at, const std::string& owner) const {
        const std::string whose = at.singular == at.node
                                      ? "its transform"
                                      : "the transform of " + context_.nodeLabel(at.singular) + " above it";
        return context_.error(owner, whose + " is singular: it flattens space. Give every axis a scale other than 0.");
    }

    static bool isLight(const tinygltf::Node& node) { return lightOf(node) || hasLightProfile(node); }

    // Blender's exporter hangs lights below a node "<object>_Orientation" of its own, while the custom properties stay
    // with the object.
    bool isOrientationOf(int node, int parent) const {
        return parent >= 0 && model_.nodes[static_cast<size_t>(node)].name ==
                                  model_.nodes[static_cast<size_t>(parent)].name + "_Orientation";
    }

    // Its keys are the light's.
    bool carriesLight(int node) const {
        return std::ranges::any_of(model_.nodes[static_cast<size_t>(node)].children, [&](int child) {
            return isOrientationOf(child, node) && isLight(model_.nodes[static_cast<size_t>(child)]);
        });
    }

    // Without its materials', which do not speak for a light.
    Extras extrasOf(const PlacedNode& at, std::optional<int> light) const {
        const tinygltf::Node& node = model_.nodes[static_cast<size_t>(at.node)];
        Extras extras(context_);
        extras.add(node.extras, context_.nodeLabel(at.node));
        if (isLight(node) && isOrientationOf(at.node, at.parent))
            extras.add(model_.nodes[static_cast<size_t>(at.parent)].extras, context_.nodeLabel(at.parent));
        if (node.mesh >= 0)
            extras.add(model_.meshes[static_cast<size_t>(node.mesh)].extras, context_.meshLabel(node.mesh));
        if (light) extras.add(model_.lights[static_cast<size_t>(*light)].extras, context_.lightLabel(*light));
        return extras;
    }

    Extras withMaterials(Extras extras, int mesh) const {
        if (mesh >= 0)
            for (const tinygltf::Primitive& primitive : model_.meshes[static_cast<size_t>(mesh)].primitives)
                addMaterial(extras, primitive.material);
        return extras;
    }

    void addMaterial(Extras& extras, int material) const {
        if (material >= 0)
            extras.add(model_.materials[static_cast<size_t>(material)].extras, context_.materialLabel(material));
    }

    // A node belongs to the nearest door at or above it, and moves with all that is above it of that door.
    Expected<void> door(const PlacedNode& at, const Extras& extras, const std::string& owner) {
        const auto own = elements_.door(extras, owner);
        if (!own) return std::unexpected(own.error());
        DoorPart& part = door_of_node_[static_cast<size_t>(at.node)];
        if (at.parent >= 0) part = door_of_node_[static_cast<size_t>(at.parent)];
        if (!*own) {
            warnOfPoseWithoutDoor(context_, extras, owner);
            return {};
        }
        const auto pose = elements_.openPose(extras, owner, **own);
        if (!pose) return std::unexpected(pose.error());
        const glm::dmat4 moved = at.singular == -1 ? inWorld(*pose, at.world_from_node) : glm::dmat4(1);
        part = {*own, part.door == *own ? part.open_from_closed * moved : moved};
        return {};
    }

    // A movement in metres along and about a node's axes, as a movement in the world.
    static glm::dmat4 inWorld(const glm::dmat4& movement, const glm::dmat4& world_from_node) {
        glm::dmat4 unscaled = world_from_node;
        for (int axis = 0; axis < 3; ++axis) unscaled[axis] = glm::normalize(unscaled[axis]);
        return unscaled * movement * glm::inverse(unscaled);
    }

    Expected<Lighting> lighting(const Extras& extras, const std::string& owner) const {
        const auto stated = extras.choice("dimmer_lighting", {"lightmap", "local_grid", "dynamic", "none"});
        if (!stated) return std::unexpected(stated.error());
        const auto dynamic = extras.flag("dimmer_dynamic");
        if (!dynamic) return std::unexpected(dynamic.error());
        constexpr Lighting of_choice[] = {Lighting::Lightmap, Lighting::LocalGrid, Lighting::Dynamic, Lighting::None};
        const Lighting lighting = *stated ? of_choice[**stated] : Lighting::Automatic;
        const bool says_no = extras.has("dimmer_dynamic") && !*dynamic;
        if (!*dynamic && !(says_no && lighting == Lighting::Dynamic)) return lighting;
        if (*stated && (says_no || lighting != Lighting::Dynamic))
            return context_.error(owner, "'dimmer_dynamic' contradicts its 'dimmer_lighting'. Remove one of them.");
        return Lighting::Dynamic;
    }

    struct MeshSettings {
        Lighting lighting = Lighting::Automatic;
        std::optional<float> texels_per_metre, grid_spacing_m;
    };

    Expected<MeshSettings> meshSettings(const Extras& extras, const std::string& owner) {
        const auto lighting = this->lighting(extras, owner);
        if (!lighting) return std::unexpected(lighting.error());
        const auto density = extras.positive("dimmer_texel_density");
        if (!density) return std::unexpected(density.error());
        if (density->value_or(0) > texel_density_max)
            return context_.error(owner, fmt::format("its 'dimmer_texel_density' is {}; more than {} texels per metre "
                                                     "are not made. Correct the custom property.",
                                                     **density, texel_density_max));
        const auto spacing = extras.positive("dimmer_grid_spacing");
        if (!spacing) return std::unexpected(spacing.error());
        warnOfOtherLightingsKeys(context_, extras, owner, *lighting);
        const auto narrow = [](std::optional<double> value) {
            return value ? std::optional(static_cast<float>(*value)) : std::nullopt;
        };
        return MeshSettings{*lighting, narrow(*density), narrow(*spacing)};
    }

    // Primitives whose emission one light set dims, or none. Named by the node or mesh, a set has them all; by a
    // material, those of that material.
    struct EmissionGroup {
        std::optional<uint32_t> light_set;
        std::string named_by;
        bool by_material = false;  // then not a light's of the same node
        std::vector<size_t> primitives;
    };

    Expected<std::vector<EmissionGroup>> emissionGroups(const PlacedNode& at, const std::string& owner) {
        const int mesh_index = model_.nodes[static_cast<size_t>(at.node)].mesh;
        const tinygltf::Mesh& mesh = model_.meshes[static_cast<size_t>(mesh_index)];
        Extras shared(context_);
        shared.add(model_.nodes[static_cast<size_t>(at.node)].extras, owner);
        shared.add(mesh.extras, context_.meshLabel(mesh_index));

        std::vector<EmissionGroup> groups;
        for (size_t i = 0; i < mesh.primitives.size(); ++i) {
            Extras extras = shared;
            addMaterial(extras, mesh.primitives[i].material);
            const auto set = elements_.lightSet(extras);
            if (!set) return std::unexpected(set.error());
            auto group = std::ranges::find(groups, *set, &EmissionGroup::light_set);
            if (group == groups.end()) {
                const std::string named_by = *set ? extras.ownerOf("dimmer_light_set") : "";
                group = groups.insert(groups.end(), {*set, named_by, !shared.has("dimmer_light_set"), {}});
            }
            group->primitives.push_back(i);
        }
        return groups;
    }

    bool isEmissiveMesh(const SceneMesh& mesh) const {
        return std::ranges::any_of(mesh.triangle_materials,
                                   [&](uint32_t material) { return isEmissive(scene_.materials[material]); });
    }

    // What joints or shape keys would move stands here as its vertices and its node say. What is dynamic may move.
    void warnOfDeformation(const tinygltf::Node& node, const std::string& owner) {
        if (node.skin >= 0)
            context_.warn(owner,
                          "is skinned, but was placed by its own transform, not by its joints. Apply the armature "
                          "before exporting.");
        const auto& weights =
            node.weights.empty() ? model_.meshes[static_cast<size_t>(node.mesh)].weights : node.weights;
        if (std::ranges::any_of(weights, [](double weight) { return weight != 0; }))
            context_.warn(owner, "has morph targets that were ignored. Apply the shape keys before exporting.");
    }

    Expected<void> mesh(const PlacedNode& at, const Extras& extras, const std::string& owner) {
        const tinygltf::Node& node = model_.nodes[static_cast<size_t>(at.node)];
        const auto settings = meshSettings(extras, owner);
        if (!settings) return std::unexpected(settings.error());
        if (settings->lighting != Lighting::Dynamic) warnOfDeformation(node, owner);
        const auto groups = emissionGroups(at, owner);
        if (!groups) return std::unexpected(groups.error());
        bool any = false;
        for (const EmissionGroup& group : *groups) {
            Expected<SceneMesh> mesh = meshes_->import(at.node, group.primitives, at.world_from_node);
            if (!mesh) return std::unexpected(mesh.error());
            if (group.light_set && !isEmissiveMesh(*mesh)) {
                const std::string& set = scene_.light_sets[*group.light_set].name;
                if (group.by_material) return withoutEmission(owner, set, group.named_by);
                if (!isLight(node)) return withoutLight(owner, set, group.named_by);
            }
            if (mesh->triangles.empty()) continue;
            any = true;
            place(at, *settings, group.light_set, std::move(*mesh));
        }
        if (!any) context_.warn(owner, "its mesh has no triangles and was ignored.");
        if (any && settings->lighting == Lighting::Automatic)
            leftovers_.consider(node.name.empty() ? model_.meshes[static_cast<size_t>(node.mesh)].name : node.name,
                                owner);
        return {};
    }

    void place(const PlacedNode& at, const MeshSettings& settings, std::optional<uint32_t> light_set, SceneMesh mesh) {
        mesh.node = nodeName(at.node);
        mesh.gltf_node = at.node;
        mesh.gltf_mesh = model_.nodes[static_cast<size_t>(at.node)].mesh;
        mesh.world_from_node = at.world_from_node;
        mesh.lighting = settings.lighting;
        mesh.texels_per_metre = settings.texels_per_metre;
        mesh.grid_spacing_m = settings.grid_spacing_m;
        if (isEmissiveMesh(mesh)) mesh.light_set = light_set;
        const DoorPart& part = door_of_node_[static_cast<size_t>(at.node)];
        mesh.door = part.door;
        mesh.open_from_closed = part.open_from_closed;
        if (mesh.door && mesh.lighting != Lighting::Dynamic) elements_.doorHasGeometry(*mesh.door);
        if (mesh.door && mesh.lighting == Lighting::LocalGrid) {
            context_.warn(context_.nodeLabel(at.node), "is a door's leaf; it has a lightmap, not a local grid.");
            mesh.lighting = Lighting::Lightmap;
        }
        scene_.meshes.push_back(std::move(mesh));
    }

    std::string nodeName(int index) const {
        const std::string& name = model_.nodes[static_cast<size_t>(index)].name;
        return name.empty() ? fmt::format("node_{}", index) : name;
    }

    std::unexpected<Error> withoutLight(const std::string& owner, const std::string& set,
                                        const std::string& stated_by) const {
        return context_.error(owner,
                              fmt::format("is in the light set '{}'{}, but has neither a light nor an emissive mesh. "
                                          "Remove 'dimmer_light_set', or give its material emission.",
                                          set, stated_by == owner ? "" : fmt::format(" (by {})", stated_by)));
    }
    // A material speaks for its own emission alone.
    std::unexpected<Error> withoutEmission(const std::string& owner, const std::string& set,
                                           const std::string& material) const {
        return context_.error(owner, fmt::format("is in the light set '{}' (by {}), which does not shine. Give it "
                                                 "emission; a light's 'dimmer_light_set' is its node's.",
                                                 set, material));
    }

    static bool isInReach(const PlacedNode& at) {
        return glm::length(glm::dvec3(at.world_from_node[3])) <= coordinate_max_m;
    }
    static std::string farAway(std::string_view what) {
        return fmt::format("{} more than {:.0f} km from the origin. Correct its translation.", what,
                           coordinate_max_m / 1000);
    }

    // A node with a profile may carry a punctual light besides, for programs that do not read profiles.
    Expected<void> light(const PlacedNode& at, std::optional<int> punctual, const Extras& extras) {
        const bool profile = hasLightProfile(model_.nodes[static_cast<size_t>(at.node)]);
        Expected<PunctualLight> light = profile ? profiles_.place(at.node, at.world_from_node)
                                                : importLight(context_, *punctual, at.node, at.world_from_node);
        if (!light) return std::unexpected(light.error());
        if (light->type != LightType::Directional && !isInReach(at))
            return context_.error(context_.nodeLabel(at.node), farAway("its light is"));
        light->node = nodeName(at.node);
        const auto bake = extras.choice("dimmer_bake", {bake_modes.begin(), bake_modes.end()});
        if (!bake) return std::unexpected(bake.error());
        constexpr BakeMode of_choice[] = {BakeMode::Indirect, BakeMode::Full, BakeMode::None};
        if (*bake) light->bake = of_choice[**bake];
        const auto set = elements_.lightSet(extras);
        if (!set) return std::unexpected(set.error());
        light->light_set = *set;
        scene_.lights.push_back(std::move(*light));
        return {};
    }

    Expected<void> withoutMeshOrLight(const PlacedNode& at, const Extras& extras, const std::string& owner) {
        const auto set = extras.text("dimmer_light_set");
        if (!set) return std::unexpected(set.error());
        if (*set && !carriesLight(at.node)) return withoutLight(owner, **set, extras.ownerOf("dimmer_light_set"));
        const auto dynamic = lighting(extras, owner);
        if (!dynamic) return std::unexpected(dynamic.error());
        if (*dynamic != Lighting::Dynamic) return {};
        if (at.singular != -1) return singular(at, owner);
        if (!isInReach(at)) return context_.error(owner, farAway("is a place for what moves,"));
        scene_.dynamic_places.push_back({nodeName(at.node), at.world_from_node});
        is_place_[static_cast<size_t>(at.node)] = true;
        return {};
    }

    Expected<void> viewpoint(const PlacedNode& at) {
        const int camera = model_.nodes[static_cast<size_t>(at.node)].camera;
        Expected<SceneViewpoint> view =
            importViewpoint(context_, camera < 0 ? std::nullopt : std::optional(camera), at.node, at.world_from_node);
        if (!view) return std::unexpected(view.error());
        if (view->name.empty()) view->name = nodeName(at.node);
        auto& views = scene_.viewpoints;
        views.insert(view->name == player_start ? views.begin() : views.end(), std::move(*view));
        return {};
    }

    Expected<void> sky() {
        Extras extras(context_);
        extras.add(sceneExtras(), "scene");
        return importSky(context_, extras);
    }

    // What seems to be meant to move, and is baked where it stands.
    void warnOfWhatStandsStill() {
        std::vector<int> parent(model_.nodes.size(), -1);
        for (const PlacedNode& at : placed_) parent[static_cast<size_t>(at.node)] = at.parent;
        int last = -1;
        for (const SceneMesh& mesh : scene_.meshes) {
            if (mesh.lighting == Lighting::Dynamic || mesh.door || mesh.gltf_node == last) continue;
            last = mesh.gltf_node;
            for (int node = last; node >= 0; node = parent[static_cast<size_t>(node)]) {
                const auto i = static_cast<size_t>(node);
                if (animated_[i])
                    context_.warn(context_.nodeLabel(last),
                                  "is animated, and is baked where it stands, with the shadow that it has there. "
                                  "'dimmer_dynamic': 1 leaves it out and lights it as it moves; doors have "
                                  "'dimmer_door'.");
                else if (is_place_[i])
                    context_.warn(
                        context_.nodeLabel(last),
                        fmt::format("is baked where it stands, though {} above it has 'dimmer_dynamic', which "
                                    "reaches no meshes below. Set it at the mesh's node too.",
                                    context_.nodeLabel(node)));
                else
                    continue;
                break;
            }
        }
    }

    Expected<void> conclude() {
        if (const auto ok = elements_.checkDoors(); !ok) return ok;
        if (const auto ok = checkOpenPoses(context_); !ok) return ok;
        leftovers_.warn(context_);
        warnOfWhatStandsStill();
        Extras extras(context_);
        extras.add(sceneExtras(), "scene");
        if (const auto ok = elements_.combinations(extras); !ok) return ok;
        const auto settings = extras.text("dimmer_settings");
        if (!settings) return std::unexpected(settings.error());
        scene_.settings = settings->value_or("");
        if (scene_.meshes.empty())
            return context_.error("scene",
                                  "holds no triangles, so there is nothing to light. Export the level's meshes.");
        return {};
    }

    const tinygltf::Model& model_;
    std::vector<bool> animated_, is_place_ = std::vector<bool>(animated_.size());  // per node
    Scene scene_;
    ImportContext context_{model_, scene_};
    Elements elements_{context_};
    Leftovers leftovers_;
    LightProfiles profiles_{context_};
    std::vector<PlacedNode> placed_;
    std::optional<MeshImporter> meshes_;
    struct DoorPart {
        std::optional<uint32_t> door;
        glm::dmat4 open_from_closed{1};
    };
    std::vector<DoorPart> door_of_node_;
};

}  // namespace

Expected<Scene> importLevel(const std::filesystem::path& path) {
    try {
        const Expected<GltfSource> source = readGltfSource(path);
        if (!source) return std::unexpected(source.error());
        const tinygltf::Model& model = source->model;
        return LevelImporter(model, path.string(), animatedNodes(source->json, model.nodes.size())).run();
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::OutOfMemory, path.string() + ": needs more memory than there is. Split the level.");
    } catch (const std::length_error&) {
        return fail(ErrorCode::OutOfMemory, path.string() + ": needs more memory than there is. Split the level.");
    } catch (const std::filesystem::filesystem_error& problem) {
        return fail(ErrorCode::Io, problem.what());
    }
}

}  // namespace dimmer::cook
