// A cooked level (*.dimmer), read and validated. Immutable after opening, so any number of threads may use one
// pack; runtimes share it and keep it alive.
#pragma once

#include <dimmer/error.h>
#include <dimmer/model_mesh.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace dimmer {

struct PackData;
class PackSource;

enum class ElementKind : uint32_t { LightSet = 0, Door = 1 };

// No pack has a larger Element::max_weight: products of light and weights stay exact where they fit a page's format.
inline constexpr float max_weight_limit = 1e8f;

// A thing that the game controls. Light sets and doors have separate name spaces.
struct Element {
    std::string name;
    ElementKind kind = ElementKind::LightSet;
    float max_weight = 1;  // the largest weight a set accepts; 1 for doors
};

// Light that is added with weight = dim(light set) * product of open(doors_open) * product of (1 - open(doors_closed)).
struct Contribution {
    std::optional<uint32_t> light_set;   // index into elements(); empty: always-on light
    std::vector<uint32_t> doors_open;    // indices into elements(): doors that the light's paths cross
    std::vector<uint32_t> doors_closed;  // indices into elements(): doors off whose closed leaf it bounces
    uint32_t receivers = 0;              // texels at which it is stored
    float energy_dropped = 0;            // share of its energy, 0..1, that fell below the activity threshold
};

// What 4 bytes of a lightmap texel's irradiance hold; both are sampled and filtered by the device.
enum class ColorFormat : uint32_t {
    R11G11B10F = 0,  // B10G11R11_UFLOAT_PACK32: steps of up to 1.6 %, blue 3.1 %, of each channel
    E5B9G9R9 = 1,    // E5B9G9R9_UFLOAT_PACK32: steps of up to 0.4 % of the largest channel
};

// How irradiance falls off for normals other than the surface's own; see runtime/format/texel.h.
enum class DirectionModel : uint32_t { Ahd = 0, Linear = 1 };

struct MeshVertex {
    std::array<float, 3> position_m;   // world space, metres, +Y up
    std::array<float, 3> normal;       // unit, world space
    std::array<float, 2> lightmap_uv;  // 0..1 over the page
};

// A mesh of the level that has a lightmap, in world space, with its final lightmap UVs.
struct Mesh {
    std::string node;  // the glTF node's name
    uint32_t page = 0;
    std::optional<uint32_t> door;           // index into elements(): this mesh is part of that door's leaf
    std::array<float, 3> reflectance{};     // Lambert, linear Rec.709
    std::array<float, 3> emission_cd_m2{};  // radiance of an emissive material
    std::optional<uint32_t> emission_set;   // index into elements(): the set that dims the emission
    std::vector<MeshVertex> vertices;       // single-sided: a double-sided surface is stored as two sides
    std::vector<uint32_t> indices;          // 3 per triangle, counter-clockwise seen from its front
};

// A place to look from: a glTF camera, or the node "player_start".
struct Viewpoint {
    std::string name;
    std::array<float, 3> position_m{};
    std::array<float, 3> forward{};  // unit
    float vertical_fov_rad = 1.0f;
};

class Pack {
   public:
    // Reads, decompresses and validates a whole file. Cost: one pass over the file, and in memory what it holds and,
    // until it is there, one chunk of it. Errors name the chunk.
    [[nodiscard]] static Expected<Pack> open(const std::filesystem::path& path);
    // The same from memory; `name` stands for the file in messages.
    [[nodiscard]] static Expected<Pack> fromBytes(std::span<const std::byte> bytes, std::string_view name);
    // From records already in memory (generators, tests); validated just as a file is.
    [[nodiscard]] static Expected<Pack> fromData(PackData data);

    std::span<const Element> elements() const;
    std::span<const Contribution> contributions() const;
    std::span<const Mesh> meshes() const;
    std::span<const Viewpoint> viewpoints() const;
    // What light grids light: models that stand, models that move, and empty places for such.
    std::span<const PlacedModel> models() const;
    std::span<const ModelMesh> modelMeshes() const;
    // Where the probes of PlacedModel::local_grid are, for the same shading as that of models that move. Of a number
    // that the pack does not have: a slot of 0 x 0 x 0 probes.
    ModelSlot localGridSlot(uint32_t local_grid) const;
    uint32_t pageCount() const;
    uint32_t pageWidth() const;
    uint32_t pageHeight() const;
    ColorFormat colorFormat() const;
    DirectionModel directionModel() const;
    // Stored value = physical value * exposure; a power of two.
    float exposure() const;

    // The records behind the calls above, for executors and tools.
    const PackData& data() const { return *data_; }

   private:
    [[nodiscard]] static Expected<Pack> fromSource(PackSource& source, std::string_view name);
    explicit Pack(std::shared_ptr<const PackData> data) : data_(std::move(data)) {}
    std::shared_ptr<const PackData> data_;
};

}  // namespace dimmer
