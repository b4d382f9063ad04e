// `cook --write-level`: a level with its final UVs that is valid glTF, draws like the pack, and cooks like the source.
#include <charts/file_uv.h>
#include <charts/unwrap.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <pipeline/cooked_level.h>
#include <pipeline/small_level.h>
#include <pipeline/write_level.h>
#include <report/page_pictures.h>
#include <write/glb_document.h>
#include <write/pack_writer.h>

#include <cstring>
#include <fstream>
#include <map>
#include <set>

namespace dimmer::cook::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

// A room with a lamp, a panel in a set, a door that turns and is mirrored, a cloth with two sides, a crate that moves,
// and what the cooker does not know.
LevelFile richLevel() {
    LevelFile level;
    const int white = addWhite(level);
    const int cloth = addWhite(level, {{"name", "cloth"}, {"doubleSided", true}});
    const int glow = addWhite(level, {{"name", "glow"}, {"emissiveFactor", {1, 1, 1}}});
    level.addNode(
        {{"name", "room"}, {"mesh", addRoomMesh(level, {0, 0, 0}, 3, white)}, {"extras", {{"mood", "calm"}}}});
    level.addNode({{"name", "panel"},
                   {"mesh", level.addSquareMesh(glow)},
                   {"translation", {1, 2, 0.1}},
                   {"extras", {{"dimmer_light_set", "panels"}, {"dimmer_max_weight", 2}}}});
    const int hinge = level.addNode({{"name", "hinge"},
                                     {"translation", {2, 1, 1}},
                                     {"rotation", {0, 0.6, 0, 0.8}},
                                     {"scale", {-1, 1.5, 1}},
                                     {"extras",
                                      {{"dimmer_door", "front"},
                                       {"dimmer_door_open", "pose"},
                                       {"dimmer_door_rotation", {0, 0.7071068, 0, 0.7071068}}}}});
    level.addNode({{"name", "leaf"}, {"mesh", level.addSquareMesh(white)}}, hinge);
    level.addNode({{"name", "curtain"}, {"mesh", level.addSquareMesh(cloth)}, {"translation", {1, 1, 2}}});
    level.addNode({{"name", "crate"}, {"mesh", level.addSquareMesh(white)}, {"extras", {{"dimmer_dynamic", 1}}}});
    const int lamp = level.addLight("lamp", {{"type", "point"}, {"intensity", 50}}, {{"dimmer_light_set", "hall"}});
    level.node(lamp)["translation"] = {1.5, 2, 1.5};
    level.document["asset"]["copyright"] = "someone";
    return level;
}

struct Written {
    TemporaryFolder folder;
    CookResult cooked;
    std::vector<std::string> warnings;
    std::filesystem::path path;

    // By default a wall of 3 m fills a page, so that nodes are parted.
    explicit Written(const LevelFile& level, uint32_t page_size = 64, uint32_t texels_per_metre = 16) {
        writeLevel(folder, level);
        const auto profile = writeText(folder, "quick.json",
                                       fmt::format(R"({{"lightmaps": {{"page_size": {}, "texels_per_metre": {}}},
            "bake": {{"draft": {{"samples_per_texel": 2, "series_rays": 16, "rays": 256, "bounces": 8}}}}}})",
                                                   page_size, texels_per_metre));
        SilentProgress silent;
        CookOptions options;
        options.level = folder.path / "level.gltf";
        options.pack = folder.path / "level.dimmer";
        options.profile = profile.string();
        options.quality = "draft";
        auto result = cook(options, silent);
        EXPECT_TRUE(result) << result.error().message;
        if (!result) return;
        cooked = std::move(*result);
        path = folder.path / "out.glb";
        const auto ok = cook::writeLevel(folder.path / "level.gltf", cooked.pack, path, warnings);
        EXPECT_TRUE(ok) << ok.error().message;
    }
};

// A GLB file taken apart by the letter of the specification.
struct Glb {
    json document;
    std::vector<uint8_t> binary;

    explicit Glb(const std::filesystem::path& path) {
        std::ifstream in(path, std::ios::binary);
        const std::vector<uint8_t> bytes{std::istreambuf_iterator<char>(in), {}};
        const auto word = [&](size_t at) {
            uint32_t value = 0;
            EXPECT_LE(at + 4, bytes.size());
            std::memcpy(&value, bytes.data() + at, 4);
            return value;
        };
        EXPECT_EQ(word(0), 0x46546C67u);
        EXPECT_EQ(word(4), 2u);
        EXPECT_EQ(word(8), bytes.size());
        EXPECT_EQ(word(12) % 4, 0u);
        EXPECT_EQ(word(16), 0x4E4F534Au);
        const size_t json_end = 20 + word(12);
        document = json::parse(bytes.begin() + 20, bytes.begin() + static_cast<std::ptrdiff_t>(json_end));
        EXPECT_EQ(word(json_end + 4), 0x004E4942u);
        EXPECT_EQ(json_end + 8 + word(json_end), bytes.size());
        binary.assign(bytes.begin() + static_cast<std::ptrdiff_t>(json_end + 8), bytes.end());
    }

    template <class T>
    std::vector<T> values(const json& accessor, size_t components) const {
        const json& view = document["bufferViews"].at(accessor["bufferView"].get<size_t>());
        const size_t bytes = accessor["count"].get<size_t>() * components * sizeof(T);
        const size_t offset = view["byteOffset"].get<size_t>();
        EXPECT_EQ(offset % 4, 0u);
        EXPECT_EQ(bytes, view["byteLength"]);
        EXPECT_LE(offset + bytes, binary.size());
        std::vector<T> out(bytes / sizeof(T));
        std::memcpy(out.data(), binary.data() + offset, bytes);
        return out;
    }
};

// Lengths have 32 bits; a lesser limit stands for 4 GiB here.
TEST(GlbDocument, RefusesWhatIsTooLong) {
    GlbDocument document;
    document.json["asset"]["version"] = "2.0";
    document.addView(std::array<std::byte, 5>{});
    const auto whole = document.bytes();
    ASSERT_TRUE(whole) << whole.error().message;
    EXPECT_TRUE(document.bytes(whole->size()));
    const auto refused = document.bytes(whole->size() - 1);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::BadInput);
    EXPECT_THAT(refused.error().message, HasSubstr(fmt::format("{} bytes", whole->size())));
}

// Two sets that share an emissive material have a copy each while they are baked: the level is the same level.
TEST(WriteLevel, SetsMayShareAnEmissiveMaterial) {
    LevelFile level = LevelFile::withFloor();
    const int bulb = level.addMaterial({{"name", "bulb"}, {"emissiveFactor", {1, 1, 1}}}), shade = addWhite(level);
    for (const char* set : {"hall", "kitchen"}) {
        const int lamp = level.addSquareMesh(bulb);
        json second = level.primitive(lamp);
        second["material"] = shade;
        level.document["meshes"][static_cast<size_t>(lamp)]["primitives"].push_back(second);
        const float up = set[0] == 'h' ? 1.0f : 2.0f;
        level.addNode({{"name", set},
                       {"mesh", lamp},
                       {"translation", {0, up, 0}},
                       {"extras", {{"dimmer_light_set", set}, {"dimmer_lighting", "lightmap"}}}});
    }
    const Written written(level);
    const Glb glb(written.path);
    std::set<std::string> materials;
    for (const json& mesh : glb.document["meshes"])
        for (const json& primitive : mesh["primitives"])
            if (primitive.contains("material"))
                materials.insert(glb.document["materials"].at(primitive["material"].get<size_t>()).value("name", ""));
    EXPECT_TRUE(materials.contains("bulb"));
}

// What the written level has not is said, and textures follow the coordinates that they share with the base colour.
TEST(WriteLevel, SaysWhatIsLost) {
    LevelFile level = LevelFile::withFloor();
    const int mesh = level.document["nodes"][0]["mesh"];
    json& attributes = level.primitive(mesh)["attributes"];
    attributes["COLOR_0"] = attributes["POSITION"];
    attributes["TEXCOORD_2"] = level.addVec2({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
    level.document["images"] = {{{"uri",
                                  "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8"
                                  "/5+hHgAHggJ/PchI7wAAAABJRU5ErkJggg=="}}};
    level.document["textures"] = {{{"source", 0}}};
    json& material = level.document["materials"][0];
    material["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}, {"texCoord", 2}};
    material["normalTexture"] = {{"index", 0}, {"texCoord", 2}};
    material["occlusionTexture"] = {{"index", 0}, {"texCoord", 1}};
    material["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {
        {"index", 0}, {"texCoord", 2}, {"extensions", {{"KHR_texture_transform", {{"texCoord", 3}}}}}};
    const Written written(level);
    EXPECT_THAT(written.warnings, testing::Contains(testing::AllOf(testing::HasSubstr("floor"),
                                                                   testing::HasSubstr("COLOR_0 is not written"))));
    LevelFile more = level;
    more.primitive(mesh)["extras"] = {{"sound", "wood"}};
    more.primitive(mesh)["extensions"] = {{"KHR_materials_variants", {{"mappings", json::array()}}}};
    more.document["meshes"][static_cast<size_t>(mesh)]["extensions"] = {{"EXT_of_a_mesh", json::object()}};
    EXPECT_THAT(Written(more).warnings,
                testing::Contains(testing::HasSubstr(
                    "COLOR_0, EXT_of_a_mesh, KHR_materials_variants, extras of its primitives are not written")));
    EXPECT_THAT(written.warnings, testing::Contains(testing::HasSubstr("occlusionTexture wants TEXCOORD_1")));
    EXPECT_THAT(written.warnings, testing::Contains(testing::HasSubstr("metallicRoughnessTexture wants TEXCOORD_3")));
    const Glb glb(written.path);
    const json& out = glb.document["materials"][0];
    EXPECT_FALSE(out["normalTexture"].contains("texCoord"));
    EXPECT_FALSE(out["pbrMetallicRoughness"]["baseColorTexture"].contains("texCoord"));
    EXPECT_THAT(written.cooked.stats.warnings, testing::Contains(testing::HasSubstr("vertex colours")));
}

TEST(WriteLevel, IsValidGltf) {
    const Written written(richLevel());
    const Glb glb(written.path);
    const json& d = glb.document;
    for (const auto& [key, value] : d.items()) EXPECT_FALSE(value.is_array() && value.empty()) << key;
    ASSERT_EQ(d["buffers"].size(), 1u);
    EXPECT_LE(d["buffers"][0]["byteLength"], glb.binary.size());
    EXPECT_FALSE(d["buffers"][0].contains("uri"));
    std::vector<int> accessor_uses(d["accessors"].size()), view_uses(d["bufferViews"].size());
    for (const json& accessor : d["accessors"]) ++view_uses.at(accessor["bufferView"].get<size_t>());
    for (const json& mesh : d["meshes"])
        for (const json& primitive : mesh["primitives"]) {
            const auto accessor = [&](const json& index) -> const json& {
                ++accessor_uses.at(index.get<size_t>());
                return d["accessors"][index.get<size_t>()];
            };
            const json& position = accessor(primitive["attributes"]["POSITION"]);
            const auto points = glb.values<float>(position, 3);
            const auto count = position["count"].get<size_t>();
            for (size_t c = 0; c < 3; ++c) {
                float least = points[c], most = points[c];
                for (size_t i = c; i < points.size(); i += 3) {
                    least = std::min(least, points[i]);
                    most = std::max(most, points[i]);
                }
                EXPECT_EQ(position["min"][c], least);
                EXPECT_EQ(position["max"][c], most);
            }
            const auto normals = glb.values<float>(accessor(primitive["attributes"]["NORMAL"]), 3);
            ASSERT_EQ(normals.size(), points.size());
            for (size_t i = 0; i < normals.size(); i += 3)
                EXPECT_NEAR(std::hypot(normals[i], normals[i + 1], normals[i + 2]), 1, 1e-5);
            if (primitive["attributes"].contains("TEXCOORD_1")) {
                const auto uvs = glb.values<float>(accessor(primitive["attributes"]["TEXCOORD_1"]), 2);
                ASSERT_EQ(uvs.size(), 2 * count);
                for (const float uv : uvs) EXPECT_TRUE(uv >= 0 && uv <= 1) << uv;
            }
            if (primitive["attributes"].contains("TEXCOORD_0")) accessor(primitive["attributes"]["TEXCOORD_0"]);
            for (const uint32_t index : glb.values<uint32_t>(accessor(primitive["indices"]), 1))
                EXPECT_LT(index, count);
            EXPECT_LT(primitive["material"], d["materials"].size());
        }
    // The source's geometry is gone: everything that is there is used.
    EXPECT_THAT(accessor_uses, testing::Each(testing::Ge(1)));
    EXPECT_THAT(view_uses, testing::Each(1));
    for (const json& node : d["nodes"]) {
        EXPECT_LT(node.value("mesh", 0u), d["meshes"].size());
        for (const json& child : node.value("children", json::array())) EXPECT_LT(child, d["nodes"].size());
    }
}

TEST(WriteLevel, KeepsWhatTheCookerDoesNotTouch) {
    const Written written(richLevel());
    const json d = Glb(written.path).document;
    EXPECT_EQ(d["asset"]["copyright"], "someone");
    EXPECT_EQ(d["nodes"][0]["extras"]["mood"], "calm");
    const json source = richLevel().document;
    EXPECT_EQ(d["extensions"], source["extensions"]);
    for (size_t i = 0; i < source["nodes"].size(); ++i)
        for (const char* key : {"name", "translation", "rotation", "scale", "extras", "extensions"})
            EXPECT_EQ(d["nodes"][i].value(key, json()), source["nodes"][i].value(key, json())) << i << key;
}

using Corner = std::array<float, 5>;  // position, UV
using Triangle = std::array<Corner, 3>;

// All lit triangles by page, from the pack and from the file's nodes in the world.
std::multimap<uint32_t, Triangle> trianglesOf(const PackData& pack) {
    std::multimap<uint32_t, Triangle> triangles;
    for (const Mesh& m : pack.meshes)
        for (size_t i = 0; i < m.indices.size(); i += 3) {
            Triangle t;
            for (size_t k = 0; k < 3; ++k) {
                const MeshVertex& v = m.vertices[m.indices[i + k]];
                t[k] = {v.position_m[0], v.position_m[1], v.position_m[2], v.lightmap_uv[0], v.lightmap_uv[1]};
            }
            triangles.emplace(m.page, t);
        }
    return triangles;
}

bool near(const Triangle& a, const Triangle& b) {
    for (size_t turn = 0; turn < 3; ++turn) {
        bool same = true;
        for (size_t k = 0; k < 3; ++k)
            for (size_t c = 0; c < 5; ++c) same = same && std::abs(a[k][c] - b[(k + turn) % 3][c]) < 1e-5f;
        if (same) return true;
    }
    return false;
}

// Read again, every lit triangle of the pack is there with its winding, its UVs and its page.
TEST(WriteLevel, HasThePacksTrianglesAndUvs) {
    const Written written(richLevel());
    ASSERT_GT(written.cooked.pack.page_count, 1u);
    const json d = Glb(written.path).document;
    auto expected = trianglesOf(written.cooked.pack);
    const auto scene = importLevel(written.path);
    ASSERT_TRUE(scene) << scene.error().message;
    size_t dynamic = 0;
    for (const SceneMesh& mesh : scene->meshes) {
        if (mesh.lighting == Lighting::Dynamic) {
            EXPECT_TRUE(mesh.uv1.empty());
            dynamic += mesh.triangles.size();
            continue;
        }
        const size_t glb_mesh = d["nodes"][static_cast<size_t>(mesh.gltf_node)]["mesh"];
        const auto page = d["meshes"][glb_mesh]["extras"]["lightmap_page"].get<uint32_t>();
        for (const glm::uvec3& t : mesh.triangles) {
            Triangle triangle;
            for (int k = 0; k < 3; ++k) {
                const glm::vec3 p = mesh.positions_m[t[k]];
                triangle[static_cast<size_t>(k)] = {p.x, p.y, p.z, mesh.uv1[t[k]].x, mesh.uv1[t[k]].y};
            }
            auto [it, end] = expected.equal_range(page);
            while (it != end && !near(it->second, triangle)) ++it;
            ASSERT_NE(it, end) << mesh.node << " has a triangle that the pack has not";
            expected.erase(it);
        }
    }
    EXPECT_THAT(expected, IsEmpty());
    EXPECT_EQ(dynamic, 2u);
}

TEST(WriteLevel, ImportsAsTheSameLevelWithoutNewCharts) {
    const LevelFile level = richLevel();
    const Written written(level);
    const auto before = level.import(), after = importLevel(written.path);
    ASSERT_TRUE(after) << after.error().message;
    EXPECT_THAT(after->warnings, IsEmpty());
    ASSERT_EQ(after->light_sets.size(), before->light_sets.size());
    for (size_t i = 0; i < before->light_sets.size(); ++i) {
        EXPECT_EQ(after->light_sets[i].name, before->light_sets[i].name);
        EXPECT_EQ(after->light_sets[i].max_weight, before->light_sets[i].max_weight);
    }
    ASSERT_EQ(after->doors.size(), 1u);
    EXPECT_TRUE(after->doors[0].pose);
    ASSERT_EQ(after->lights.size(), 1u);
    EXPECT_EQ(after->lights[0].position_m, before->lights[0].position_m);
    for (const SceneMesh& mesh : after->meshes) {
        const auto same = std::ranges::find_if(before->meshes, [&](const SceneMesh& m) {
            return mesh.node == m.node || mesh.node.starts_with(m.node + ".part");
        });
        ASSERT_NE(same, before->meshes.end()) << mesh.node;
        EXPECT_EQ(mesh.door, same->door);
        EXPECT_EQ(mesh.light_set, same->light_set);
        for (int c = 0; c < 4; ++c)
            for (int r = 0; r < 4; ++r) EXPECT_NEAR(mesh.open_from_closed[c][r], same->open_from_closed[c][r], 1e-9);
    }
    const RayScene rays(*after);
    const auto charts = unwrap(rays, {.texels_per_metre = 4, .page_size = 256});
    ASSERT_TRUE(charts) << charts.error().message;
    EXPECT_THAT(charts->warnings, IsEmpty());
    // Of the file's own UVs alone, one chart or more for each mesh.
    const auto lit =
        std::ranges::count_if(after->meshes, [](const SceneMesh& m) { return m.lighting != Lighting::Dynamic; });
    EXPECT_GE(charts->charts.size(), static_cast<size_t>(lit));
    EXPECT_TRUE(std::ranges::all_of(charts->charts, &Chart::curved));
}

// Charts are a texel wide at least, whatever lies on them, and pages as high as charts need: neither is a fault when
// the level comes back.
TEST(WriteLevel, ItsOwnUnwrapIsTaken) {
    LevelFile level = richLevel();
    // A bar that stands, and one that lies on it.
    const int railing = level.addMesh({{0.2, 0, 1.5},
                                       {0.23, 0, 1.5},
                                       {0.23, 2.5, 1.5},
                                       {0.2, 2.5, 1.5},
                                       {0.2, 2.6, 1.5},
                                       {2.7, 2.6, 1.5},
                                       {2.7, 2.63, 1.5},
                                       {0.2, 2.63, 1.5}},
                                      std::vector<glm::vec3>(8, {0, 0, 1}), {0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7}, 0);
    level.addNode({{"name", "railing"}, {"mesh", railing}, {"extras", {{"dimmer_lighting", "lightmap"}}}});
    for (const uint32_t page_size : {64u, 512u}) {
        const Written written(level, page_size, 4);
        const PackData& pack = written.cooked.pack;
        EXPECT_TRUE(page_size < 512 || pack.page_width != pack.page_height);
        auto scene = importLevel(written.path);
        ASSERT_TRUE(scene) << scene.error().message;
        dropInvalidUnwraps(*scene, 4);
        for (const SceneMesh& mesh : scene->meshes) EXPECT_EQ(mesh.uv1_fault, "") << mesh.node;
    }
}

// The level that was written, cooked, is lit like its source.
TEST(WriteLevel, CooksLikeItsSource) {
    LevelFile level;
    level.addNode({{"name", "room"}, {"mesh", addRoomMesh(level, {0, 0, 0}, 3, addWhite(level))}});
    const int lamp = level.addLight("lamp", {{"type", "point"}, {"intensity", 50}},
                                    {{"dimmer_light_set", "hall"}, {"dimmer_bake", "full"}});
    level.node(lamp)["translation"] = {1.3, 1.6, 1.4};
    const Written written(level, 256, 4);
    std::vector<QueryPoint> points;
    for (int i = 0; i < 25; ++i)
        points.push_back(
            {{0.4f + 0.5f * static_cast<float>(i % 5), 0, 0.4f + 0.5f * static_cast<float>(i / 5)}, {0, 1, 0}});
    const auto first = Pack::fromData(PackData(written.cooked.pack));
    const auto scene = importLevel(written.path);
    ASSERT_TRUE(scene) << scene.error().message;
    const auto second = cooked(*scene, "draft");
    ASSERT_TRUE(first && second);
    const auto texels = [](const Pack& pack) { return pack.pageCount() * pack.pageWidth() * pack.pageHeight(); };
    EXPECT_LE(texels(*second), 2 * texels(*first)) << "pieces of an unwrap lie all over a page; a step of its side";
    const auto a = sampled(*first, points, ""), b = sampled(*second, points, "");
    double difference = 0, sum = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        difference += std::abs(a[i].x - b[i].x);
        sum += a[i].x;
    }
    // A room of 50 lm / sr: some hundred rays leave 2 to 3 % of noise in the bounces, which are half of the light, and
    // the other texel grid as much in the direct half.
    EXPECT_GT(sum / static_cast<double>(a.size()), 10);
    EXPECT_LT(difference, 0.05 * sum);
}

TEST(WriteLevel, ALevelThatWasChangedSinceIsRefused) {
    Written written(richLevel());
    LevelFile other = richLevel();
    other.node(4)["translation"] = {1, 1.5, 2};
    writeLevel(written.folder, other);
    const auto result =
        cook::writeLevel(written.folder.path / "level.gltf", written.cooked.pack, written.path, written.warnings);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::BadInput);
    EXPECT_THAT(result.error().message, HasSubstr("changed since"));
}

std::string base64Of(const std::string& bytes) {
    return base64(std::as_bytes(std::span(bytes)));
}

// Textures may name images that only other programs read; they are no JPEG for that.
TEST(WriteLevel, ImagesAreCalledWhatTheyAre) {
    struct Picture {
        std::string begins, type, written;
    };
    const Picture pictures[] = {
        {std::string("RIFF\x08\0\0\0WEBPVP8 ", 16), "image/webp", "image/webp"},
        {"\xABKTX 20\xBB\r\n\x1A\n", "image/ktx2", "image/ktx2"},
        {"DDS |", "image/vnd-ms.dds", "image/vnd-ms.dds"},
        {"\x89PNG\r\n\x1A\n", "image/png", "image/png"},
        {"\xFF\xD8\xFF\xE0", "image/jpg", "image/jpeg"},
        {"what?", "image/never", ""},  // stays as it was
    };
    LevelFile level = LevelFile::withFloor();
    level.addLight("sun", {{"type", "directional"}, {"intensity", 10}});
    for (const Picture& p : pictures)
        level.document["images"].push_back({{"uri", "data:" + p.type + ";base64," + base64Of(p.begins + "....")}});
    const Written written(level);
    const Glb glb(written.path);
    const json& images = glb.document["images"];
    ASSERT_EQ(images.size(), std::size(pictures));
    for (size_t i = 0; i < images.size(); ++i) {
        EXPECT_EQ(images[i].value("mimeType", ""), pictures[i].written);
        EXPECT_EQ(images[i].contains("uri"), pictures[i].written.empty());
        EXPECT_EQ(images[i].contains("bufferView"), !pictures[i].written.empty());
    }
}

// Where views are compressed besides, the plain bytes are written, and nothing tells of the others.
TEST(WriteLevel, CompressionThatIsNotNeededGoes) {
    LevelFile level = LevelFile::withFloor();
    level.addLight("sun", {{"type", "directional"}, {"intensity", 10}});
    level.document["extensionsUsed"] = {"EXT_meshopt_compression", "KHR_lights_punctual"};
    for (json& view : level.document["bufferViews"])
        view["extensions"] = {{"EXT_meshopt_compression",
                               {{"buffer", 1},
                                {"byteOffset", 4},
                                {"byteLength", 8},
                                {"byteStride", 12},
                                {"count", 4},
                                {"mode", "ATTRIBUTES"}}},
                              {"ACME_note", {{"kept", true}}}};
    json buffers = json::parse(level.gltfText())["buffers"];
    buffers[0]["extensions"] = {{"EXT_meshopt_compression", {{"fallback", true}}}};
    buffers.push_back(
        {{"byteLength", 16}, {"uri", "data:application/octet-stream;base64," + base64Of(std::string(16, 'x'))}});
    level.document["buffers"] = buffers;
    const Written written(level);
    const Glb glb(written.path);
    EXPECT_EQ(glb.document.dump().find("meshopt"), std::string::npos);
    EXPECT_EQ(glb.document["extensionsUsed"], json({"KHR_lights_punctual"}));
    const auto again = importLevel(written.path);
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_EQ(again->meshes.at(0).triangles.size(), 2u);
}

TEST(WriteLevel, ImagesAndTransformsOfTexturesGoAlong) {
    LevelFile level = LevelFile::withFloor();
    // A picture of one white texel.
    level.document["images"] =
        json::array({{{"uri",
                       "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8/5+hHgAHggJ/"
                       "PchI7wAAAABJRU5ErkJggg=="}}});
    level.document["textures"] = json::array({{{"source", 0}}});
    level.document["extensionsUsed"] = {"KHR_texture_transform"};
    json& pbr = level.document["materials"][0]["pbrMetallicRoughness"];
    pbr["baseColorTexture"] = {{"index", 0}, {"extensions", {{"KHR_texture_transform", {{"offset", {0.25, 0.5}}}}}}};
    level.primitive(0)["attributes"]["TEXCOORD_0"] = level.addVec2({{0, 0}, {0, 1}, {1, 1}, {1, 0}});
    level.addLight("sun", {{"type", "directional"}, {"intensity", 10}});
    const Written written(level);
    const Glb glb(written.path);
    const json& d = glb.document;
    EXPECT_FALSE(d["images"][0].contains("uri"));
    EXPECT_EQ(d["images"][0]["mimeType"], "image/png");
    const json& view = d["bufferViews"][d["images"][0]["bufferView"].get<size_t>()];
    EXPECT_EQ(std::memcmp(glb.binary.data() + view["byteOffset"].get<size_t>(), "\x89PNG", 4), 0);
    EXPECT_FALSE(d["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"].contains("extensions"));
    EXPECT_THAT(written.warnings, testing::ElementsAre(HasSubstr("material 'white'")));
    const auto before = level.import(), after = importLevel(written.path);
    ASSERT_TRUE(after) << after.error().message;
    ASSERT_EQ(after->textures.size(), 1u);
    const auto texel_at = [](const Scene& scene, float x, float z) {
        for (size_t v = 0; v < scene.meshes[0].positions_m.size(); ++v)
            if (glm::distance(scene.meshes[0].positions_m[v], {x, 0, z}) < 1e-6f) return scene.meshes[0].uv0[v];
        return glm::vec2(-1);
    };
    EXPECT_EQ(texel_at(*before, 1, 1), glm::vec2(1.25f, 1.5f));
    EXPECT_EQ(texel_at(*after, 1, 1), glm::vec2(1.25f, 1.5f));
}

}  // namespace
}  // namespace dimmer::cook::test
