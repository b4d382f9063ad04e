// A small level, cooked once by the tool itself, for tests that look at what the tool does with a pack.
#pragma once

#include <app/process.h>
#include <gmock/gmock.h>
#include <pipeline/small_level.h>

#include <fstream>
#include <memory>
#include <sstream>

namespace dimmer::test {

using cook::test::json;

class ToolTest : public testing::Test {
   protected:
    static void SetUpTestSuite() {
        folder_ = std::make_unique<cook::test::TemporaryFolder>();
        cook::test::writeLevel(*folder_, cook::test::twoCells());
        write("quick.json", R"({"bake": {"draft": {"samples_per_texel": 2, "series_rays": 8, "rays": 32,
            "emitter_samples": 2, "bounces": 8}}})");
        cooked_ = std::make_unique<ProcessResult>(cook("level.dimmer", {"--json", file("cook.json")}));
    }
    static void TearDownTestSuite() {
        folder_.reset();
        cooked_.reset();
    }
    void SetUp() override { ASSERT_EQ(cooked_->exit_code, 0) << cooked_->err; }

    // A path in the folder that all tests of the suite share.
    static std::string file(const std::string& name) { return (folder_->path / name).string(); }
    static std::string write(const std::string& name, const std::string& text) {
        return cook::test::writeText(*folder_, name, text).string();
    }
    static std::string pack() { return file("level.dimmer"); }
    static const ProcessResult& cooked() { return *cooked_; }

    static ProcessResult cook(const std::string& pack_name, const std::vector<std::string>& more = {},
                              const std::string& level = "level.gltf", const std::string& profile = "quick.json") {
        std::vector<std::string> arguments = {"cook",      file(level),   "-o",        file(pack_name),
                                              "--profile", file(profile), "--quality", "draft"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return runDimmer(arguments);
    }

   private:
    static inline std::unique_ptr<cook::test::TemporaryFolder> folder_;
    static inline std::unique_ptr<ProcessResult> cooked_;
};

}  // namespace dimmer::test
