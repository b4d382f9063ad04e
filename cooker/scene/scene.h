// A level in memory, as the cooker needs it: world space, metres, +Y up, linear Rec.709, photometric units.
#pragma once

#include <dimmer/error.h>
#include <dimmer/model_mesh.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace dimmer::cook {

enum class AlphaMode { Opaque, Mask, Blend };

enum class TransferFunction : uint8_t { Srgb, Linear };

// A material's image, as files have it: levels hold hundreds, and a quarter of what floats would take.
struct Texture {
    uint32_t width = 0, height = 0;
    TransferFunction transfer = TransferFunction::Srgb;  // of the colour; alpha is always linear
    std::vector<glm::u8vec4> texels;                     // rows from the top
    // Linear. Bilinear, repeating.
    glm::vec4 sample(glm::vec2 uv) const;
    // Linear, over all texels.
    glm::vec4 mean() const;
};

// Of the sky.
struct Image {
    uint32_t width = 0, height = 0;
    std::vector<glm::vec4> texels;  // linear; rows from the top
};

struct Material {
    std::string name;
    glm::vec3 base_color{1};
    float metallic = 0;
    float specular = 1;  // KHR_materials_specular's specularFactor
    glm::vec3 emission_cd_m2{0};
    float alpha = 1;
    AlphaMode alpha_mode = AlphaMode::Opaque;
    float alpha_cutoff = 0.5f;
    bool double_sided = false;
    std::optional<uint32_t> base_color_texture;  // index into Scene::textures, multiplies base_color and alpha
    std::optional<uint32_t> emissive_texture;    // index into Scene::emissive_textures (scene/emission.h)

    // Total Lambert reflectance for a given base colour, clamped to [0, 0.99].
    glm::vec3 reflectance(glm::vec3 color) const;
};

// How a mesh receives light.
enum class Lighting {
    Automatic,  // lightmap when its charts are large and few, else local grid
    Lightmap,
    LocalGrid,
    Dynamic,  // moves: receives light, does not affect it
    None,     // receives nothing; blocks light and reflects none
};

// All primitives of one glTF node, in world space. A mirrored transform has its winding mended.
struct SceneMesh {
    std::string node;
    int gltf_node = -1;  // its index in the file; -1: of none
    int gltf_mesh = -1;  // likewise; nodes with the same one are instances
    glm::dmat4 world_from_node{1};
    std::vector<glm::vec3> positions_m;
    std::vector<glm::vec3> normals;            // unit; one per position
    std::vector<glm::vec2> uv0;                // for textures; empty when the file has none
    std::vector<glm::vec2> uv1;                // the file's lightmap UVs; empty when it has none
    std::string uv1_fault;                     // why those are no unwrap and uv1 was emptied (charts/file_uv.h)
    bool uv1_crosses_walls = false;            // walls stand on triangles of theirs (charts/wall_cuts.h)
    std::vector<glm::uvec3> triangles;         // counter-clockwise seen from the front; no degenerate ones
    std::vector<uint32_t> triangle_materials;  // index into Scene::materials
    std::vector<uint32_t> triangle_regions;    // empty, or per triangle: different regions never share a chart
    Lighting lighting = Lighting::Automatic;
    std::optional<uint32_t> light_set;  // its emissive materials belong to that set
    std::optional<uint32_t> door;
    glm::dmat4 open_from_closed{1};  // of a leaf whose door opens by a pose: a rotation and a translation, world space
    bool is_open_leaf = false;       // this is that leaf where it stands open (scene/open_pose.h)
    std::optional<float> texels_per_metre;
    std::optional<float> grid_spacing_m;
    std::optional<uint32_t> model;  // into Scene::models: what a light grid lights
};

// Lighting::Automatic counts as a lightmap where nobody chose (chooseLighting, models/scene_models.h).
inline bool hasLightmap(const SceneMesh& mesh) {
    return mesh.lighting == Lighting::Automatic || mesh.lighting == Lighting::Lightmap;
}

// What arrives on a model's surface of the light around it, in its own axes: by mesh of the model and vertex of the
// mesh; of its front, and of its back where the mesh has a double-sided material (else the same as the front's).
using ModelTransfers = std::vector<std::vector<std::array<LightTransfer, 2>>>;

// What a light grid lights: all meshes of one node. Model space is the node's, in metres: turned and moved as the node,
// not scaled nor mirrored; where the node is sheared, it is turned as the world.
struct SceneModel {
    std::string node;
    std::vector<uint32_t> meshes;  // into Scene::meshes; none: a place where things that move may stand
    bool moves = false;            // gets its light at run time, where it then is
    glm::mat3 world_from_model{1};
    glm::vec3 origin_m{0};           // world space
    glm::vec3 min_m{0}, max_m{0};    // its box, model space
    glm::uvec3 probes{0};            // along each axis of the box, its corners included; of what stands
    bool is_instance_shape = false;  // model space knows the node's shape alone: nodes of one mesh may share it
    glm::vec3 scale{1};              // that model space has applied to the node's
    std::shared_ptr<const ModelTransfers> transfers;  // null before findTransfers() (models/self_visibility.h)
    glm::vec3 world(glm::vec3 p) const { return origin_m + world_from_model * p; }
};

struct DynamicPlace {
    std::string node;
    glm::dmat4 world_from_node{1};
};

struct LightProfile;  // scene/ies.h

enum class LightType { Point, Spot, Directional };
enum class BakeMode { Indirect, Full, None };

struct PunctualLight {
    std::string node;
    LightType type = LightType::Point;
    glm::vec3 position_m{0};
    glm::vec3 direction{0, 0, -1};  // the way the light travels, unit
    glm::vec3 intensity{0};         // candela (point, spot) or lux on a facing surface (directional)
    // EXT_lights_ies: `intensity` is the peak's, and this the share of it by direction; null: the same all around.
    std::shared_ptr<const LightProfile> profile;
    glm::mat3 profile_from_world{1};  // rotation, mirrored where the node is
    std::optional<float> range_m;     // windows with clamp(1 - (d / range)^4, 0, 1)
    float cone_inner_cos = 1, cone_outer_cos = 0.70710678f;
    BakeMode bake = BakeMode::Indirect;
    std::optional<uint32_t> light_set;
};

struct SceneLightSet {
    std::string name;
    float max_weight = 1;
    // The level's set that this is a lamp of (pipeline/lamps_apart.h); empty: it is the level's own.
    std::string part_of = {};
    bool always_on = false;  // likewise, a lamp of no set: its light is stored however faint it is
};

struct SceneDoor {
    std::string name;
    bool pose = false;  // open means: its leaves stand in their open poses; else they are ignored
};

struct SceneViewpoint {
    std::string name;
    glm::vec3 position_m{0};
    glm::vec3 forward{0, 0, -1};
    float vertical_fov_rad = 1.0f;
};

// Where players move: a box.
struct PlayArea {
    glm::mat4 box_from_world{1};  // onto -1..1 on each axis
    bool contains(glm::vec3 point_m) const {
        const glm::vec3 p = glm::abs(glm::vec3(box_from_world * glm::vec4(point_m, 1)));
        return p.x <= 1 && p.y <= 1 && p.z <= 1;
    }
};

// Names one element: index into light_sets or doors.
struct ElementRef {
    bool is_door = false;
    uint32_t index = 0;
};

struct Scene {
    std::string file;
    std::vector<Material> materials;
    std::vector<std::shared_ptr<const Texture>> textures, emissive_textures;  // shared by all copies of a scene
    std::vector<SceneMesh> meshes;  // dynamic ones included; they neither block nor reflect
    std::vector<PunctualLight> lights;
    std::vector<SceneLightSet> light_sets;  // in order of first appearance
    std::vector<SceneDoor> doors;           // in order of first appearance
    std::vector<std::vector<ElementRef>> combinations;
    std::vector<SceneViewpoint> viewpoints;    // "player_start" first when there is one, then glTF cameras
    std::vector<DynamicPlace> dynamic_places;  // dimmer_dynamic on an empty node
    std::vector<SceneModel> models;            // empty before listModels (models/scene_models.h)
    std::vector<PlayArea> play_areas;
    glm::vec3 sky_radiance_cd_m2{0};  // of the whole sky; with an image: what its texels are multiplied by
    // Equirectangular, rows from the top (+Y); the middle column is +X, to its right comes +Z. Null: a constant sky.
    std::shared_ptr<const Image> sky_image;
    std::string settings;               // of the cook, as the level has them: "key=value, key=value"
    std::vector<std::string> warnings;  // each names the file, the node and what was done
};

// Reads .glb or .gltf. Errors (ErrorCode::BadInput or Io) name the file, the node and the mend.
// The level's meaning is specified in docs/level.md.
Expected<Scene> importLevel(const std::filesystem::path& path);

}  // namespace dimmer::cook
