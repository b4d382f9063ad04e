// `dimmer explain`, as a person and as a script sees it.
#include <app/tool_fixture.h>

namespace dimmer::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

using ExplainTool = ToolTest;

constexpr const char* place = "0.9,0.01,1.1";  // the first cell's floor: sets "one" and "both"

TEST_F(ExplainTool, TableAndJsonSayTheSame) {
    const auto table = runDimmer({"explain", pack(), "--point", place});
    ASSERT_EQ(table.exit_code, 0) << table.err;
    EXPECT_THAT(table.out, AllOf(HasSubstr("cell1: page 0, texel"), HasSubstr("cluster "), HasSubstr("batch "),
                                 HasSubstr("base "), HasSubstr("not stored at the texel")));
    const auto result = runDimmer({"explain", pack(), "--point", place, "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json j = json::parse(result.out);
    EXPECT_EQ(j["place"]["node"], "cell1");
    EXPECT_EQ(j["place"]["normal"], json::parse("[0.0, 1.0, 0.0]"));
    double share = j["base"]["share"];
    for (const json& c : j["contributions"]) {
        share += c["share"].get<double>();
        const bool here = c["light"] == "one" || c["light"] == "both";
        EXPECT_EQ(c["stored"].get<bool>(), here) << c;
        EXPECT_EQ(c["bytes"], here ? 8 : 0);
        EXPECT_EQ(c["bytes_in_all"], c["receivers_in_all"].get<uint64_t>() * 8);
        EXPECT_EQ(c["share"].get<double>() > 0, here) << c;
        for (const char* key : {"doors_open", "doors_closed", "weight", "energy_dropped"}) EXPECT_TRUE(c.contains(key));
    }
    EXPECT_NEAR(share, 1, 1e-6);
    // A cluster's contributions are those that are stored.
    EXPECT_EQ(j["cluster"]["contributions"], 2);
}

TEST_F(ExplainTool, TheLightIsThatOfSample) {
    const auto sampled = runDimmer({"sample", pack(), "--points", "-", "--state", "one=0.3"},
                                   "x,y,z,nx,ny,nz\n0.9,0.01,1.1,0.3,0.9,0.1\n");
    ASSERT_EQ(sampled.exit_code, 0) << sampled.err;
    const auto result = runDimmer(
        {"explain", pack(), "--point", place, "--normal", "0.3,0.9,0.1", "--state", "one=0.3", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json j = json::parse(result.out);
    const std::string line = sampled.out.substr(sampled.out.find('\n') + 1);
    double x = 0, r = 0, g = 0, b = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf", &x, &x, &x, &x, &x, &x, &r, &g, &b), 9);
    EXPECT_NEAR(j["lux"][0].get<double>(), r, 1e-5 * r);  // printed digits
    EXPECT_NEAR(j["lux"][2].get<double>(), b, 1e-5 * b);
}

TEST_F(ExplainTool, InTheAirTheLightIsThatOfSampleFromGrid) {
    const std::string grid = file("grid.dimmer");
    ASSERT_EQ(runDimmer({"synth", "--like", "safehouse", "--scale", "0.015625", "--probes", "-o", grid}).exit_code, 0);
    const auto sampled =
        runDimmer({"sample", grid, "--points", "-", "--from", "grid"}, "x,y,z,nx,ny,nz\n1.5,1.2,2.5,0,0.6,-0.8\n");
    ASSERT_EQ(sampled.exit_code, 0) << sampled.err;
    const auto result = runDimmer(
        {"explain", grid, "--point", "1.5,1.2,2.5", "--normal", "0,0.6,-0.8", "--from", "grid", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json j = json::parse(result.out);
    EXPECT_EQ(j["from"], "grid");
    EXPECT_EQ(j["normal"].size(), 3u);
    EXPECT_FALSE(j.contains("place"));
    double probes = 0, share = j["base"]["share"];
    for (const json& probe : j["probes"]) probes += probe["share"].get<double>();
    for (const json& c : j["contributions"]) {
        share += c["share"].get<double>();
        EXPECT_EQ(c["bytes_in_all"], c["receivers_in_all"].get<uint64_t>() * 28);
    }
    EXPECT_NEAR(probes, 1, 1e-5);
    EXPECT_NEAR(share, 1, 1e-6);
    const std::string line = sampled.out.substr(sampled.out.find('\n') + 1);
    double x = 0, r = 0, g = 0, b = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf", &x, &x, &x, &x, &x, &x, &r, &g, &b), 9);
    EXPECT_GT(g, 0);
    EXPECT_NEAR(j["lux"][1].get<double>(), g, 1e-5 * g);  // printed digits
    // Far away: told, and no number is infinite.
    const auto far = runDimmer({"explain", grid, "--point", "1e38,1e38,0", "--from", "grid", "--json", "-"});
    const json f = json::parse(far.out);
    EXPECT_NEAR(f["outside_m"].get<double>(), 1.414214e38, 1e33);
    EXPECT_TRUE(f["normal"].is_null());
}

TEST_F(ExplainTool, WhatIsRefused) {
    const auto refused = [](const std::vector<std::string>& more, const std::string& message) {
        std::vector<std::string> arguments = {"explain", pack()};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const auto result = runDimmer(arguments);
        EXPECT_EQ(result.exit_code, 2) << result.err;
        EXPECT_THAT(result.out, IsEmpty());
        EXPECT_THAT(result.err, AllOf(HasSubstr(message), Not(HasSubstr("internal"))));
    };
    refused({}, "--point");
    refused({"--point", "1,2"}, "--point");
    refused({"--point", "1,2,x"}, "--point");
    refused({"--point", "1,nan,3"}, "finite");
    refused({"--point", "-1,-5,-2.5"}, "m away");
    refused({"--point", place, "--normal", "0,0,0"}, "no length");
    refused({"--point", place, "--state", "onne=1"}, "Did you mean");
    EXPECT_THAT(runDimmer({"explain", "--help"}).out, HasSubstr("Example: dimmer explain "));
}

}  // namespace
}  // namespace dimmer::test
