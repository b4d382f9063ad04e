#include <scene/allocated_bytes.h>
#include <scene/expectations.h>
#include <scene/uri.h>

#include <cmath>
#include <cstring>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

namespace dimmer::cook::test {
namespace {

glm::vec3 faceNormal(const SceneMesh& mesh, size_t triangle) {
    const glm::uvec3 t = mesh.triangles[triangle];
    return glm::normalize(
        glm::cross(mesh.positions_m[t.y] - mesh.positions_m[t.x], mesh.positions_m[t.z] - mesh.positions_m[t.x]));
}

TEST(SceneGeometry, FloorFromTextAndBinaryAlike) {
    const LevelFile level = LevelFile::withFloor();
    for (const auto& scene : {level.import(), level.importGlb()}) {
        ASSERT_IMPORTED(scene);
        ASSERT_EQ(scene->meshes.size(), 1u);
        const SceneMesh& mesh = scene->meshes[0];
        EXPECT_EQ(mesh.node, "floor");
        EXPECT_EQ(mesh.positions_m.size(), 4u);
        EXPECT_EQ(mesh.triangles, (std::vector<glm::uvec3>{{0, 1, 2}, {0, 2, 3}}));
        EXPECT_EQ(mesh.triangle_materials, (std::vector<uint32_t>{0, 0}));
        expectNear(mesh.positions_m[2], {1, 0, 1});
        expectNear(mesh.normals[3], {0, 1, 0});
        EXPECT_TRUE(mesh.uv0.empty());
        EXPECT_TRUE(mesh.uv1.empty());
        EXPECT_FALSE(mesh.door || mesh.light_set || mesh.texels_per_metre || mesh.grid_spacing_m);
        EXPECT_EQ(mesh.lighting, Lighting::Automatic);
        EXPECT_TRUE(scene->warnings.empty());
    }
}

TEST(SceneGeometry, ExternalBuffer) {
    LevelFile level = LevelFile::withFloor();
    level.document["buffers"] = json::array({{{"byteLength", level.buffer.size()}, {"uri", "the%20data.bin"}}});
    const TemporaryFolder folder;
    folder.write("the data.bin", level.buffer.data(), level.buffer.size());
    const std::string text = level.gltfText();
    const auto scene = importLevel(folder.write("level.gltf", text.data(), text.size()));
    ASSERT_IMPORTED(scene);
    expectNear(scene->meshes[0].positions_m[2], {1, 0, 1});
}

// As the parser joins a folder and a name; with "//" nothing beside a level at the root of the file system was found.
TEST(SceneGeometry, FoldersJoinWithOneSlash) {
    EXPECT_EQ(pathIn("/", "a.bin"), "/a.bin");
    EXPECT_EQ(pathIn("/levels", "a.bin"), "/levels/a.bin");
    EXPECT_EQ(pathIn("/levels/", "a.bin"), "/levels/a.bin");
    EXPECT_EQ(pathIn("/", ""), "/");
}

// A plus is a plus, and a buffer's file may be longer than the buffer: exporters pad.
TEST(SceneGeometry, BuffersMayHaveAPlusInTheirNameAndBytesToSpare) {
    const TemporaryFolder folder;
    LevelFile level = LevelFile::withFloor();
    level.document["buffers"] = json::array({{{"byteLength", level.buffer.size()}, {"uri", "a+b%2Bc.bin"}}});
    std::vector<uint8_t> padded(level.buffer.begin(), level.buffer.end());
    padded.insert(padded.end(), 5, 0xee);
    folder.write("a+b+c.bin", padded.data(), padded.size());
    const std::string text = level.document.dump();
    const auto scene = importLevel(folder.write("level.gltf", text.data(), text.size()));
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->meshes.size(), 1u);
    // Shorter is no buffer.
    folder.write("a+b+c.bin", padded.data(), 7);
    expectBadInput(importLevel(folder.path / "level.gltf"), {"a+b+c.bin"});
}

TEST(SceneGeometry, NodesMoveRotateAndScaleInThatOrderDownTheTree) {
    LevelFile level = LevelFile::withFloor();
    const float half = std::numbers::sqrt2_v<float> / 2;
    // 90 degrees about Y: (x, y, z) -> (z, y, -x).
    const int parent = level.addNode(
        {{"name", "pivot"}, {"translation", {10, 0, 0}}, {"rotation", {0, half, 0, half}}, {"scale", {2, 3, 4}}});
    level.addNode({{"name", "wall"},
                   {"mesh", level.addSquareMesh(0)},
                   {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1}}},
                  parent);
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->meshes.size(), 2u);
    const SceneMesh& wall = scene->meshes[1];
    // Corner (0.5, 0.5, 0): + (5, 6, 7), scaled (11, 19.5, 28), rotated (28, 19.5, -11), moved (38, 19.5, -11).
    expectNear(wall.positions_m[2], {38, 19.5f, -11}, 1e-4f);
    expectNear(wall.normals[2], {1, 0, 0});
    expectNear(faceNormal(wall, 0), {1, 0, 0});
    // A last row that a tool rounded is none.
    json& matrix = level.document["nodes"].back()["matrix"];
    matrix[15] = 0.99999994;
    matrix[3] = 1e-8;
    const auto rounded = level.import();
    ASSERT_IMPORTED(rounded);
    EXPECT_EQ(rounded->meshes[1].positions_m, wall.positions_m);
    matrix[15] = 0.999;
    expectBadInput(level.import(), {"node 'wall'", "matrix"});
}

TEST(SceneGeometry, NormalsTurnWithTheInverseTranspose) {
    LevelFile level = LevelFile::withFloor();
    const float r = std::numbers::sqrt2_v<float> / 2;
    // The plane x + y = 0, stretched along x: x/4 + y = 0, normal (1, 4, 0) / sqrt(17).
    const int slope =
        level.addMesh({{-1, 1, 0}, {1, -1, 0}, {-1, 1, -1}}, std::vector(3, glm::vec3(r, r, 0)), {0, 1, 2}, 0);
    level.addNode({{"name", "slope"}, {"mesh", slope}, {"scale", {4, 1, 1}}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    const glm::vec3 expected = glm::vec3(1, 4, 0) / std::sqrt(17.0f);
    expectNear(scene->meshes[1].normals[0], expected);
    expectNear(faceNormal(scene->meshes[1], 0), expected);
}

TEST(SceneGeometry, MirroredNodesKeepTheirFront) {
    for (const json& scale : {json{-1, 1, 1}, json{-1, -1, -1}, json{2, 1, -3}}) {
        LevelFile level = LevelFile::withFloor();
        level.addNode({{"name", "mirror"}, {"mesh", level.addSquareMesh(0)}, {"scale", scale}});
        const auto scene = level.import();
        ASSERT_IMPORTED(scene);
        const SceneMesh& mesh = scene->meshes[1];
        const glm::vec3 front(0, 0, scale[2] > 0 ? 1 : -1);  // where the mirror image of +Z points
        for (size_t t = 0; t < mesh.triangles.size(); ++t) expectNear(faceNormal(mesh, t), front);
        for (const glm::vec3& normal : mesh.normals) expectNear(normal, front);
    }
}

TEST(SceneGeometry, StripsFansAndPlainVertices) {
    // A square's corners in strip order and in fan order; every way gives area 1 facing +Z.
    const std::vector<glm::vec3> strip = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
    const std::vector<glm::vec3> fan = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    const std::vector<glm::vec3> plain = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    constexpr int triangles = 4, triangle_strip = 5, triangle_fan = 6;
    const std::pair<int, std::vector<glm::vec3>> cases[] = {
        {triangle_strip, strip}, {triangle_fan, fan}, {triangles, plain}};
    for (const auto& [mode, positions] : cases) {
        LevelFile level = LevelFile::withFloor();
        const int mesh = level.addMesh(positions, std::vector(positions.size(), glm::vec3(0, 0, 1)), {}, 0);
        level.primitive(mesh)["mode"] = mode;
        level.addNode({{"name", "square"}, {"mesh", mesh}});
        const auto scene = level.import();
        ASSERT_IMPORTED(scene);
        const SceneMesh& square = scene->meshes[1];
        ASSERT_EQ(square.triangles.size(), 2u) << "mode " << mode;
        for (size_t t = 0; t < 2; ++t) expectNear(faceNormal(square, t), {0, 0, 1});
    }
}

TEST(SceneGeometry, LinesAreSkippedWithAWarning) {
    LevelFile level = LevelFile::withFloor();
    const int mesh = level.addMesh({{0, 0, 0}, {1, 0, 0}}, {}, {}, 0);
    level.primitive(mesh)["mode"] = 1;
    level.addNode({{"name", "wire"}, {"mesh", mesh}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->meshes.size(), 1u);
    expectWarning(*scene, {"node 'wire'", "points or lines"});
    expectWarning(*scene, {"node 'wire'", "no triangles"});
}

TEST(SceneGeometry, PrimitivesOfANodeBecomeOneMesh) {
    LevelFile level = LevelFile::withFloor();
    const int red = level.addMaterial({{"name", "red"}});
    const int mesh = level.addSquareMesh(0);
    json second = level.primitive(mesh);
    second["material"] = red;
    json third = level.primitive(mesh);
    third.erase("material");
    level.document["meshes"][static_cast<size_t>(mesh)]["primitives"] =
        json::array({level.primitive(mesh), second, third});
    level.addNode({{"name", "box"}, {"mesh", mesh}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->meshes.size(), 2u);
    EXPECT_EQ(scene->meshes[1].positions_m.size(), 12u);
    EXPECT_EQ(scene->meshes[1].triangle_materials, (std::vector<uint32_t>{0, 0, 1, 1, 2, 2}));
    ASSERT_EQ(scene->materials.size(), 3u);
    EXPECT_EQ(scene->materials[2].metallic, 1.0f);  // glTF's default
    EXPECT_EQ(scene->materials[2].base_color, glm::vec3(1));
    expectWarning(*scene, {"node 'box'", "no material"});
}

TEST(SceneGeometry, OnlyUsedVerticesAreKept) {
    LevelFile level = LevelFile::withFloor();
    const std::vector<glm::vec3> positions = {{9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {8, 8, 8}, {1, 1, 0}};
    level.addNode(
        {{"name", "part"}, {"mesh", level.addMesh(positions, std::vector(5, glm::vec3(0, 0, 1)), {1, 2, 4}, 0)}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    const SceneMesh& part = scene->meshes[1];
    ASSERT_EQ(part.positions_m.size(), 3u);
    EXPECT_EQ(part.triangles, (std::vector<glm::uvec3>{{0, 1, 2}}));
    expectNear(part.positions_m[2], {1, 1, 0});
}

size_t bytesToImport(const LevelFile& level) {
    const size_t before = *dimmer::test::allocatedBytes();
    const auto scene = level.import();
    EXPECT_TRUE(scene.has_value()) << scene.error().message;
    return *dimmer::test::allocatedBytes() - before;
}

// 100,000 vertices of which one triangle uses three: placed 20,000 times, and shared by 20,000 primitives. Positions
// alone of all of them would be 24 GB each way.
TEST(SceneGeometry, VerticesThatNothingUsesCostNothing) {
    if (!dimmer::test::allocatedBytes()) GTEST_SKIP() << "the sanitizer has an allocator of its own";
    constexpr size_t many = 20000, vertices = 100000;
    std::vector<glm::vec3> positions(vertices, glm::vec3(0));
    positions[1].x = positions[99999].y = 1;
    const std::vector<glm::vec3> normals(positions.size(), glm::vec3(0, 0, 1));
    // What a node or a primitive costs by itself, JSON and all, is kilobytes; its vertices would be 1.2 MB.
    constexpr size_t bytes_max = many * vertices * sizeof(glm::vec3) / 10;
    LevelFile placed = LevelFile::withFloor();
    const int mesh = placed.addMesh(positions, normals, {0, 1, 99999}, 0);
    json& nodes = placed.document["nodes"];
    json& roots = placed.document["scenes"][0]["nodes"];
    for (size_t i = 0; i < many; ++i) {
        roots.push_back(nodes.size());
        nodes.push_back({{"mesh", mesh}, {"translation", {i, 0, 0}}});
    }
    EXPECT_LT(bytesToImport(placed), bytes_max);

    LevelFile shared = LevelFile::withFloor();
    const int parts = shared.addMesh(positions, normals, {0, 1, 99999}, 0);
    json& primitives = shared.document["meshes"][static_cast<size_t>(parts)]["primitives"];
    primitives = json::array_t(many, primitives[0]);
    shared.addNode({{"name", "parts"}, {"mesh", parts}});
    EXPECT_LT(bytesToImport(shared), bytes_max);
}

// The same geometry and the same words for every node that has the mesh.
TEST(SceneGeometry, NodesThatShareAMeshAreAlike) {
    LevelFile level = LevelFile::withFloor();
    const int mesh = level.addMesh({{9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}, {1, 2, 3, 2}, 0);
    for (const char* name : {"one", "two"}) level.addNode({{"name", name}, {"mesh", mesh}, {"translation", {0, 0, 5}}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->meshes.size(), 3u);
    EXPECT_EQ(scene->meshes[1].positions_m, (std::vector<glm::vec3>{{0, 0, 5}, {1, 0, 5}, {0, 1, 5}}));
    EXPECT_EQ(scene->meshes[2].positions_m, scene->meshes[1].positions_m);
    for (const char* name : {"node 'one'", "node 'two'"}) {
        expectWarning(*scene, {name, "incomplete"});
        expectWarning(*scene, {name, "no normals"});
    }
}

TEST(SceneGeometry, AWarningOfManyNodesIsOneLine) {
    LevelFile level = LevelFile::withFloor();
    const int mesh = level.addMesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}, {0, 1, 2}, 0);
    for (int i = 0; i < 500; ++i) level.addNode({{"name", "crate" + std::to_string(i)}, {"mesh", mesh}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    ASSERT_EQ(scene->warnings.size(), 1u);
    expectWarning(*scene, {"node 'crate0', node 'crate1', node 'crate2', node 'crate3' and 496 more: has no normals"});
}

// A rig as editors make it: the empty node moves, the mesh hangs below.
TEST(SceneGeometry, WhatIsMeantToMoveAndIsBakedIsTold) {
    for (const bool by_animation : {false, true})
        for (const bool told : {false, true}) {
            LevelFile level = LevelFile::withFloor();
            const int mesh =
                level.addMesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, std::vector(3, glm::vec3(0, 0, 1)), {0, 1, 2}, 0);
            json hull = {{"name", "hull"}, {"mesh", mesh}};
            if (told) hull["extras"] = {{"dimmer_dynamic", 1}};
            const int part = level.addNode(hull);
            json& nodes = level.document["nodes"];
            json& roots = level.document["scenes"][0]["nodes"];
            roots.back() = nodes.size();
            json drone = {{"name", "drone"}, {"children", {part}}};
            if (by_animation)
                level.document["animations"] = {
                    {{"channels", {{{"sampler", 0}, {"target", {{"node", nodes.size()}, {"path", "translation"}}}}}},
                     {"samplers", {{{"input", 0}, {"output", 0}}}}}};
            else
                drone["extras"] = {{"dimmer_dynamic", 1}};
            nodes.push_back(drone);
            const auto scene = level.import();
            ASSERT_IMPORTED(scene);
            ASSERT_EQ(scene->warnings.size(), told ? 0u : 1u) << by_animation;
            if (!told)
                expectWarning(*scene,
                              {"node 'hull'", "baked where it stands", by_animation ? "animated" : "node 'drone'"});
        }
}

TEST(SceneGeometry, FlatNormalsWhereThereAreNone) {
    LevelFile level = LevelFile::withFloor();
    // Two walls of a corner that share an edge.
    const int corner = level.addMesh({{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}}, {}, {0, 2, 1, 0, 1, 3}, 0);
    level.addNode({{"name", "corner"}, {"mesh", corner}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    const SceneMesh& mesh = scene->meshes[1];
    ASSERT_EQ(mesh.positions_m.size(), 6u);
    for (const auto& [triangle, normal] : {std::pair{0u, glm::vec3(0, 0, 1)}, {1u, glm::vec3(1, 0, 0)}})
        for (int c = 0; c < 3; ++c) expectNear(mesh.normals[mesh.triangles[triangle][c]], normal);
    expectWarning(*scene, {"node 'corner'", "no normals", "flat"});
}

TEST(SceneGeometry, NormalsOfLengthZeroBecomeTheTriangles) {
    LevelFile level = LevelFile::withFloor();
    const int mesh = level.addMesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 0, 2}, {0, 0, 0}, {0, 0, 1}}, {0, 1, 2}, 0);
    level.addNode({{"name", "odd"}, {"mesh", mesh}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    for (const glm::vec3& normal : scene->meshes[1].normals) expectNear(normal, {0, 0, 1});
    expectWarning(*scene, {"node 'odd'", "1 normals"});
}

TEST(SceneGeometry, DegenerateTrianglesAreDropped) {
    LevelFile level = LevelFile::withFloor();
    const int mesh = level.addMesh({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}}, std::vector(4, glm::vec3(0, 0, 1)),
                                   {0, 1, 2, 0, 0, 3, 0, 1, 3}, 0);
    level.addNode({{"name", "sliver"}, {"mesh", mesh}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->meshes[1].triangles.size(), 1u);
    EXPECT_EQ(scene->meshes[1].triangle_materials.size(), 1u);
    expectWarning(*scene, {"node 'sliver'", "2 triangles without area"});
}

// What floats round to a point took a page of texels, and its normals were none.
TEST(SceneGeometry, TrianglesOfLessThanAMicrometreAreDropped) {
    for (const float side_m : {1e-3f, 0.8e-6f, 0.6e-6f, 1e-13f, 1e-20f, 1e-30f}) {
        SCOPED_TRACE(side_m);
        LevelFile level = LevelFile::withFloor();
        level.addNode({{"name", "speck"},
                       {"mesh", level.addMesh({{0, 0, 0}, {side_m, 0, 0}, {0, side_m, 0}},
                                              std::vector(3, glm::vec3(0, 0, 1)), {0, 1, 2}, 0)}});
        const auto scene = level.import();
        ASSERT_IMPORTED(scene);
        EXPECT_EQ(scene->meshes.size(), side_m * std::sqrt(2.0f) > 1e-6f ? 2u : 1u);
        if (scene->meshes.size() == 1) expectWarning(*scene, {"node 'speck'", "1 triangles without area"});
    }
}

TEST(SceneGeometry, ThinTrianglesOfRealLevelsStay) {
    LevelFile level = LevelFile::withFloor();
    const int mesh = level.addMesh({{0, 0, 0}, {16, 0, 0}, {16, 0.001f, 0}}, {}, {0, 1, 2}, 0);
    level.addNode({{"name", "thin"}, {"mesh", mesh}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->meshes.size(), 2u);
}

// Neither is applied; what is dynamic is where the game puts it.
TEST(SceneGeometry, JointsAndShapeKeysAreWarnedOf) {
    LevelFile level = LevelFile::withFloor();
    const int mesh = level.addSquareMesh(0), node = level.addNode({{"name", "guard"}, {"mesh", mesh}});
    const auto warnings = [&] {
        const auto scene = level.import();
        return scene ? scene->warnings.size() : SIZE_MAX;
    };
    level.document["skins"] = json::array({{{"joints", {0}}, {"inverseBindMatrices", 0}}});
    level.node(node)["skin"] = 0;
    auto scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->warnings.size(), 1u);
    expectWarning(*scene, {"node 'guard'", "joints", "Apply the armature"});
    level.node(node)["extras"] = {{"dimmer_dynamic", 1}};
    EXPECT_EQ(warnings(), 0u);

    level.node(node).erase("skin");
    level.node(node).erase("extras");
    level.document["meshes"][static_cast<size_t>(mesh)]["weights"] = {0, 0.5};
    scene = level.import();
    ASSERT_IMPORTED(scene);
    EXPECT_EQ(scene->warnings.size(), 1u);
    expectWarning(*scene, {"node 'guard'", "morph targets", "Apply the shape keys"});
    level.node(node)["weights"] = {0, 0};  // in place of the mesh's
    EXPECT_EQ(warnings(), 0u);
}

TEST(SceneGeometry, TextureCoordinates) {
    LevelFile level = LevelFile::withFloor();
    const int mesh = level.addSquareMesh(0);
    const uint8_t quantized[4][4] = {{0, 0, 0, 0}, {255, 0, 0, 0}, {255, 51, 0, 0}, {0, 102, 0, 0}};
    const int view = level.addView(quantized, sizeof(quantized));
    level.document["bufferViews"][static_cast<size_t>(view)]["byteStride"] = 4;
    constexpr int unsigned_byte = 5121;
    const int bytes = level.addAccessor(view, unsigned_byte, 4, "VEC2");
    level.document["accessors"][static_cast<size_t>(bytes)]["normalized"] = true;
    level.primitive(mesh)["attributes"]["TEXCOORD_0"] = bytes;
    level.primitive(mesh)["attributes"]["TEXCOORD_1"] = level.addVec2({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
    level.addNode({{"name", "poster"}, {"mesh", mesh}});
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    const SceneMesh& poster = scene->meshes[1];
    ASSERT_EQ(poster.uv0.size(), 4u);
    EXPECT_EQ(poster.uv0[1], glm::vec2(1, 0));
    EXPECT_FLOAT_EQ(poster.uv0[2].y, 0.2f);
    EXPECT_FLOAT_EQ(poster.uv0[3].y, 0.4f);
    ASSERT_EQ(poster.uv1.size(), 4u);
    EXPECT_EQ(poster.uv1[2], glm::vec2(1, 1));
}

TEST(SceneGeometry, QuantizedPositionsNeedTheirExtension) {
    LevelFile level = LevelFile::withFloor();
    const int16_t positions[3][4] = {{0, 0, 0, 0}, {300, 0, 0, 0}, {0, -200, 0, 0}};
    const int view = level.addView(positions, sizeof(positions));
    level.document["bufferViews"][static_cast<size_t>(view)]["byteStride"] = 8;
    constexpr int signed_short = 5122;
    const int mesh = level.addMesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}, {0, 1, 2}, 0);
    level.primitive(mesh)["attributes"]["POSITION"] = level.addAccessor(view, signed_short, 3, "VEC3");
    level.addNode({{"name", "small"}, {"mesh", mesh}, {"scale", {0.01, 0.01, 0.01}}});
    expectBadInput(level.import(), {"node 'small'", "POSITION", "KHR_mesh_quantization"});
    level.document["extensionsUsed"] = {"KHR_mesh_quantization"};
    level.document["extensionsRequired"] = {"KHR_mesh_quantization"};
    const auto scene = level.import();
    ASSERT_IMPORTED(scene);
    expectNear(scene->meshes[1].positions_m[1], {3, 0, 0});
    expectNear(scene->meshes[1].positions_m[2], {0, -2, 0});
}

TEST(SceneGeometry, SparseAccessors) {
    for (const bool with_base : {true, false}) {
        LevelFile level = LevelFile::withFloor();
        const int mesh = level.addMesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}, {0, 1, 2}, 0);
        const auto accessor = level.primitive(mesh)["attributes"]["POSITION"].get<size_t>();
        const uint16_t targets[2] = {1, 2};
        const glm::vec3 values[2] = {{3, 0, 0}, {0, 0, 4}};
        constexpr int unsigned_short = 5123;
        level.document["accessors"][accessor]["sparse"] = {
            {"count", 2},
            {"indices", {{"bufferView", level.addView(targets, sizeof(targets))}, {"componentType", unsigned_short}}},
            {"values", {{"bufferView", level.addView(values, sizeof(values))}}}};
        if (!with_base) level.document["accessors"][accessor].erase("bufferView");
        level.addNode({{"name", "sparse"}, {"mesh", mesh}});
        const auto scene = level.import();
        ASSERT_IMPORTED(scene);
        const SceneMesh& sparse = scene->meshes[1];
        ASSERT_EQ(sparse.positions_m.size(), 3u);
        expectNear(sparse.positions_m[0], {0, 0, 0});
        expectNear(sparse.positions_m[1], {3, 0, 0});
        expectNear(sparse.positions_m[2], {0, 0, 4});

        level.document["accessors"][accessor]["sparse"]["count"] = 4;  // more than the accessor has
        expectBadInput(level.import(), {"node 'sparse'", "POSITION", "sparse"});
    }
}

}  // namespace
}  // namespace dimmer::cook::test
