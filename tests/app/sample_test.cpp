// `dimmer sample`: points in, lux out.
#include <app/tool_fixture.h>
#include <fmt/format.h>
#include <tools/headless_device.h>

#include <cmath>

namespace dimmer::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr const char* header = "x,y,z,nx,ny,nz\n";
constexpr const char* floor_point = "1,0,1,0,1,0\n";    // the first room's floor
constexpr const char* far_point = "9,0,1,0,1,0\n";      // the second room's
constexpr const char* lost_point = "1,0.15,1,0,1,0\n";  // 15 cm above a floor
constexpr const char* near_point = "1,0.05,1,0,1,0\n";  // 5 cm above

struct Sample : ToolTest {
    static ProcessResult run(const std::string& points, const std::vector<std::string>& more = {}) {
        std::vector<std::string> arguments = {"sample", pack(), "--points", "-"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return runDimmer(arguments, header + points);
    }
    // The last column's numbers of all lines: red, green, blue.
    static std::vector<std::array<double, 3>> lux(const std::string& csv) {
        std::vector<std::array<double, 3>> values;
        std::istringstream lines(csv);
        std::string line;
        std::getline(lines, line);
        EXPECT_EQ(line, "x,y,z,nx,ny,nz,Er,Eg,Eb");
        while (std::getline(lines, line)) {
            std::array<double, 3> v{};
            size_t at = 0;
            for (int skip = 0; skip < 6; ++skip) at = line.find(',', at) + 1;
            EXPECT_EQ(std::sscanf(line.c_str() + at, "%lf,%lf,%lf", &v[0], &v[1], &v[2]), 3) << line;
            values.push_back(v);
        }
        return values;
    }
};

TEST_F(Sample, KeepsThePointsAndAddsLux) {
    const auto result = run("1,0,1,0,1,0\n1.25,0,0.5,0,2,0\n");
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, IsEmpty());
    EXPECT_THAT(result.out, AllOf(HasSubstr("\n1,0,1,0,1,0,"), HasSubstr("\n1.25,0,0.5,0,1,0,")));  // normals made unit
    for (const auto& [r, g, b] : lux(result.out)) {
        // 100 cd at about a metre in a white room: tens to hundreds of lux.
        EXPECT_GT(r, 10);
        EXPECT_LT(r, 5000);
        EXPECT_NEAR(g, r, 0.02 * r);  // white light: equal but for rounding, 1/64 and 1/32 of the value
        EXPECT_NEAR(b, r, 0.05 * r);
    }
}

TEST_F(Sample, BeyondTenCentimetresThereIsNothing) {
    const auto result = run(std::string(near_point) + lost_point);
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.out, HasSubstr("1,0.15,1,0,1,0,nan,nan,nan"));
    EXPECT_THAT(result.err, AllOf(HasSubstr("note: 1 of 2 points"), HasSubstr("10 cm")));
    const auto values = lux(result.out);
    ASSERT_EQ(values.size(), 2u);
    EXPECT_TRUE(std::isfinite(values[0][0]));
    EXPECT_TRUE(std::isnan(values[1][0]));
    // Nor does a floor light what looks down.
    EXPECT_THAT(run("1,0,1,0,-1,0\n").out, HasSubstr("nan"));
    EXPECT_EQ(run("1e30,-1e30,0,0,1,0\n").exit_code, 0);
}

// Light adds up, and each room's set is dark in the other.
TEST_F(Sample, StatesAddUp) {
    const std::string points = std::string(floor_point) + far_point;
    auto with = [&](const std::string& state) { return lux(run(points, {"--state", state}).out); };
    const auto all = with(""), one = with("all=0,one=1"), both = with("both=1,all=0"), off = with("all=0"),
               half = with("all=0,one=0.5"), red = with("all=0,one=1/0/0");
    ASSERT_EQ(all.size(), 2u);
    EXPECT_EQ(off[0][0], 0);  // closed rooms: no sky
    EXPECT_GT(one[0][0], 1);
    EXPECT_EQ(one[1][0], 0);
    // Three roundings to 7 significant bits, 1/128 each.
    EXPECT_NEAR(one[0][0] + both[0][0], all[0][0], 3.0 / 128 * all[0][0]);
    EXPECT_NEAR(half[0][0], one[0][0] / 2, 1.0 / 64 * one[0][0]);
    EXPECT_NEAR(red[0][0], one[0][0], 1.0 / 64 * one[0][0]);
    EXPECT_EQ(red[0][1], 0);
}

TEST_F(Sample, FilesAndStreamsAreTheSame) {
    const std::string text = std::string(header) + floor_point + far_point;
    const std::string in = write("in.csv", text), out = file("out.csv");
    const auto result = runDimmer({"sample", pack(), "--points", in, "-o", out});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, IsEmpty());
    const std::string from_stdin = runDimmer({"sample", pack(), "--points", "-"}, text).out;
    EXPECT_EQ(readText(out), from_stdin);
    // Windows line ends, a byte order mark, further columns and empty lines do not matter.
    const std::string edited = "\xef\xbb\xbfx,y,z,nx,ny,nz,note\r\n1,0,1,0,1,0,lamp\r\n\r\n 9, 0, 1, 0, 1, 0\r\n";
    EXPECT_EQ(runDimmer({"sample", pack(), "--points", "-"}, edited).out, from_stdin);
}

TEST_F(Sample, MalformedPointsAreNamedByLine) {
    const std::vector<std::pair<std::string, std::string>> cases = {
        {"", "stdin:1: "},
        {"1,2,3\n", "stdin:1: the header"},
        {"x,y,z,nx,ny,nz\n", "stdin:1: there are no points"},
        {"x,y,z,nx,ny,nz\n1,0,1,0,1,0\n1,0,1,0,1\n", "stdin:3: "},
        {"x,y,z,nx,ny,nz\n1,0,1,0,one,0\n", "stdin:2: "},
        {"x,y,z,nx,ny,nz\n\n1 0 1 0 1 0\n", "stdin:3: "},
        {"x,y,z,nx,ny,nz\n1,0,nan,0,1,0\n", "stdin:2: six finite numbers"},
        {"x,y,z,nx,ny,nz\n1,0,1,0,1e999,0\n", "stdin:2: "},
        {"x,y,z,nx,ny,nz\n1,0,1,0,0,0\n", "stdin:2: the normal has no length"},
        {"x,y,z,nx,ny,nz\n1,0,1,0,1,0x\n", "stdin:2: "},
    };
    for (const auto& [text, message] : cases) {
        const auto result = runDimmer({"sample", pack(), "--points", "-"}, text);
        EXPECT_EQ(result.exit_code, 2) << text;
        EXPECT_THAT(result.out, IsEmpty()) << text;
        EXPECT_THAT(result.err, HasSubstr(message)) << text;
    }
    for (const std::string& path : {file("none.csv"), file(".")}) {
        const auto result = runDimmer({"sample", pack(), "--points", path});
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_THAT(result.err, HasSubstr(path));
    }
}

TEST_F(Sample, BadStates) {
    const std::vector<std::pair<std::string, std::string>> cases = {
        {"on=1", "Did you mean \"one\""},
        {"ONE=1", "Did you mean \"one\""},
        {"one", "NAME=VALUE"},
        {"one=", "neither a number"},
        {"one=1/2", "neither"},
        {"one=nan", "one"},
        {"one=-1", "one"},
        {"one=1.5", "0..1"},
        {"door:one=1", "door"},
        {"one=1,,two=1", "NAME=VALUE"},
    };
    for (const auto& [state, message] : cases) {
        const auto result = run(floor_point, {"--state", state});
        EXPECT_EQ(result.exit_code, 2) << state;
        EXPECT_THAT(result.out, IsEmpty()) << state;
        EXPECT_THAT(result.err, StartsWith("dimmer: error: ")) << state;
        EXPECT_THAT(result.err, testing::ContainsRegex(message)) << state;
    }
}

TEST_F(Sample, GpuAndCpuAgree) {
    if (const auto any = HeadlessDevice::create(); !any) GTEST_SKIP() << "no Vulkan device: " << any.error().message;
    std::string points;
    for (int x = 0; x < 10; ++x)
        for (int z = 0; z < 10; ++z) points += fmt::format("{},0,{},0,1,0\n", 0.1 + 0.2 * x, 0.1 + 0.2 * z);
    for (const char* state : {"", "one=0.3,both=0.1/0.9/0.5", "all=0"}) {
        const auto cpu = run(points, {"--state", state});
        const auto gpu = run(points, {"--state", state, "--backend", "gpu"});
        EXPECT_EQ(cpu.exit_code, 0) << cpu.err;
        EXPECT_EQ(gpu.exit_code, 0) << gpu.err;
        EXPECT_EQ(cpu.out, gpu.out) << state;
    }
}

}  // namespace
}  // namespace dimmer::test
