// The HTML report: everything is in it, nothing is fetched, nothing from a file is taken for markup, and the pictures
// show what the pack holds.
#include <format/texel.h>
#include <gmock/gmock.h>
#include <pack/sample_pack.h>
#include <report/page_pictures.h>
#include <report/report.h>
#include <scene/level_file.h>
#include <stb/stb_image.h>
#include <write/png_writer.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <set>

namespace dimmer::cook {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

Pack packOf(PackData data) {
    auto pack = Pack::fromData(std::move(data));
    EXPECT_TRUE(pack) << pack.error().message;
    return *pack;
}

std::string htmlOf(const Pack& pack, const ReportInput& input) {
    const auto html = reportHtml(pack, input);
    EXPECT_TRUE(html) << html.error().message;
    return html.value_or("");
}

std::vector<uint8_t> fromBase64(std::string_view text) {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::vector<uint8_t> bytes;
    uint32_t group = 0, bits = 0;
    for (const char c : text) {
        if (c == '=') break;
        group = group << 6 | static_cast<uint32_t>(digits.find(c));
        bits += 6;
        if (bits >= 8) bytes.push_back(static_cast<uint8_t>(group >> (bits -= 8)));
    }
    return bytes;
}

struct Picture {
    int width = 0, height = 0, channels = 0;
    std::vector<uint8_t> pixels;
};

Picture decoded(const std::string& uri) {
    constexpr std::string_view prefix = "data:image/png;base64,";
    EXPECT_TRUE(uri.starts_with(prefix));
    const auto bytes = fromBase64(std::string_view(uri).substr(prefix.size()));
    Picture p;
    stbi_uc* pixels =
        stbi_load_from_memory(bytes.data(), static_cast<int>(bytes.size()), &p.width, &p.height, &p.channels, 0);
    EXPECT_NE(pixels, nullptr);
    if (pixels) p.pixels.assign(pixels, pixels + p.width * p.height * p.channels);
    stbi_image_free(pixels);
    return p;
}

TEST(Report, Base64OfKnownTexts) {  // RFC 4648, section 10
    const auto of = [](std::string_view text) { return base64(std::as_bytes(std::span(text))); };
    EXPECT_EQ(of(""), "");
    EXPECT_EQ(of("f"), "Zg==");
    EXPECT_EQ(of("fo"), "Zm8=");
    EXPECT_EQ(of("foo"), "Zm9v");
    EXPECT_EQ(of("foobar"), "Zm9vYmFy");
}

TEST(Report, HoldsEverythingAndFetchesNothing) {
    const Pack pack = packOf(dimmer::test::samplePack());
    ReportInput input{.title = "house.dimmer",
                      .file_bytes = 1234567,
                      .seconds = {{"bake", 12.5}, {"charts", 0.5}},
                      .bake_seconds = {{"bounces", 2.25}},
                      .warnings = {"level.gltf: node 'lamp': it is inside a wall"},
                      .verify = {},
                      .heat_maps = {}};
    const std::string html = htmlOf(pack, input);
    EXPECT_THAT(html, AllOf(HasSubstr("<!doctype html>"), HasSubstr("width=device-width"), HasSubstr("house.dimmer"),
                            HasSubstr("1.23 MB"), HasSubstr("12.50 s"), HasSubstr("bake: bounces"), HasSubstr("2.25 s"),
                            HasSubstr("13.00 s in all"), HasSubstr("node &#39;lamp&#39;: it is inside a wall"),
                            HasSubstr("dynamic records")));
    // Bytes read as everywhere else.
    input.file_bytes = 999;
    EXPECT_THAT(htmlOf(pack, input), AllOf(HasSubstr("999 B"), Not(HasSubstr("1.0 kB"))));
    for (const Element& e : pack.elements())
        EXPECT_THAT(html, HasSubstr("region of " + std::string(e.kind == ElementKind::Door ? "door:" : "") + e.name));
    EXPECT_THAT(html, AllOf(Not(HasSubstr("http:")), Not(HasSubstr("https:")), Not(HasSubstr("src=\"//")),
                            Not(HasSubstr("@import")), Not(HasSubstr("<link"))));
    for (size_t at = html.find("src="); at != std::string::npos; at = html.find("src=", at + 1))
        EXPECT_EQ(html.compare(at, 26, "src=\"data:image/png;base64"), 0) << html.substr(at, 40);
    EXPECT_THAT(html, Not(HasSubstr("Error against")));
}

TEST(Report, NamesAreNoMarkup) {
    PackData data = dimmer::test::samplePack();
    data.elements[0].name = "<script>alert(1)</script>";
    data.elements[1].name = "a\" onload='x' & b";
    data.settings_json = R"({"quality": {"value": "<b>", "from": "</table><script>"}})";
    const std::string html =
        htmlOf(packOf(std::move(data)), {.title = "<h1>",
                                         .file_bytes = 0,
                                         .seconds = {{"<i>", 1}},
                                         .warnings = {"</ul><script>"},
                                         .verify = {{"sets", {{{"name", "<img>"}, {"error", 0.1}}}}},
                                         .heat_maps = {}});
    EXPECT_THAT(html, AllOf(Not(HasSubstr("<script>alert")), Not(HasSubstr("</ul><script")), Not(HasSubstr("<b>")),
                            Not(HasSubstr("<img>")), Not(HasSubstr("a\" onload")), Not(HasSubstr("</table><script"))));
    EXPECT_THAT(html, AllOf(HasSubstr("&lt;script&gt;alert(1)"), HasSubstr("a&quot; onload=&#39;x&#39; &amp; b"),
                            HasSubstr("10.00 %")));
}

TEST(Report, BudgetsComeFromThePacksSettings) {
    PackData data = dimmer::test::samplePack();
    data.settings_json = R"({"quality": {"value": "draft", "from": "command line"},
        "budgets.total": {"value": 1000, "from": "console"}, "budgets.dynamic": {"value": 100000000, "from": "console"}})";
    const std::string html = htmlOf(packOf(std::move(data)), {});
    EXPECT_THAT(html, AllOf(HasSubstr("of 1.0 kB"), HasSubstr("of 100.00 MB"), HasSubstr("class=over")));
    EXPECT_THAT(htmlOf(packOf(dimmer::test::samplePack()), {}), Not(HasSubstr("class=over")));
}

// A value that nests is no setting, and following it would exhaust the stack.
TEST(Report, ListsTheSettingsThatAreSome) {
    PackData data = dimmer::test::samplePack();
    data.settings_json = R"({"lightmaps.page_size": {"value": 512, "from": "mine.json"}, "hostile": {"value": )" +
                         std::string(200000, '[') + std::string(200000, ']') + R"(, "from": "x"}, "other": 7})";
    const std::string html = htmlOf(packOf(std::move(data)), {});
    EXPECT_THAT(html, AllOf(HasSubstr("<td>lightmaps.page_size<td>512<td>&quot;mine.json&quot;"),
                            Not(HasSubstr("hostile")), Not(HasSubstr("<td>other"))));
}

// What the figures hold for, and all of them: a state with everything off read as any other.
TEST(Report, SaysWhatVerifyMeasured) {
    const Pack pack = packOf(dimmer::test::samplePack());
    ReportInput input;
    input.verify = nlohmann::json::parse(
        R"({"state": "all=0,a<b=1", "converged": false, "surface": {"mean": 0.01, "p95": 0.02, "bias": 0, "points": 9},
            "grid": {"mean": 0.1692, "p95": 0.59, "bias": null, "points": 40}, "models": {"mean": 0, "points": 0}})");
    EXPECT_THAT(htmlOf(pack, input),
                AllOf(HasSubstr("In the state all=0,a&lt;b=1"), HasSubstr("not converged"),
                      HasSubstr("<td>grid<td>16.92 %<td>59.00 %<td>-"), Not(HasSubstr("<td>models"))));
    input.verify["converged"] = true;
    input.verify["state"] = "";
    EXPECT_THAT(htmlOf(pack, input), AllOf(HasSubstr("All light sets on"), Not(HasSubstr("not converged"))));
    input.verify["state"] = input.verify["grid"] = 7;  // of somebody else
    EXPECT_THAT(htmlOf(pack, input), HasSubstr("<td>grid<td>-"));
}

TEST(Report, VerifyAndItsHeatMaps) {
    const Pack pack = packOf(dimmer::test::samplePack());
    const test::TemporaryFolder folder;
    ReportInput input;
    input.verify = nlohmann::json::parse(
        R"({"surface": {"mean": 0.0123, "p95": 0.05, "bias": -0.01}, "tilted": {"mean": "x"}, "sets": [{"name": "set0", "error": 0.07}],
            "doors": [{"door": "gate<1>", "light": "always on", "error": 0.0911},
            {"door": "leak", "light": "all", "error": 0, "points": 0, "elsewhere": 1}, {"door": "nothing else"}, 7]})");
    input.heat_maps = folder.path;
    const auto missing = reportHtml(pack, input);
    ASSERT_FALSE(missing);
    EXPECT_THAT(missing.error().message, HasSubstr("page_0.png"));
    const auto png = pngBytes(1, 1, 3, std::array<uint8_t, 3>{1, 2, 3});
    for (const char* name : {"page_0.png", "page_1.png"}) folder.write(name, png->data(), png->size());
    const std::string html = htmlOf(pack, input);
    EXPECT_THAT(html, AllOf(HasSubstr("1.23 %"), HasSubstr("-1.00 %"), HasSubstr("7.00 %"), HasSubstr(base64(*png)),
                            HasSubstr("alt=\"error on page 1\""), HasSubstr("gate&lt;1&gt;<td>always on<td>9.11 %"),
                            HasSubstr("leak<td>all<td>-<td>-<td>-<td>100.00 %"), Not(HasSubstr("nothing else"))));
}

using Texel = std::array<uint32_t, 3>;  // page, x, y

TEST(Report, PicturesShowRegionsAndOverlaps) {
    const PackData data = dimmer::test::samplePack();
    const Pack pack = packOf(PackData(data));
    // What the records say, texel by texel.
    std::map<Texel, uint32_t> overlap;
    std::map<uint32_t, std::set<Texel>> regions;
    for (const Cluster& cluster : data.clusters)
        for (uint32_t i = 0; i < cluster.receiver_count; ++i) {
            const uint32_t a = data.addresses[cluster.first_receiver + i];
            const Texel texel = {TexelAddress::page(a), TexelAddress::x(a), TexelAddress::y(a)};
            overlap[texel] = cluster.term_count;
            for (uint32_t t = cluster.first_term; t < cluster.first_term + cluster.term_count; ++t) {
                const Contribution& c = data.contributions[data.terms[t].contribution];
                if (data.payload[data.terms[t].first_record + i].irradiance == 0) continue;  // no light, no region
                if (c.light_set) regions[*c.light_set].insert(texel);
                for (const uint32_t door : c.doors_open) regions[door].insert(texel);
                for (const uint32_t door : c.doors_closed) regions[door].insert(texel);
            }
        }
    const PagePictures draw{1024};
    const auto overlaps = draw.overlap(pack);
    ASSERT_TRUE(overlaps && overlaps->size() == 2);
    int compared = 0;
    for (uint32_t e = 0; e < data.elements.size(); ++e) {
        const auto pictures = draw.region(pack, e);
        ASSERT_TRUE(pictures && pictures->size() == 2);
        for (uint32_t page = 0; page < 2; ++page) {
            const bool anywhere = std::ranges::any_of(regions[e], [&](const Texel& t) { return t[0] == page; });
            ASSERT_EQ((*pictures)[page].empty(), !anywhere);
            if (!anywhere) continue;
            ++compared;
            const Picture region = decoded((*pictures)[page]), map = decoded((*overlaps)[page]);
            ASSERT_EQ(region.width, 32);
            ASSERT_EQ(region.channels, 1);
            ASSERT_EQ(map.channels, 3);
            for (uint32_t y = 0; y < 32; ++y)
                for (uint32_t x = 0; x < 32; ++x) {
                    const bool here = regions[e].contains({page, x, y});
                    EXPECT_EQ(region.pixels[y * 32 + x] >= 64, here);
                    EXPECT_EQ(region.pixels[y * 32 + x] == 0, !here);
                    const auto count = std::min<size_t>(overlap[{page, x, y}], 8);
                    for (size_t c = 0; c < 3; ++c)
                        EXPECT_EQ(map.pixels[(y * 32 + x) * 3 + c], overlap_colours[count][c]);
                }
        }
    }
    EXPECT_GT(compared, 4);
}

TEST(Report, LargePagesAreThinnedOut) {
    const Pack pack = packOf(dimmer::test::samplePack());
    const auto whole = PagePictures{32}.light(pack), thin = PagePictures{10}.light(pack);
    ASSERT_TRUE(whole && thin);
    const Picture large = decoded((*whole)[1]), small = decoded((*thin)[1]);
    ASSERT_EQ(small.width, 8);  // every fourth
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 24; ++x)
            EXPECT_EQ(small.pixels[static_cast<size_t>(y * 24 + x)],
                      large.pixels[static_cast<size_t>(4 * y * 96 + 4 * (x / 3) * 3 + x % 3)]);
}

}  // namespace
}  // namespace dimmer::cook
