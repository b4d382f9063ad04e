// What a build system is told of the files that a pack is made from.
#include <app/depfile.h>
#include <app/tool_fixture.h>

namespace dimmer::test {
namespace {

using testing::HasSubstr;

using Depfile = ToolTest;

// By the manual of GNU make: "$$" is a dollar, a backslash keeps a space, a # or a colon from ending the name, and
// backslashes before one are doubled. A % is a pattern's in targets alone.
TEST(DepfileText, IsOfMakesSyntax) {
    EXPECT_EQ(cook::depfileText("out/a b.dimmer",
                                {"level.gltf", "c#.png", "$d.ies", "c:e.bin", "f\\ g", "h\\i", "5%.png", "w (1).png"})
                  .value(),
              "out/a\\ b.dimmer: level.gltf c\\#.png $$d.ies c\\:e.bin f\\\\\\ g h\\i 5%.png w\\ (1).png\n");
}

// GNU make 4.3 and Ninja 1.11 were asked what they make of these, as they are and behind a backslash.
TEST(DepfileText, RefusesWhatMakeOrNinjaWouldMisread) {
    const auto expectRefused = [](const auto& text, const std::string& what) {
        ASSERT_FALSE(text) << what << *text;
        EXPECT_EQ(text.error().code, ErrorCode::InvalidArgument);
        EXPECT_THAT(text.error().message,
                    testing::AllOf(HasSubstr("--depfile: "), HasSubstr(": the name has " + what)));
        EXPECT_THAT(text.error().message, testing::Not(HasSubstr("\n")));
    };
    for (const char* c : {"=", ";", "\"", "'", "*", "?", "[", "&", "|", "<", ">", "^", "`"})
        for (const std::string& name : {c + std::string("name"), std::string("na") + c + "me"}) {
            expectRefused(cook::depfileText("pack", {"level.gltf", name}), std::string("a ") + c);
            expectRefused(cook::depfileText(name, {"level.gltf"}), std::string("a ") + c);
        }
    expectRefused(cook::depfileText("5%", {"level.gltf"}), "a %");
    expectRefused(cook::depfileText("pack", {"two\nlines.png"}), "a line break");
    for (const char* name : {"a\tb", "a\rb", "\x1b[0m"})
        expectRefused(cook::depfileText("pack", {name}), "a control character");
    for (const char* name : {"dir\\", "a\\:b", "a\\#b", "a\\$b"})
        expectRefused(cook::depfileText("pack", {name}), "a \\");
    expectRefused(cook::depfileText("pack", {"wall(1)"}), "a (");
}

TEST_F(Depfile, ListsWhatIsThereOnce) {
    json level = json::parse(readText(file("level.gltf")));
    level["images"] = json::parse(R"([{"uri": "wall%20paint.png"}, {"uri": "none.png"}, {"uri": "wall%20paint.png"}])");
    write("painted.gltf", level.dump());
    const std::string paint = write("wall paint.png", "unused");
    const std::string top = write("top.json", R"({"extends": "quick.json"})");
    const auto cooked = cook("painted.dimmer", {"--depfile", file("pack.d"), "--json", file("painted.json")},
                             "painted.gltf", "top.json");
    ASSERT_EQ(cooked.exit_code, 0) << cooked.err;
    EXPECT_EQ(readText(file("pack.d")), file("painted.dimmer") + ": " + file("painted.gltf") + " " +
                                            file("wall\\ paint.png") + " " + top + " " + file("quick.json") + "\n");
    EXPECT_EQ(json::parse(readText(file("painted.json")))["inputs"],
              json({file("painted.gltf"), paint, top, file("quick.json")}));
}

// Over budget there is no pack that could depend on anything; the inputs are what to change.
TEST_F(Depfile, OfNoPackIsNone) {
    write("tight.json", R"({"extends": "quick.json", "budgets": {"total": 30000}})");
    const auto over = cook("over.dimmer", {"--depfile", file("over.d"), "--json", "-"}, "level.gltf", "tight.json");
    EXPECT_EQ(over.exit_code, 3);
    EXPECT_FALSE(std::filesystem::exists(file("over.d")));
    EXPECT_EQ(json::parse(over.out)["inputs"], json({file("level.gltf"), file("tight.json"), file("quick.json")}));
}

TEST_F(Depfile, IsRefusedBeforeTheWork) {
    for (const auto& [depfile, words] : {std::pair{file("level.gltf"), "--depfile and LEVEL are the same file"},
                                         {file("new.dimmer"), "--depfile and --output are the same file"},
                                         {std::string("-"), "--depfile: '-' is not a file"}}) {
        const auto result = cook("new.dimmer", {"--depfile", depfile});
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_THAT(result.err, HasSubstr(words));
    }
    write("two\nlines.json", R"({"extends": "quick.json"})");
    const auto result = cook("new.dimmer", {"--depfile", file("new.d")}, "level.gltf", "two\nlines.json");
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("line break"));
    const auto equals = cook("new=.dimmer", {"--depfile", file("new.d")});
    EXPECT_EQ(equals.exit_code, 2);
    EXPECT_THAT(equals.err,
                testing::AllOf(HasSubstr("new=.dimmer: the name has a =, "), testing::Not(HasSubstr("charts"))));
    for (const char* name : {"new.dimmer", "new=.dimmer", "new.d"})
        EXPECT_FALSE(std::filesystem::exists(file(name))) << name;
}

}  // namespace
}  // namespace dimmer::test
