// What a person reads who cooks a level that is broken or suspicious: every case of docs/level.md's "What bad input
// gets" through the tool itself, with its exit code, the file, the node and the mend.
#include <app/tool_fixture.h>

#include <algorithm>
#include <functional>
#include <limits>

#include <sys/stat.h>

namespace dimmer::test {
namespace {

using cook::test::LevelFile;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

using Fragments = std::vector<std::string>;

// A white floor and a lamp over it, in the set "hall".
LevelFile plainLevel() {
    LevelFile level = LevelFile::withFloor();
    const int lamp = level.addLight("lamp", {{"type", "point"}, {"intensity", 20}}, {{"dimmer_light_set", "hall"}});
    level.node(lamp)["translation"] = {0, 1, 0};
    return level;
}

struct Case {
    std::string name;
    std::function<void(LevelFile&)> spoil;
    Fragments message;
};

class Cooks : public ToolTest {
   protected:
    static ProcessResult cookText(const std::string& text) {
        std::filesystem::remove(file("bad.dimmer"));
        write("bad.gltf", text);
        return cook("bad.dimmer", {}, "bad.gltf");
    }
    static ProcessResult cookLevel(const Case& c) {
        LevelFile level = plainLevel();
        c.spoil(level);
        return cookText(level.gltfText());
    }
    static void expectRefused(const ProcessResult& result, const Fragments& fragments) {
        EXPECT_EQ(result.exit_code, 2) << result.err;
        EXPECT_THAT(result.out, IsEmpty());
        EXPECT_THAT(result.err, HasSubstr("bad.gltf"));
        for (const std::string& f : fragments) EXPECT_THAT(result.err, HasSubstr(f));
        EXPECT_FALSE(std::filesystem::exists(file("bad.dimmer")));
    }
};

TEST_F(Cooks, ThePlainLevelWithoutAWord) {
    const auto result = cookText(plainLevel().gltfText());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, Not(HasSubstr("warning")));
}

TEST_F(Cooks, RefusesFilesThatCannotBeRead) {
    expectRefused(cookText(""), {"is empty", "Export the level again"});
    const std::string whole = plainLevel().gltfText();
    expectRefused(cookText(whole.substr(0, whole.size() / 2)), {"not a usable glTF file", "Export it again"});
    const auto missing = cook("bad.dimmer", {}, "none.gltf");
    EXPECT_EQ(missing.exit_code, 2);
    EXPECT_THAT(missing.err, HasSubstr("none.gltf: there is no such file. Check the path."));
}

// A pipe has no end to wait for.
TEST_F(Cooks, RefusesPipesAndDevices) {
    const std::string pipe = file("pipe");
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    for (const std::string& level : {pipe, std::string("/dev/zero")}) {
        const auto cooked = runDimmer({"cook", level, "-o", file("out.dimmer")});
        EXPECT_EQ(cooked.exit_code, 2);
        EXPECT_THAT(cooked.err, HasSubstr(level + ": is a folder, a pipe or a device, and no file"));
        const auto inspected = runDimmer({"inspect", level});
        EXPECT_EQ(inspected.exit_code, 2);
        EXPECT_THAT(inspected.err, HasSubstr("the pack cannot be opened"));
    }
}

TEST_F(Cooks, RefusesWhatCannotBeUsed) {
    const auto triangle = [](LevelFile& level, float bad) {
        level.addNode(
            {{"name", "wall"}, {"mesh", level.addMesh({{0, 0, 0}, {1, bad, 0}, {0, 1, 0}}, {}, {0, 1, 2}, 0)}});
    };
    const std::vector<Case> cases = {
        {"index out of range", [](LevelFile& l) { l.node(0)["mesh"] = 99; }, {"node 'floor'", "mesh 99"}},
        {"vertex out of range",
         [](LevelFile& l) {
             l.addNode({{"name", "wall"}, {"mesh", l.addMesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}, {0, 1, 3}, 0)}});
         },
         {"node 'wall'", "index 3", "3 vertices"}},
        {"NaN",
         [&](LevelFile& l) { triangle(l, std::numeric_limits<float>::quiet_NaN()); },
         {"node 'wall'", "POSITION", "NaN or infinite"}},
        {"infinity",
         [&](LevelFile& l) { triangle(l, std::numeric_limits<float>::infinity()); },
         {"node 'wall'", "POSITION", "NaN or infinite"}},
        {"door without geometry",
         [](LevelFile& l) {
             l.addNode({{"name", "frame"}, {"extras", {{"dimmer_door", "front"}}}});
         },
         {"node 'frame'", "'front'", "geometry"}},
        {"light set without lights",
         [](LevelFile& l) {
             l.node(0)["extras"] = {{"dimmer_light_set", "ghost"}};
         },
         {"node 'floor'", "'ghost'", "Remove 'dimmer_light_set'"}},
        {"singular transform",
         [](LevelFile& l) {
             l.node(0)["scale"] = {1, 0, 1};
         },
         {"node 'floor'", "singular", "other than 0"}},
        {"combination of unknown elements",
         [](LevelFile& l) {
             l.document["scenes"][0]["extras"]["dimmer_combinations"] = json::array({json::array({"hal", "door:x"})});
         },
         {"dimmer_combinations", "'hal'"}},
        {"combination of too many doors",
         [](LevelFile& l) {
             json names = json::array();
             for (int d = 0; d < 9; ++d) {
                 l.addNode({{"name", "leaf"},
                            {"mesh", l.addSquareMesh(0)},
                            {"translation", {0, 0.1 * d, 0}},
                            {"extras", {{"dimmer_door", "d" + std::to_string(d)}}}});
                 names.push_back("door:d" + std::to_string(d));
             }
             l.document["scenes"][0]["extras"]["dimmer_combinations"] = json::array({names});
         },
         {"dimmer_combinations", "names 9 doors", "8 are the most"}},
        {"required extension",
         [](LevelFile& l) { l.document["extensionsRequired"] = {"KHR_draco_mesh_compression"}; },
         {"KHR_draco_mesh_compression"}},
    };
    for (const Case& c : cases) {
        SCOPED_TRACE(c.name);
        expectRefused(cookLevel(c), c.message);
    }
}

TEST_F(Cooks, WarnsOfWhatIsSuspicious) {
    const std::vector<glm::vec3> corners = {{0, 0.5f, 0}, {1, 0.5f, 0}, {0, 1.5f, 0}};
    const std::vector<Case> cases = {
        {"degenerate triangles",
         [&](LevelFile& l) {
             l.addNode({{"name", "sliver"},
                        {"mesh", l.addMesh(corners, std::vector(3, glm::vec3(0, 0, 1)), {0, 1, 2, 0, 1, 1}, 0)}});
         },
         {"node 'sliver'", "1 triangles without area were dropped"}},
        {"no normals",
         [&](LevelFile& l) {
             l.addNode({{"name", "flat"}, {"mesh", l.addMesh(corners, {}, {0, 1, 2}, 0)}});
         },
         {"node 'flat'", "has no normals; flat ones were made"}},
        {"overlapping UVs",
         [](LevelFile& l) {
             // Both triangles of the floor on the same half of the page.
             l.primitive(0)["attributes"]["TEXCOORD_1"] = l.addVec2({{0, 0}, {0, 1}, {1, 1}, {0.1f, 0.9f}});
         },
         {"node 'floor'", "TEXCOORD_1 is no lightmap unwrap (they overlap); charts were made"}},
        {"UVs outside of the page",
         [](LevelFile& l) {
             l.primitive(0)["attributes"]["TEXCOORD_1"] = l.addVec2({{0, 0}, {0, 2}, {1, 2}, {1, 0}});
         },
         {"node 'floor'", "(they leave 0..1)"}},
        {"a light inside geometry",
         [](LevelFile& l) {
             // A closed box around the lamp whose faces look outwards: the room's mesh with every triangle turned over.
             const int box = cook::test::addRoomMesh(l, {-0.5f, -0.5f, -0.5f}, 1, 0);
             l.addNode({{"name", "box"}, {"mesh", box}, {"translation", {0, 1, 0}}});
             for (json& m : l.document["materials"]) m["doubleSided"] = false;
             json& indices = l.document["accessors"][l.primitive(box)["indices"].get<size_t>()];
             auto* first = l.buffer.data() +
                           l.document["bufferViews"][indices["bufferView"].get<size_t>()]["byteOffset"].get<size_t>();
             for (size_t i = 0; i < indices["count"].get<size_t>(); i += 3)
                 std::swap_ranges(first + 4 * i, first + 4 * i + 4, first + 4 * i + 4);
         },
         {"node 'lamp'", "inside geometry: 64 of 64 directions", "move it"}},
        {"a door that touches nothing",
         [](LevelFile& l) {
             l.addNode({{"name", "leaf"},
                        {"mesh", l.addSquareMesh(0)},
                        {"translation", {0, -50, 0}},
                        {"extras", {{"dimmer_door", "far"}}}});
         },
         {"door 'far' changes no light; it is kept, and does nothing"}},
        {"a door that changes light by less than its threshold",
         [](LevelFile& l) {
             l.addNode({{"name", "leaf"},
                        {"mesh", l.addSquareMesh(0)},
                        {"translation", {0, 0.5f, 0.9f}},
                        {"rotation", {1, 0, 0, 0}},  // upright, facing the lamp, whose light it sends to the floor
                        {"scale", {0.4f, 0.4f, 0.4f}},
                        {"extras", {{"dimmer_door", "small"}}}});
             l.document["scenes"][0]["extras"]["dimmer_settings"] = "records.threshold=1";
         },
         {"door 'small' changes light by less than its activity threshold everywhere", "Lower 'records.threshold'"}},
        {"a lamp below a door",
         [](LevelFile& l) {
             const int leaf = l.addNode({{"name", "leaf"},
                                         {"mesh", l.addSquareMesh(0)},
                                         {"translation", {0, 0.5f, 0}},
                                         {"extras", {{"dimmer_door", "moves"}}}});
             const int lantern = l.addLight("lantern", {{"type", "point"}, {"intensity", 5}}, {});
             l.node(leaf)["children"] = {lantern};
             auto& roots = l.document["scenes"][0]["nodes"];
             roots.erase(std::ranges::find(roots, json(lantern)));
         },
         {"node 'lantern'", "lamps do not move with doors"}},
        {"a set that lights nothing",
         [](LevelFile& l) {
             const int lost = l.addLight("lost", {{"type", "point"}, {"intensity", 5}}, {{"dimmer_light_set", "void"}});
             l.node(lost)["translation"] = {0, -3, 0};
         },
         {"light set 'void' reaches no surface; it is kept, and does nothing"}},
        {"a set whose lamps are at 0",
         [](LevelFile& l) {
             const int out = l.addLight("out", {{"type", "point"}, {"intensity", 0}}, {{"dimmer_light_set", "void"}});
             l.node(out)["translation"] = {0, 2, 0};
         },
         {"light set 'void' has lights of intensity 0 alone; it is kept, and does nothing"}},
    };
    for (const Case& c : cases) {
        SCOPED_TRACE(c.name);
        const auto result = cookLevel(c);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        EXPECT_THAT(result.err, HasSubstr("dimmer: warning: "));
        EXPECT_THAT(result.err, HasSubstr("bad.gltf: "));
        for (const std::string& f : c.message) EXPECT_THAT(result.err, HasSubstr(f));
        EXPECT_TRUE(std::filesystem::exists(file("bad.dimmer")));
    }
}

// Both trace the level as it was mended: without a word a figure would seem to be of the file.
TEST_F(Cooks, ReferenceAndVerifySayWhatWasMended) {
    LevelFile level = plainLevel();
    level.addNode(
        {{"name", "flat"}, {"mesh", level.addMesh({{0, 0.5f, 0}, {1, 0.5f, 0}, {0, 1.5f, 0}}, {}, {0, 1, 2}, 0)}});
    ASSERT_EQ(cookText(level.gltfText()).exit_code, 0);
    const auto reference =
        runDimmer({"reference", file("bad.gltf"), "--points", "-", "--paths", "2"}, "x,y,z,nx,ny,nz\n0,0,0,0,1,0\n");
    EXPECT_EQ(reference.exit_code, 0) << reference.err;
    EXPECT_THAT(reference.err, HasSubstr("warning: " + file("bad.gltf") + ": node 'flat': has no normals"));
    const auto verified =
        runDimmer({"verify", file("bad.gltf"), file("bad.dimmer"), "--points", "50", "--paths", "64"});
    EXPECT_EQ(verified.exit_code, 0) << verified.err;
    EXPECT_THAT(verified.err, HasSubstr("left out of the level, in 1 places"));
}

}  // namespace
}  // namespace dimmer::test
