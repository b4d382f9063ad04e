// Standard streams that are full or closed, and what a reader of stderr may rely on.
#include <app/tool_fixture.h>
#include <fmt/format.h>
#include <sys/stat.h>

namespace dimmer::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

class Streams : public ToolTest {
   protected:
    // Through a shell, which redirects: "2>&-" closes stderr.
    static ProcessResult redirected(const std::vector<std::string>& arguments, const std::string& redirection,
                                    const std::string& tool = DIMMER_TOOL) {
        std::vector<std::string> words = {"-c", "exec \"$0\" \"$@\" " + redirection, tool};
        words.insert(words.end(), arguments.begin(), arguments.end());
        return runProcess("/bin/sh", words);
    }
    // Redirects a stream to a pipe whose reader has gone: a named one opens for writing because the shell reads it.
    static std::string withoutReader(int stream) {
        const std::string pipe = file("pipe");
        mkfifo(pipe.c_str(), 0600);  // but once
        return fmt::format("3<>'{0}' {1}>'{0}' 3<&-", pipe, stream);
    }
    static std::vector<std::string> lostStderr() { return {"2>/dev/full", "2>&-", withoutReader(2)}; }
    static std::vector<std::string> cookTo(const std::string& name, const std::string& profile = "quick.json") {
        return {"cook", file("level.gltf"), "-o", file(name), "--profile", file(profile), "--quality", "draft"};
    }
};

TEST_F(Streams, WorkIsDoneWithoutStderr) {
    for (const std::string& redirection : lostStderr())
        for (const char* progress : {"text", "json"}) {
            auto arguments = cookTo("unseen.dimmer");
            arguments.insert(arguments.end(), {"--progress", progress, "--no-cache"});
            const auto result = redirected(arguments, redirection);
            EXPECT_EQ(result.exit_code, 0) << redirection;
            EXPECT_THAT(result.out, HasSubstr("total on the device"));
            EXPECT_TRUE(readText(file("unseen.dimmer")) == readText(pack())) << redirection;
            std::filesystem::remove(file("unseen.dimmer"));
        }
}

TEST_F(Streams, ExitCodesStayWithoutStderr) {
    write("tight.json", R"({"extends": "quick.json", "budgets": {"total": 30000}})");
    const std::string far = write("far.csv", "x,y,z,nx,ny,nz\n99,0,0,0,1,0\n");
    for (const std::string& redirection : lostStderr()) {
        EXPECT_EQ(redirected(cookTo("no.dimmer", "tight.json"), redirection).exit_code, 3) << redirection;
        EXPECT_EQ(redirected({"inspect", file("none.dimmer")}, redirection).exit_code, 2) << redirection;
        EXPECT_EQ(redirected({"inspect", "--nonsense"}, redirection).exit_code, 2) << redirection;
        EXPECT_EQ(redirected({"cokk"}, redirection).exit_code, 2) << redirection;
        EXPECT_EQ(redirected({"--help"}, redirection).exit_code, 0) << redirection;
        EXPECT_EQ(redirected({file("none.dimmer")}, redirection, DIMMER_SAMPLE_TOOL).exit_code, 2) << redirection;
        // A note about the point goes to stderr.
        const auto sampled = redirected({"sample", pack(), "--points", far}, redirection);
        EXPECT_EQ(sampled.exit_code, 0) << redirection;
        EXPECT_THAT(sampled.out, HasSubstr("nan"));
        EXPECT_EQ(redirected({"verify", file("level.gltf"), pack(), "--points", "50", "--paths", "2048", "--no-sets",
                              "--max-error", "0"},
                             redirection)
                      .exit_code,
                  4)
            << redirection;
    }
}

TEST_F(Streams, OutputThatIsLostIsSaid) {
    for (const char* redirection : {">/dev/full", ">&-"})
        for (const std::vector<std::string>& arguments :
             {std::vector<std::string>{"inspect", pack()},
              {"inspect", pack(), "--json"},
              {"--help"},
              {"bench", pack(), "--mode", "cpu", "--frames", "1", "--only", "nothing"}}) {
            const auto result = redirected(arguments, redirection);
            EXPECT_EQ(result.exit_code, 2) << arguments[0] << redirection;
            EXPECT_EQ(result.err, "dimmer: error: the output could not be written\n") << arguments[0] << redirection;
        }
    EXPECT_EQ(redirected({"inspect", pack()}, ">/dev/full 2>&1").exit_code, 2);
    EXPECT_EQ(redirected({"inspect", pack()}, ">&- 2>&-").exit_code, 2);
}

// `dimmer inspect PACK | head -1` is no mistake that anybody wants to read of; a script still sees that it is not all.
TEST_F(Streams, AReaderThatHasEnoughIsNotTold) {
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"inspect", pack()}, {"inspect", pack(), "--json"}, {"--help"}}) {
        const auto result = redirected(arguments, withoutReader(1));
        EXPECT_EQ(result.exit_code, 2) << arguments[0];
        EXPECT_THAT(result.err, IsEmpty()) << arguments[0];
    }
    EXPECT_EQ(redirected({"inspect", file("none.dimmer")}, withoutReader(1)).exit_code, 2);
    EXPECT_EQ(redirected(cookTo("unheard.dimmer"), withoutReader(1)).exit_code, 2);
    EXPECT_TRUE(readText(file("unheard.dimmer")) == readText(pack()));
}

// What --help of cook promises: stderr is lines of JSON and lines behind "dimmer: ", be it over budget or misused.
TEST_F(Streams, EveryLineOfAMessageIsMarked) {
    write("tight.json", R"({"extends": "quick.json", "budgets": {"total": 30000}})");
    auto arguments = cookTo("no.dimmer", "tight.json");
    arguments.insert(arguments.end(), {"--progress", "json"});
    const auto over = runDimmer(arguments);
    EXPECT_EQ(over.exit_code, 3);
    std::istringstream lines(over.err);
    size_t messages = 0;
    for (std::string line; std::getline(lines, line);) {
        const bool message = line.starts_with("dimmer: ");
        messages += message;
        EXPECT_TRUE(message || json::parse(line, nullptr, false).is_object()) << line;
    }
    EXPECT_GT(messages, 1u) << over.err;  // the remedies have lines of their own
    for (const std::vector<std::string>& wrong :
         {std::vector<std::string>{"inspect"}, {"inspect", pack(), "--nonsense"}, {"cook", "--threads", "-1"}}) {
        const auto result = runDimmer(wrong);
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_THAT(result.out, IsEmpty());
        EXPECT_TRUE(result.err.starts_with("dimmer: error: ")) << result.err;
        std::istringstream text(result.err);
        for (std::string line; std::getline(text, line);) EXPECT_TRUE(line.starts_with("dimmer: ")) << line;
    }
}

}  // namespace
}  // namespace dimmer::test
