// docs/json.md names every key that the commands write as JSON, in the section of its command.
#include <app/tool_fixture.h>

#include <set>

namespace dimmer::test {
namespace {

class JsonDoc : public ToolTest {
   protected:
    // The page's introduction of what several commands write, and the command's own section.
    static std::string documented(const std::string& command) {
        const std::string page = readText(std::string(DIMMER_SOURCE_DIR) + "/docs/json.md");
        const size_t own = page.find("## `" + command + " --json`");
        EXPECT_NE(own, std::string::npos) << command;
        if (own == std::string::npos) return {};
        const size_t shared = page.find("## Bytes"), first = page.find("## `cook --json`");
        return page.substr(shared, first - shared) + page.substr(own, page.find("\n## ", own) - own);
    }

    // Names of elements, settings and causes are keys of objects as well, but no names of ours.
    static void collect(const json& value, std::set<std::string>& keys) {
        const std::set<std::string> named_by_content = {"bake_seconds", "causes", "settings", "changes"};
        if (value.is_array())
            for (const json& item : value) collect(item, keys);
        if (!value.is_object()) return;
        for (const auto& [key, inner] : value.items()) {
            keys.insert(key);
            if (!named_by_content.contains(key)) collect(inner, keys);
        }
    }

    static void expectDocumented(const std::string& command, const std::vector<std::string>& arguments) {
        const auto result = runDimmer(arguments);
        const json figures = json::parse(result.out, nullptr, false);
        ASSERT_TRUE(figures.is_object()) << command << result.err;
        const std::string text = documented(command);
        std::set<std::string> keys;
        collect(figures, keys);
        EXPECT_GT(keys.size(), 8u);
        for (const std::string& key : keys)
            EXPECT_THAT(text, testing::HasSubstr("`" + key + "`")) << command << " writes " << key;
    }
};

TEST_F(JsonDoc, NamesWhatCommandsWrite) {
    const std::string level = file("level.gltf");
    write("tight.json", R"({"extends": "quick.json", "budgets": {"total": 30000, "dynamic": 15000}})");
    const std::vector<std::string> cook = {"cook",      level,   "-o",     file("doc.dimmer"),
                                           "--quality", "draft", "--json", "-"};
    for (const char* profile : {"quick.json", "tight.json"}) {
        std::vector<std::string> arguments = cook;
        arguments.insert(arguments.end(), {"--profile", file(profile)});
        expectDocumented("cook", arguments);
    }
    expectDocumented("inspect", {"inspect", pack(), "--json", "-"});
    expectDocumented("verify", {"verify", level, pack(), "--points", "4", "--paths", "16", "--doors", "--causes",
                                "--formats", "--json", "-"});
    expectDocumented("bench", {"bench", pack(), "--frames", "1", "--mode", "cpu", "--json", "-"});
    expectDocumented("stress", {"stress", pack(), "--cpu", "--frames", "2", "--check-every", "1", "--json", "-"});
}

// And nothing that is written no more: what stands first in a row is a key of the program's sources.
TEST_F(JsonDoc, NamesNothingElse) {
    std::string sources;
    for (const char* name : {"cook_json", "budget_json", "inspect", "verify", "bench_report", "stress", "command"})
        sources += readText(std::string(DIMMER_SOURCE_DIR) + "/cooker/app/" + name + ".cpp");
    std::istringstream page(readText(std::string(DIMMER_SOURCE_DIR) + "/docs/json.md"));
    size_t keys = 0;
    for (std::string line; std::getline(page, line);) {
        if (!line.starts_with("| `")) continue;
        const std::string names = line.substr(0, line.find(" | "));
        for (size_t at = 0; (at = names.find('`', at)) != std::string::npos;) {
            const size_t end = names.find('`', at + 1);
            const std::string key = names.substr(at + 1, end - at - 1);
            at = end + 1;
            ++keys;
            EXPECT_THAT(sources, testing::HasSubstr("\"" + key + "\"")) << line;
        }
    }
    EXPECT_GT(keys, 60u);
}

}  // namespace
}  // namespace dimmer::test
