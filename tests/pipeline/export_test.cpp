// `dimmer export`: what another engine would blend from the pictures is what the runtime blends.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <dimmer/cpu_runtime.h>
#include <format/texel.h>
#include <gmock/gmock.h>
#include <pack/sample_pack.h>
#include <pipeline/export_pack.h>
#include <scene/level_file.h>

#include <cmath>
#include <fstream>
#include <map>
#include <set>

namespace dimmer::cook {
namespace {

using nlohmann::json;

struct Folder {
    test::TemporaryFolder folder;
    std::filesystem::path path = folder.path / "light";
    json index() const { return json::parse(std::ifstream(path / "index.json")); }
};

// One channel of a picture, spread over its whole page; `outside` where it has none.
std::vector<float> readChannel(const std::filesystem::path& file, const char* name, float outside) {
    Imf::InputFile input(file.c_str());
    const Imath::Box2i whole = input.header().displayWindow(), window = input.header().dataWindow();
    const auto width = static_cast<size_t>(whole.max.x + 1), height = static_cast<size_t>(whole.max.y + 1);
    std::vector<float> values(width * height, outside);
    Imf::FrameBuffer frame;
    frame.insert(name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()), 4, 4 * width));
    EXPECT_NE(input.header().channels().findChannel(name), nullptr) << file << name;
    input.setFrameBuffer(frame);
    input.readPixels(window.min.y, window.max.y);
    return values;
}

// The sums of docs/format.md, in doubles.
struct Blended {
    std::vector<std::array<double, 3>> lux;
    std::vector<double> luminance, r, x, y;  // r, x, y: times the luminance

    explicit Blended(size_t texels) : lux(texels), luminance(texels), r(texels), x(texels), y(texels) {}

    void add(const std::filesystem::path& folder, const json& pictures, std::array<double, 3> weight,
             size_t page_texels) {
        for (const json& picture : pictures) {
            const auto file = folder / picture["file"].get<std::string>();
            const size_t first = picture["page"].get<size_t>() * page_texels;
            std::array<std::vector<float>, 6> c;
            for (size_t i = 0; const char* name : {"R", "G", "B", "direction.r", "direction.x", "direction.y"})
                c[i++] = readChannel(file, name, 0);
            for (size_t t = 0; t < page_texels; ++t) {
                const std::array<double, 3> e = {weight[0] * static_cast<double>(c[0][t]),
                                                 weight[1] * static_cast<double>(c[1][t]),
                                                 weight[2] * static_cast<double>(c[2][t])};
                const double l = 0.2126 * e[0] + 0.7152 * e[1] + 0.0722 * e[2];
                for (size_t i = 0; i < 3; ++i) lux[first + t][i] += e[i];
                luminance[first + t] += l;
                r[first + t] += l * static_cast<double>(c[3][t]);
                x[first + t] += l * static_cast<double>(c[4][t]);
                y[first + t] += l * static_cast<double>(c[5][t]);
            }
        }
    }
};

struct Elements {
    std::map<std::string, std::array<double, 3>> sets;
    std::map<std::string, double> doors;

    std::array<double, 3> weightOf(const json& contribution) const {
        std::array<double, 3> w = {1, 1, 1};
        if (!contribution["always_on"]) w = sets.at(contribution["light"]);
        double product = 1;
        for (const json& door : contribution["doors_open"]) product *= doors.at(door);
        for (const json& door : contribution["doors_closed"]) product *= 1 - doors.at(door);
        for (double& channel : w) channel *= product;
        return w;
    }
};

void expectBlendsAsTheRuntime(PackData data) {
    const auto pack = Pack::fromData(std::move(data));
    ASSERT_TRUE(pack) << pack.error().message;
    const Folder out;
    SilentProgress silent;
    const auto stats = exportPack(*pack, out.path, silent);
    ASSERT_TRUE(stats) << stats.error().message;

    CpuRuntime runtime(*pack);
    ASSERT_TRUE(runtime.apply("set0=2,set1=0.5/0.25/1,set2=0,door:door0=0.25,door:door1=1"));
    runtime.update();
    const Elements elements{{{"set0", {2, 2, 2}}, {"set1", {0.5, 0.25, 1}}, {"set2", {0, 0, 0}}, {"set3", {1, 1, 1}}},
                            {{"door0", 0.25}, {"door1", 1}}};
    const json index = out.index();
    const size_t page_texels = size_t{pack->pageWidth()} * pack->pageHeight();
    Blended blended(page_texels * pack->pageCount());
    blended.add(out.path, index["base"], {1, 1, 1}, page_texels);
    for (const json& c : index["contributions"])
        blended.add(out.path, c["pictures"], elements.weightOf(c), page_texels);

    size_t lit = 0;
    for (size_t t = 0; t < blended.lux.size(); ++t) {
        const auto stored = decodeColor(pack->colorFormat(), runtime.irradiancePages()[t]);
        const double exposure = static_cast<double>(pack->exposure());
        const double most = std::max({blended.lux[t][0], blended.lux[t][1], blended.lux[t][2]});
        for (size_t c = 0; c < 3; ++c) {
            // Half a step: of 6 bits (blue: 5) of the channel, or of 9 bits of the largest channel; plus what floats
            // lose in a sum of ten, and what is below the format's least number, 2^-14 of a stored value.
            const double step = pack->colorFormat() == ColorFormat::E5B9G9R9
                                    ? most / 256 / 2
                                    : blended.lux[t][c] / (c == 2 ? 32 : 64) / 2;
            EXPECT_NEAR(static_cast<double>(stored[c]) / exposure, blended.lux[t][c],
                        step + 1e-5 * blended.lux[t][c] + 0x1p-14 / exposure)
                << "texel " << t << " channel " << c;
        }
        if (!(blended.luminance[t] * exposure > 0x1p-10)) continue;  // too dark to have a direction
        ++lit;
        const Highlight highlight = decodeDirection(runtime.directionPages()[t]);
        // Half a step of 10 bits, and again for what floats lose in sums of codes.
        EXPECT_NEAR(static_cast<double>(highlight.ambient), blended.r[t] / blended.luminance[t], 1.0 / 1023);
        EXPECT_NEAR(static_cast<double>(highlight.bx), blended.x[t] / blended.luminance[t], 5.0 / 256);
        EXPECT_NEAR(static_cast<double>(highlight.by), blended.y[t] / blended.luminance[t], 5.0 / 256);
    }
    EXPECT_GT(lit, blended.lux.size() / 2);
}

TEST(Export, BlendsAsTheRuntime) {
    expectBlendsAsTheRuntime(dimmer::test::samplePack(5));
}

TEST(Export, BlendsAsTheRuntimeWithASharedExponent) {
    PackData data = dimmer::test::randomPack(6, {.sets = 4,
                                                 .doors = 2,
                                                 .clusters = 9,
                                                 .overlap_max = 5,
                                                 .page_count = 1,
                                                 .page_side = 32,
                                                 .color_format = ColorFormat::E5B9G9R9});
    data.direction_model = DirectionModel::Linear;
    expectBlendsAsTheRuntime(std::move(data));
}

TEST(Export, TheIndexNamesWhatIsThere) {
    const PackData data = dimmer::test::samplePack();
    const auto pack = Pack::fromData(PackData(data));
    const Folder out;
    SilentProgress silent;
    const auto stats = exportPack(*pack, out.path, silent);
    ASSERT_TRUE(stats) << stats.error().message;
    const json index = out.index();
    EXPECT_EQ(index["version"], 1);
    EXPECT_EQ(index["unit"], "lux");
    EXPECT_EQ(index["model"], "ahd");
    EXPECT_EQ(index["pages"], json({{"count", 2}, {"width", 32}, {"height", 32}}));
    EXPECT_EQ(index["elements"][0], json({{"name", "set0"}, {"kind", "set"}, {"max_weight", 2.0}}));
    EXPECT_EQ(index["nodes"], json::parse(R"([{"node": "floor", "page": 0}, {"node": "leaf", "page": 1}])"));
    ASSERT_EQ(index["contributions"].size(), data.contributions.size());
    std::set<std::string> named = {"index.json"};
    const auto note = [&](const json& pictures) {
        for (const json& p : pictures) named.insert(p["file"]);
    };
    note(index["base"]);
    for (size_t k = 0; k < data.contributions.size(); ++k) {
        const json& c = index["contributions"][k];
        note(c["pictures"]);
        EXPECT_EQ(c["doors_open"].size(), data.contributions[k].doors_open.size());
        EXPECT_EQ(c["always_on"].get<bool>(), !data.contributions[k].light_set.has_value());
        EXPECT_EQ(c["receivers"], data.contributions[k].receivers);
    }
    std::set<std::string> written;
    uint64_t bytes = 0;
    for (const auto& entry : std::filesystem::directory_iterator(out.path)) {
        written.insert(entry.path().filename());
        bytes += entry.file_size();
    }
    EXPECT_EQ(written, named);
    EXPECT_EQ(stats->files, written.size());
    EXPECT_EQ(stats->bytes, bytes);
}

TEST(Export, TheSamePackGivesTheSameBytes) {
    const auto pack = Pack::fromData(dimmer::test::samplePack());
    const Folder first, second;
    SilentProgress silent;
    ASSERT_TRUE(exportPack(*pack, first.path, silent));
    ASSERT_TRUE(exportPack(*pack, second.path, silent));
    const auto bytesOf = [](const std::filesystem::path& file) {
        std::ifstream in(file, std::ios::binary);
        return std::string(std::istreambuf_iterator<char>(in), {});
    };
    for (const auto& entry : std::filesystem::directory_iterator(first.path))
        EXPECT_EQ(bytesOf(entry.path()), bytesOf(second.path / entry.path().filename())) << entry.path();
}

std::set<std::string> namesIn(const std::filesystem::path& folder) {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) names.insert(entry.path().filename());
    return names;
}

Pack exportPackOf(uint32_t sets) {
    return *Pack::fromData(dimmer::test::randomPack(1, {.sets = sets, .doors = 0}));
}

TEST(Export, AnEarlierExportGoes) {
    SilentProgress silent;
    const Folder used, fresh;
    ASSERT_TRUE(exportPack(exportPackOf(6), used.path, silent));
    ASSERT_TRUE(exportPack(exportPackOf(2), fresh.path, silent));
    ASSERT_GT(namesIn(used.path).size(), namesIn(fresh.path).size());
    used.folder.write("light/notes.exr", "mine", 4);
    ASSERT_TRUE(exportPack(exportPackOf(2), used.path, silent));
    auto expected = namesIn(fresh.path);
    expected.insert("notes.exr");
    EXPECT_EQ(namesIn(used.path), expected);
}

// Which has no index that would name its pictures.
TEST(Export, AnInterruptedExportGoes) {
    SilentProgress silent;
    const Folder used, fresh;
    ASSERT_TRUE(exportPack(exportPackOf(6), used.path, silent));
    std::filesystem::remove(used.path / "index.json");
    ASSERT_TRUE(exportPack(exportPackOf(2), used.path, silent));
    ASSERT_TRUE(exportPack(exportPackOf(2), fresh.path, silent));
    EXPECT_EQ(namesIn(used.path), namesIn(fresh.path));
}

TEST(Export, FilesOfOtherNamesStay) {
    SilentProgress silent;
    const Folder out;
    std::filesystem::create_directory(out.path);
    out.folder.write("base_page_0.exr", "x", 1);  // outside the export's folder
    for (const char* name : {"house.dimmer", "base_page_0.exr.bak", "base_page_00.exr", "contribution_7_page_0.exr"})
        out.folder.write(std::string("light/") + name, "x", 1);
    const auto before = namesIn(out.path);
    ASSERT_TRUE(exportPack(exportPackOf(2), out.path, silent));
    const auto after = namesIn(out.path);
    for (const std::string& name : before) EXPECT_TRUE(after.contains(name)) << name;
    EXPECT_TRUE(std::filesystem::exists(out.folder.path / "base_page_0.exr"));
    EXPECT_EQ(out.index()["version"], 1);
}

// What stops half way is no export: nothing says which of its pictures belong together.
TEST(Export, AnUnfinishedOneHasNoIndex) {
    SilentProgress silent;
    const Folder out;
    ASSERT_TRUE(exportPack(exportPackOf(2), out.path, silent));
    std::filesystem::remove(out.path / "base_page_0.exr");
    std::filesystem::create_directories(out.path / "base_page_0.exr/in the way");
    EXPECT_FALSE(exportPack(exportPackOf(2), out.path, silent));
    EXPECT_FALSE(std::filesystem::exists(out.path / "index.json"));
}

TEST(Export, AFolderThatCannotBeMade) {
    const auto pack = Pack::fromData(dimmer::test::samplePack());
    const test::TemporaryFolder folder;
    folder.write("taken", "x", 1);
    SilentProgress silent;
    const auto stats = exportPack(*pack, folder.path / "taken" / "light", silent);
    ASSERT_FALSE(stats);
    EXPECT_EQ(stats.error().code, ErrorCode::Io);
    EXPECT_THAT(stats.error().message, testing::HasSubstr("taken"));
}

}  // namespace
}  // namespace dimmer::cook
