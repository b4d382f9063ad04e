// Files that cannot be used: one clear message, never a crash.
#include <scene/expectations.h>
#include <scene/full_level.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <tuple>

namespace dimmer::cook::test {
namespace {

std::vector<uint8_t> bytesOf(const std::string& text) {
    return {text.begin(), text.end()};
}

TEST(SceneBadInput, MissingAndUnreadableFiles) {
    const TemporaryFolder folder;
    for (const auto& path : {folder.path / "level.missing.glb", folder.path}) {
        const auto scene = importLevel(path);
        ASSERT_FALSE(scene.has_value());
        EXPECT_EQ(scene.error().code, ErrorCode::Io);
        EXPECT_THAT(scene.error().message, testing::HasSubstr(path.filename().string()));
    }
}

TEST(SceneBadInput, NotGltf) {
    expectBadInput(importBytes("level.glb", {}), {"empty"});
    expectBadInput(importBytes("level.glb", bytesOf("glTF")), {"truncated"});
    for (const char* text : {"hello", "{", "[]", "{}", "null", R"({"asset": {"version": "1.0"}})"})
        expectBadInput(importBytes("level.gltf", bytesOf(text)), {});
    expectBadInput(importBytes("level.gltf", bytesOf(R"({"asset": {"version": "2.0"}})")), {"scene"});
    expectBadInput(LevelFile().import(), {"no triangles"});
}

TEST(SceneBadInput, DeepNestingDoesNotExhaustTheStack) {
    const std::string deep =
        R"({"asset": {"version": "2.0"}, "extras": )" + std::string(200000, '[') + std::string(200000, ']') + "}";
    expectBadInput(importBytes("level.gltf", bytesOf(deep)), {"nests"});
    // What is no JSON nests nothing, however many brackets its bytes have.
    const std::string brackets(200, '[');
    expectBadInput(importBytes("level.gltf", bytesOf("DIMMER\r\n" + brackets)), {"Dimmer pack", "swapped"});
    expectBadInput(importBytes("level.glb", bytesOf("BLENDER" + brackets)), {"neither JSON nor .glb"});
    // Brackets in texts do not nest.
    LevelFile level = LevelFile::withFloor();
    level.node(0)["extras"]["note"] = "\\\"" + std::string(1000, '[');
    ASSERT_IMPORTED(level.import());
}

TEST(SceneBadInput, ALongChainOfNodesIsFine) {
    LevelFile level = LevelFile::withFloor();
    int parent = level.addNode({{"translation", {1, 0, 0}}});
    for (int i = 0; i < 20000; ++i) parent = level.addNode(json::object(), parent);
    level.node(parent)["mesh"] = 0;
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    expectNear(scene->meshes[1].positions_m[0], {0, 0, -1});
}

struct Fault {
    const char* name;
    std::function<void(json&)> apply;
    std::vector<std::string> message;
};

TEST(SceneBadInput, IndicesOutOfRangeNameTheirOwner) {
    const Fault faults[] = {
        {"node's mesh", [](json& d) { d["nodes"][1]["mesh"] = 99; }, {"node 'panel'", "mesh 99"}},
        {"negative mesh", [](json& d) { d["nodes"][1]["mesh"] = -7; }, {"node 'panel'", "mesh -7"}},
        {"mesh of 2^32 - 1", [](json& d) { d["nodes"][1]["mesh"] = 4294967295u; }, {"node 'panel'", "4294967295"}},
        {"mesh of 2^32", [](json& d) { d["nodes"][1]["mesh"] = 4294967296u; }, {"node 'panel'", "4294967296"}},
        {"mesh of -2^32", [](json& d) { d["nodes"][1]["mesh"] = -4294967296; }, {"node 'panel'", "-4294967296"}},
        {"material of 2^32 - 1",
         [](json& d) { d["meshes"][0]["primitives"][0]["material"] = 4294967295u; },
         {"mesh 0", "'material'", "4294967295"}},
        {"material of 2^32",
         [](json& d) { d["meshes"][0]["primitives"][0]["material"] = 4294967296u; },
         {"mesh 0", "'material'", "4294967296"}},
        {"indices of 2^32 - 1",
         [](json& d) { d["meshes"][0]["primitives"][0]["indices"] = 4294967295u; },
         {"mesh 0", "'indices'", "4294967295"}},
        {"indices of 2^32",
         [](json& d) { d["meshes"][0]["primitives"][0]["indices"] = 4294967296u; },
         {"mesh 0", "'indices'", "4294967296"}},
        {"mode of 2^32",
         [](json& d) { d["meshes"][0]["primitives"][0]["mode"] = 4294967300u; },
         {"mesh 0", "'mode'", "4294967300"}},
        {"sparse count of 2^32",
         [](json& d) { d["accessors"][0]["sparse"]["count"] = 4294967297u; },
         {"accessor 0", "'count'", "4294967297"}},
        {"sparse view of 2^32",
         [](json& d) { d["accessors"][0]["sparse"]["values"]["bufferView"] = 4294967296u; },
         {"accessor 0", "'bufferView'", "4294967296"}},
        {"node's light",
         [](json& d) { d["nodes"][3]["extensions"]["KHR_lights_punctual"]["light"] = 4; },
         {"node 'lamp'", "light 4"}},
        {"no light",
         [](json& d) { d["nodes"][3]["extensions"]["KHR_lights_punctual"] = json::object(); },
         {"node 'lamp'"}},
        {"node's camera", [](json& d) { d["nodes"][0]["camera"] = 0; }, {"node 'floor'", "camera 0"}},
        {"child", [](json& d) { d["nodes"][0]["children"] = {44}; }, {"node 'floor'", "44"}},
        {"root", [](json& d) { d["scenes"][0]["nodes"] = {44}; }, {"scene 0", "44"}},
        {"default scene", [](json& d) { d["scene"] = 3; }, {"scene 3"}},
        {"material", [](json& d) { d["meshes"][0]["primitives"][0]["material"] = 9; }, {"mesh 0", "material 9"}},
        {"attribute",
         [](json& d) { d["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 77; },
         {"mesh 0", "NORMAL", "77"}},
        {"texture",
         [](json& d) { d["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 2; },
         {"material 'white'", "texture 2"}},
        {"accessor's view", [](json& d) { d["accessors"][0]["bufferView"] = 50; }, {"accessor 0", "buffer view 50"}},
        {"view's buffer", [](json& d) { d["bufferViews"][0]["buffer"] = 2; }, {"buffer view 0", "buffer 2"}},
        {"sparse view",
         [](json& d) { d["accessors"][0]["sparse"]["values"]["bufferView"] = 60; },
         {"node 'floor'", "buffer view 60"}},
        {"own child", [](json& d) { d["nodes"][0]["children"] = {0}; }, {"node 'floor'", "ancestor"}},
        {"cycle",
         [](json& d) {
             d["nodes"][0]["children"] = {1};
             d["nodes"][1]["children"] = {0};
             d["scenes"][0]["nodes"] = {2};
         },
         {"node 'floor'", "cycle"}},
        {"two parents",
         [](json& d) {
             d["nodes"][0]["children"] = {2};
             d["nodes"][1]["children"] = {2};
             d["scenes"][0]["nodes"] = {0, 1, 3};
         },
         {"node 'door'", "node 'floor'", "node 'panel'"}},
        {"root twice",
         [](json& d) {
             d["scenes"][0]["nodes"] = {0, 0};
         },
         {"node 'floor'", "twice"}},
        {"root and child", [](json& d) { d["nodes"][0]["children"] = {1}; }, {"node 'panel'"}},
    };
    for (const Fault& fault : faults) {
        LevelFile level = fullLevel();
        fault.apply(level.document);
        SCOPED_TRACE(fault.name);
        expectBadInput(level.import(), fault.message);
    }
}

// The parser takes values of the wrong type for absent ones: floors would vanish without a word.
TEST(SceneBadInput, ValuesOfTheWrongTypeNameTheirPlace) {
    const Fault faults[] = {
        {"mesh -1", [](json& d) { d["nodes"][1]["mesh"] = -1; }, {"node 'panel'", "'mesh'", "index", "-1"}},
        {"mesh 'a'", [](json& d) { d["nodes"][1]["mesh"] = "a"; }, {"node 'panel'", "'mesh'", "\"a\""}},
        {"mesh 0.5", [](json& d) { d["nodes"][1]["mesh"] = 0.5; }, {"node 'panel'", "'mesh'", "0.5"}},
        {"translation", [](json& d) { d["nodes"][0]["translation"] = "x"; }, {"'floor'", "'translation'", "3 numbers"}},
        {"short",
         [](json& d) {
             d["nodes"][0]["scale"] = {1, 2};
         },
         {"'floor'", "'scale'", "3 numbers", "[1,2]"}},
        {"rotation",
         [](json& d) {
             d["nodes"][0]["rotation"] = {"a", 0, 0, 1};
         },
         {"'floor'", "'rotation'", "4 numbers"}},
        {"children", [](json& d) { d["nodes"][0]["children"] = 3; }, {"'floor'", "'children'", "list"}},
        {"colour",
         [](json& d) { d["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = "red"; },
         {"material 'white'", "'baseColorFactor'", "4 numbers", "red"}},
        {"emission", [](json& d) { d["materials"][0]["emissiveFactor"] = 1; }, {"'white'", "'emissiveFactor'"}},
        {"double-sided", [](json& d) { d["materials"][0]["doubleSided"] = 1; }, {"'white'", "true or false"}},
        {"texture",
         [](json& d) { d["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = "t"; },
         {"'white'", "'index'"}},
        {"indices", [](json& d) { d["meshes"][0]["primitives"][0]["indices"] = -1; }, {"mesh 0", "'indices'"}},
        {"attribute",
         [](json& d) { d["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = "n"; },
         {"mesh 0", "'attributes'"}},
        {"offset", [](json& d) { d["bufferViews"][0]["byteOffset"] = -4; }, {"buffer view 0", "'byteOffset'", "-4"}},
        {"count", [](json& d) { d["accessors"][0]["count"] = "4"; }, {"accessor 0", "'count'", "whole number"}},
        {"scene", [](json& d) { d["scene"] = -1; }, {"the file", "'scene'", "-1"}},
        {"long",
         [](json& d) { d["nodes"][0]["mesh"] = std::string(5000, 'x'); },
         {"'floor'", "xxx...", "Export the level again"}},
    };
    for (const Fault& fault : faults) {
        LevelFile level = fullLevel();
        fault.apply(level.document);
        SCOPED_TRACE(fault.name);
        expectBadInput(level.import(), fault.message);
    }
}

// The parser has no value for them: a switchable lamp would always be on, a glowing material dark.
TEST(SceneBadInput, ValuesThatSayNothingAreRefused) {
    const Fault faults[] = {
        {"set",
         [](json& d) { d["nodes"][3]["extras"]["dimmer_light_set"] = nullptr; },
         {"node 'lamp'", "dimmer_light_set"}},
        {"lighting",
         [](json& d) { d["nodes"][0]["extras"]["dimmer_lighting"] = json::object(); },
         {"node 'floor'", "dimmer_lighting"}},
        {"list",
         [](json& d) { d["nodes"][3]["extras"]["dimmer_light_set"] = json::array(); },
         {"node 'lamp'", "dimmer_light_set"}},
        {"extension",
         [](json& d) { d["materials"][1]["extensions"]["KHR_materials_emissive_strength"] = 5; },
         {"material 'glow'", "KHR_materials_emissive_strength"}},
        {"strength",
         [](json& d) {
             d["materials"][1]["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = nullptr;
         },
         {"material 'glow'", "emissiveStrength"}},
    };
    for (const Fault& fault : faults) {
        LevelFile level = fullLevel();
        fault.apply(level.document);
        SCOPED_TRACE(fault.name);
        expectBadInput(level.import(), fault.message);
    }
}

// The parser cuts whole numbers of extras and extensions to 32 bits: 2^32 + 2 candela would be 2.
TEST(SceneBadInput, WholeNumbersThatDoNotFitAreRefused) {
    const Fault faults[] = {
        {"extras",
         [](json& d) { d["nodes"][0]["extras"]["dimmer_texel_density"] = 4294967298u; },
         {"node 'floor'", "'dimmer_texel_density'", "4294967298", "3e9"}},
        {"list",
         [](json& d) {
             d["nodes"][2]["extras"]["dimmer_door_translation"] = {0, -2147483649, 0};
         },
         {"node 'door'", "'dimmer_door_translation'", "-2147483649"}},
        {"scene",
         [](json& d) { d["scenes"][0]["extras"]["dimmer_sky_luminance"] = 4294967298u; },
         {"scene 0", "'dimmer_sky_luminance'", "4294967298"}},
        {"material",
         [](json& d) {
             d["materials"][1]["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 4294967298u;
         },
         {"material 'glow'", "'emissiveStrength'", "4294967298"}},
        {"node's light",
         [](json& d) { d["nodes"][3]["extensions"]["KHR_lights_punctual"]["light"] = 4294967296u; },
         {"node 'lamp'", "'light'", "4294967296"}},
    };
    for (const Fault& fault : faults) {
        LevelFile level = fullLevel();
        fault.apply(level.document);
        SCOPED_TRACE(fault.name);
        expectBadInput(level.import(), fault.message);
    }
    // Numbers of others, and those that are no whole ones, are what they are.
    LevelFile level = fullLevel();
    level.node(0)["extras"] = {{"made_at_ms", 1700000000000}};
    level.document["materials"][1]["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 4294967298.0;
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_FLOAT_EQ(scene->materials[1].emission_cd_m2.x, 4294967298.0f);
}

TEST(SceneBadInput, AccessorsBeyondTheirBytes) {
    static constexpr uint64_t huge = std::numeric_limits<uint64_t>::max();
    const Fault faults[] = {
        {"view too long", [](json& d) { d["bufferViews"][0]["byteLength"] = 1 << 20; }, {"buffer view 0"}},
        {"image's view",
         [](json& d) {
             d["images"] = json::array({{{"bufferView", 0}, {"mimeType", "image/png"}}});
             d["bufferViews"][0]["byteOffset"] = 1 << 20;
         },
         {"image 0", "begins at byte 1048576", "past the end"}},
        {"view offset wraps", [](json& d) { d["bufferViews"][0]["byteOffset"] = huge - 8; }, {"buffer view 0"}},
        {"count", [](json& d) { d["accessors"][1]["count"] = 5; }, {"node 'floor'", "NORMAL", "do not fit"}},
        {"count 4e9", [](json& d) { d["accessors"][1]["count"] = 4000000000u; }, {"node 'floor'", "NORMAL"}},
        {"count wraps", [](json& d) { d["accessors"][1]["count"] = huge / 12 + 2; }, {"node 'floor'", "NORMAL"}},
        {"count 0", [](json& d) { d["accessors"][1]["count"] = 0; }, {"node 'floor'", "NORMAL"}},
        {"offset", [](json& d) { d["accessors"][1]["byteOffset"] = 4; }, {"node 'floor'", "NORMAL"}},
        {"offset wraps", [](json& d) { d["accessors"][1]["byteOffset"] = huge - 3; }, {"node 'floor'", "NORMAL"}},
        {"stride too small", [](json& d) { d["bufferViews"][1]["byteStride"] = 8; }, {"node 'floor'", "stride"}},
        {"stride too large", [](json& d) { d["bufferViews"][1]["byteStride"] = 252; }, {"node 'floor'", "do not fit"}},
        {"no data", [](json& d) { d["accessors"][1].erase("bufferView"); }, {"node 'floor'", "NORMAL", "missing"}},
        {"sparse of 4e9",
         [](json& d) {
             d["accessors"][0].erase("bufferView");
             d["accessors"][0]["count"] = 4000000000u;
         },
         {"node 'floor'", "POSITION", "4000000000"}},
        {"sparse target",
         [](json& d) { d["accessors"][0]["sparse"]["indices"]["componentType"] = 5125; },
         {"node 'floor'", "POSITION"}},
        {"wrong type", [](json& d) { d["accessors"][0]["type"] = "VEC2"; }, {"node 'floor'", "POSITION", "VEC3"}},
        {"fewer normals", [](json& d) { d["accessors"][1]["count"] = 3; }, {"node 'floor'", "NORMAL", "3", "4"}},
        {"doubles", [](json& d) { d["accessors"][0]["componentType"] = 5130; }, {"node 'floor'", "POSITION"}},
        {"no positions",
         [](json& d) { d["meshes"][0]["primitives"][0]["attributes"].erase("POSITION"); },
         {"node 'floor'", "POSITION"}},
        {"float indices", [](json& d) { d["accessors"][2]["componentType"] = 5126; }, {"node 'floor'", "indices"}},
        {"buffer length",
         [](json& d) {
             d["buffers"] = {{{"byteLength", huge}, {"uri", "data:application/octet-stream;base64,AAAA"}}};
         },
         {}},
        {"missing buffer",
         [](json& d) {
             d["buffers"] = {{{"byteLength", 4}, {"uri", "gone.bin"}}};
         },
         {"gone.bin"}},
        {"device as buffer",
         [](json& d) {
             d["buffers"] = {{{"byteLength", 4}, {"uri", "../../../../../dev/zero"}}};
         },
         {"zero"}},
    };
    for (const Fault& fault : faults) {
        LevelFile level = fullLevel();
        fault.apply(level.document);
        SCOPED_TRACE(fault.name);
        expectBadInput(level.import(), fault.message);
    }
}

TEST(SceneBadInput, VertexIndicesBeyondTheVertices) {
    LevelFile level = LevelFile::withFloor();
    const int mesh = level.addMesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}, {0, 1, 3}, 0);
    level.addNode({{"name", "wall"}, {"mesh", mesh}});
    expectBadInput(level.import(), {"node 'wall'", "index 3", "3 vertices"});
}

TEST(SceneBadInput, NumbersThatAreNotFinite) {
    constexpr float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
    for (const float bad : {nan, infinity, -infinity}) {
        LevelFile positions = LevelFile::withFloor();
        positions.addNode(
            {{"name", "wall"}, {"mesh", positions.addMesh({{0, 0, 0}, {1, bad, 0}, {0, 1, 0}}, {}, {0, 1, 2}, 0)}});
        expectBadInput(positions.import(), {"node 'wall'", "POSITION", "vertex 1", "NaN"});

        LevelFile normals = LevelFile::withFloor();
        const int mesh =
            normals.addMesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 0, 1}, {0, 0, 1}, {0, 0, bad}}, {0, 1, 2}, 0);
        normals.addNode({{"name", "wall"}, {"mesh", mesh}});
        expectBadInput(normals.import(), {"node 'wall'", "NORMAL", "vertex 2"});
    }
    // An open pose stands in the level, too.
    LevelFile door = LevelFile::withFloor();
    const json pose = {
        {"dimmer_door", "front"}, {"dimmer_door_open", "pose"}, {"dimmer_door_translation", {1e9, 0, 0}}};
    const int leaf = door.addNode({{"name", "leaf"}, {"mesh", door.addSquareMesh(0)}, {"extras", pose}});
    expectBadInput(door.import(), {"node 'leaf'", "open pose", "km"});
    door.node(leaf)["extras"]["dimmer_door_open"] = "remove";  // it never gets there
    ASSERT_IMPORTED(door.import());

    LevelFile far_away = LevelFile::withFloor();
    far_away.node(0)["scale"] = {1e7, 1, 1};
    expectBadInput(far_away.import(), {"node 'floor'", "km"});

    std::string text = LevelFile::withFloor().gltfText();
    text.replace(text.find("\"mesh\":0"), 8, "\"mesh\":0,\"translation\":[1e999,0,0]");
    expectBadInput(importBytes("level.gltf", bytesOf(text)), {});
}

TEST(SceneBadInput, Transforms) {
    const std::pair<json, std::string> cases[] = {
        {{{"scale", {1, 0, 1}}}, "singular"},
        {{{"scale", {1, 1e-12, 1}}}, "singular"},
        {{{"matrix", {1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}}, "singular"},
        {{{"matrix", {1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}}, "matrix"},
        {{{"matrix", {1, 2, 3}}}, "matrix"},
        {{{"translation", {1e300, 0, 0}}}, "infinite"},
        {{{"translation", {1, 2}}}, "translation"},
        {{{"rotation", {0, 0, 0, 0}}}, "rotation"},
        {{{"rotation", {0, 0, 1}}}, "rotation"},
    };
    for (const auto& [transform, message] : cases) {
        LevelFile level = LevelFile::withFloor();
        level.node(0).update(transform);
        SCOPED_TRACE(transform.dump());
        expectBadInput(level.import(), {"node 'floor'", message});
    }
    LevelFile above = LevelFile::withFloor();
    const int flat = above.addNode({{"name", "flat"}, {"scale", {0, 0, 0}}});
    ASSERT_IMPORTED(above.import());  // nothing stands below it
    above.addNode({{"name", "crate"}, {"mesh", 0}}, flat);
    expectBadInput(above.import(), {"node 'crate'", "node 'flat'", "singular"});
    // A place for what moves has no mesh, and vanished.
    LevelFile place = LevelFile::withFloor();
    place.addNode({{"name", "spawn"}, {"scale", {0, 0, 0}}, {"extras", {{"dimmer_dynamic", true}}}});
    expectBadInput(place.import(), {"node 'spawn'", "singular"});
    LevelFile far = LevelFile::withFloor();
    far.addNode({{"name", "spawn"}, {"translation", {0, 2e9, 0}}, {"extras", {{"dimmer_dynamic", true}}}});
    expectBadInput(far.import(), {"node 'spawn'", "1000 km"});
}

// Rays from 1e19 m away have no direction in floats: the cook aborted. The sun's place means nothing.
TEST(SceneBadInput, LightsFarAwayAreRefused) {
    for (const auto& [type, away_m, is_refused] :
         {std::tuple("point", 1e19, true), std::tuple("point", 1.1e6, true), std::tuple("point", 0.9e6, false),
          std::tuple("spot", 1e19, true), std::tuple("directional", 1e19, false)}) {
        SCOPED_TRACE(type);
        LevelFile level = LevelFile::withFloor();
        json light = {{"type", type}, {"intensity", 100}};
        if (light["type"] == "spot") light["spot"] = json::object();
        level.node(level.addLight("star", light))["translation"] = {0, away_m, 0};
        if (is_refused) {
            expectBadInput(level.import(), {"node 'star'", "light", "1000 km"});
        } else {
            ASSERT_IMPORTED(level.import());
        }
    }
}

TEST(SceneBadInput, RequiredExtensionsMustBeKnown) {
    LevelFile level = LevelFile::withFloor();
    level.document["extensionsUsed"] = {"KHR_draco_mesh_compression"};
    ASSERT_IMPORTED(level.import());
    level.document["extensionsRequired"] = {"KHR_draco_mesh_compression"};
    expectBadInput(level.import(), {"KHR_draco_mesh_compression"});
    // As exporters write it: the parser refuses what has no buffer view, before anybody asks why.
    for (json& accessor : level.document["accessors"]) accessor.erase("bufferView");
    expectBadInput(level.import(), {"KHR_draco_mesh_compression", "compression)"});
    level.document["extensionsRequired"] = {7, "KHR_lights_punctual"};
    level.document["accessors"] = LevelFile::withFloor().document["accessors"];
    ASSERT_IMPORTED(level.import());
}

TEST(SceneBadInput, ExtensionsThatAreMissedAreWarnedOf) {
    LevelFile level = LevelFile::withFloor();
    level.document["extensionsUsed"] = {"EXT_mesh_gpu_instancing",    "KHR_materials_pbrSpecularGlossiness",
                                        "KHR_materials_transmission", "ACME_gravel",
                                        "KHR_materials_ior",          "KHR_xmp_json_ld",
                                        "KHR_lights_punctual"};
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->warnings.size(), 4u);
    expectWarning(*scene, {"'EXT_mesh_gpu_instancing'", "Export its instances as nodes"});
    expectWarning(*scene, {"'KHR_materials_pbrSpecularGlossiness'", "white metal", "Convert"});
    expectWarning(*scene, {"'KHR_materials_transmission'", "opaque", "BLEND"});
    expectWarning(*scene, {"'ACME_gravel'", "ignored"});
}

// Whatever the bytes: a scene or a message.
void expectAnAnswer(const std::vector<uint8_t>& bytes) {
    const auto scene = importBytes("level.glb", bytes);
    if (!scene) {
        EXPECT_THAT(scene.error().message, testing::HasSubstr("level.glb"));
        EXPECT_NE(scene.error().code, ErrorCode::Internal);
    }
}

TEST(SceneBadInput, EveryTruncationIsRefused) {
    const std::vector<uint8_t> whole = fullLevel().glb();
    ASSERT_IMPORTED(importBytes("level.glb", whole));
    for (size_t length = 0; length < whole.size(); length += 5)
        expectBadInput(importBytes("level.glb", {whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length)}),
                       {});
}

void appendWord(std::vector<uint8_t>& bytes, size_t value) {
    for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<uint8_t>(value >> shift));
}

// `glb` with its chunks from the second on replaced by these: type and content.
std::vector<uint8_t> withChunks(const std::vector<uint8_t>& glb,
                                const std::vector<std::pair<uint32_t, std::vector<uint8_t>>>& chunks) {
    const size_t json_end = 20 + (glb[12] | size_t{glb[13]} << 8 | size_t{glb[14]} << 16);
    std::vector<uint8_t> bytes(glb.begin(), glb.begin() + static_cast<std::ptrdiff_t>(json_end));
    for (const auto& [type, content] : chunks) {
        appendWord(bytes, content.size());
        appendWord(bytes, type);
        bytes.insert(bytes.end(), content.begin(), content.end());
    }
    for (size_t i = 0; i < 4; ++i) bytes[8 + i] = static_cast<uint8_t>(bytes.size() >> 8 * i);
    return bytes;
}

// glTF 2.0, "GLB File Format": readers pass over chunks that they do not know; the binary one may be empty.
TEST(SceneBadInput, ChunksOfAGlbThatSayNothingArePassedOver) {
    constexpr uint32_t binary = 0x004E4942, unknown = 0x50415453;
    LevelFile level = LevelFile::withFloor();
    std::vector<uint8_t> buffer = level.buffer;
    while (buffer.size() % 4 != 0) buffer.push_back(0);
    const std::vector<uint8_t> other = {1, 2, 3, 4};
    const std::vector<std::vector<std::pair<uint32_t, std::vector<uint8_t>>>> inside = {
        {{binary, buffer}, {unknown, other}},
        {{unknown, other}, {binary, buffer}},
        {{binary, buffer}, {binary, other}},  // the first is the buffer's
    };
    for (const auto& chunks : inside) {
        const auto scene = importBytes("level.glb", withChunks(level.glb(), chunks));
        ASSERT_IMPORTED(scene);
        expectNear(scene->meshes[0].positions_m[2], {1, 0, 1});
    }
    const std::string text = level.gltfText();
    level.document["buffers"] = json::parse(text)["buffers"];  // a data URI
    for (const auto& chunks : std::vector<std::vector<std::pair<uint32_t, std::vector<uint8_t>>>>{
             {}, {{binary, {}}}, {{unknown, other}}, {{binary, {}}, {unknown, {}}}}) {
        const auto scene = importBytes("level.glb", withChunks(level.glb(), chunks));
        ASSERT_IMPORTED(scene);
        expectNear(scene->meshes[0].positions_m[2], {1, 0, 1});
    }
}

// Skins and animations say nothing to a bake; forms of them that glTF allows are no fault of a level.
TEST(SceneBadInput, SkinsAndAnimationsAreNotAskedFor) {
    LevelFile level = LevelFile::withFloor();
    level.document["skins"] = json::array({{{"joints", {0}}}});
    level.document["animations"] = json::array(
        {{{"samplers", json::array({{{"input", 0}, {"output", 0}}})},
          {"channels",
           json::array({{{"sampler", 0},
                         {"target",
                          {{"path", "pointer"},
                           {"extensions", {{"KHR_animation_pointer", {{"pointer", "/materials/0"}}}}}}}}})}}});
    level.node(0)["skin"] = 0;
    level.node(0)["extras"] = {{"skins", 1}, {"animations", "\"skins\": {"}};  // no members of the document
    ASSERT_IMPORTED(level.import());
    ASSERT_IMPORTED(importBytes("level.glb", level.glb()));
}

// A GLB's chunk is its first buffer's. Read as another one's as well it was geometry of the wrong bytes.
TEST(SceneBadInput, ASecondBufferWithoutUriIsNowhere) {
    LevelFile level = LevelFile::withFloor();
    json uri = json::parse(level.gltfText())["buffers"][0];
    for (json& view : level.document["bufferViews"]) view["buffer"] = 1;
    level.document["buffers"] = json::array({{{"byteLength", level.buffer.size()}}, uri});
    ASSERT_IMPORTED(importBytes("level.glb", level.glb()));
    level.document["buffers"][1].erase("uri");
    expectBadInput(importBytes("level.glb", level.glb()), {"buffer view 0", "buffer 1", "no uri"});
}

// Found by fuzzing: where the header counts nothing, no chunk was checked, and the JSON's length was believed.
TEST(SceneBadInput, AGlbThatCountsLessThanItsFirstChunk) {
    for (const uint8_t length : {0, 12, 19}) {
        std::vector<uint8_t> bytes = fullLevel().glb();
        bytes[8] = length;
        bytes[9] = bytes[10] = bytes[11] = 0;
        bytes[14] = 0xff;  // the JSON chunk claims 16 MB
        expectBadInput(importBytes("level.glb", bytes), {"truncated", std::to_string(length) + " bytes"});
    }
}

TEST(SceneBadInput, FlippedBitsGetAnAnswer) {
    const std::vector<uint8_t> whole = fullLevel().glb();
    std::mt19937 random(1);
    for (int i = 0; i < 1500; ++i) {
        std::vector<uint8_t> bytes = whole;
        for (int flips = 1 + i % 3; flips > 0; --flips)
            bytes[random() % bytes.size()] ^= static_cast<uint8_t>(1u << random() % 8);
        expectAnAnswer(bytes);
    }
}

TEST(SceneBadInput, ReplacedNumbersGetAnAnswer) {
    const std::string text = fullLevel().gltfText();
    std::mt19937 random(2);
    const char* values[] = {"-1",
                            "0",
                            "7",
                            "4294967295",
                            "18446744073709551615",
                            "-9223372036854775808",
                            "1e308",
                            "1e999",
                            "0.5",
                            "null",
                            "[]",
                            "{}",
                            "\"x\"",
                            "true"};
    for (int i = 0; i < 1500; ++i) {
        std::string mutated = text;
        size_t at = random() % mutated.size();
        at = mutated.find_first_of("0123456789", at);
        if (at == std::string::npos) continue;
        const size_t end = std::min(mutated.find_first_not_of("0123456789.", at), mutated.size());
        mutated.replace(at, end - at, values[random() % std::size(values)]);
        const auto scene = importBytes("level.gltf", bytesOf(mutated));
        if (!scene) {
            EXPECT_THAT(scene.error().message, testing::HasSubstr("level.gltf"));
        }
    }
}

}  // namespace
}  // namespace dimmer::cook::test
