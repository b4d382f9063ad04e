// Light that is known everywhere, as means over texels, sharpened and looked up as a sampler does.
#include <bake/baked_scene.h>
#include <bake/sharpen.h>
#include <bake/test_scenes.h>
#include <pack/pack_data.h>

#include <cmath>
#include <random>

namespace dimmer::cook::test {
namespace {

constexpr double texel_m = 0.25;  // of BakedScene

ReceiverLight lightOf(double lux, float deviation) {
    ReceiverLight l;
    l.light.irradiance_lux = glm::vec3(static_cast<float>(lux));
    l.light.tilted_lux = glm::vec4(static_cast<float>(lux));
    l.variance = deviation * deviation;
    return l;
}

// luxAt(receiver) before; per receiver, after. A receiver of NaN has no light.
std::vector<double> sharpened(const BakedScene& b, float deviation, auto&& luxAt) {
    const auto fill = [&](size_t begin, size_t end, auto emit) {
        for (size_t i = begin; i < end; ++i) {
            const ReceiverLight l = lightOf(luxAt(i), deviation);
            emit(std::span<const ReceiverLight>(&l, std::isnan(l.light.irradiance_lux.x) ? 0 : 1));
        }
    };
    SilentProgress quiet;
    const auto light = sharpen({b.charts, b.texels}, Sparse<ReceiverLight>::build(b.texels.size(), fill), quiet);
    std::vector<double> lux;
    for (size_t i = 0; i < light.rows(); ++i) {
        const auto row = light.row(i);
        lux.push_back(row.empty() ? NAN : static_cast<double>(row[0].light.irradiance_lux.x));
        if (!row.empty()) {
            EXPECT_GE(row[0].light.tilted_lux.x, 0);
        }
    }
    return lux;
}

// A sampler's: pages filled from the texels, padding from its sources, four texels mixed. `place`: in texels.
double lookUp(const BakedScene& b, const std::vector<double>& lux, glm::dvec2 place) {
    const auto shown = [&](uint32_t x, uint32_t y) {
        for (size_t i = 0; i < b.texels.size(); ++i)
            if (b.texels.address[i] == TexelAddress::pack(0, x, y)) return lux[i];
        for (const FillTexel& fill : b.texels.fills)
            if (fill.address == TexelAddress::pack(0, x, y)) return lux[fill.source];
        ADD_FAILURE() << "nothing at " << x << " " << y;
        return 0.0;
    };
    const double x = std::floor(place.x - 0.5), y = std::floor(place.y - 0.5);
    const double u = place.x - 0.5 - x, v = place.y - 0.5 - y;
    const auto row = [&](double at) {
        const auto first = static_cast<uint32_t>(x), line = static_cast<uint32_t>(at);
        return (1 - u) * shown(first, line) + u * shown(first + 1, line);
    };
    return (1 - v) * row(y) + v * row(y + 1);
}

struct Miss {
    double mean = 0, mean_size = 0;
};

// Of what is looked up at random places of the floor, those that counts(place) asks for, against f(place).
Miss missOf(const BakedScene& b, const std::vector<double>& lux, auto&& counts, auto&& f) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> unit(0, 1);
    constexpr int count = 2000;
    Miss miss;
    for (int i = 0; i < count;) {
        const auto face = static_cast<uint32_t>(random() % b.charts.faces.size());
        const float root = std::sqrt(unit(random)), v = unit(random);
        const glm::dvec3 p(b.rays->pointOn(b.charts.faces[face].triangle, root * (1 - v), root * v));
        if (!counts(p)) continue;
        const auto& t = b.charts.uv_texels[face];
        const glm::dvec2 at(t[0] + root * (1 - v) * (t[1] - t[0]) + root * v * (t[2] - t[0]));
        const double off = lookUp(b, lux, at) - f(p);
        miss.mean += off / count;
        miss.mean_size += std::abs(off) / count;
        ++i;
    }
    return miss;
}

// Of a texel, on the plane of its face.
glm::dvec3 centreOf(const BakedScene& b, size_t receiver) {
    const uint32_t face = b.texels.face(receiver), triangle = b.charts.faces[face].triangle;
    const glm::dvec2 at(TexelAddress::x(b.texels.address[receiver]) + 0.5,
                        TexelAddress::y(b.texels.address[receiver]) + 0.5);
    const auto& t = b.charts.uv_texels[face];
    const glm::dmat2 edges(t[1] - t[0], t[2] - t[0]);
    const glm::dvec2 weights = glm::inverse(edges) * (at - glm::dvec2(t[0]));
    return b.rays->pointOn(triangle, static_cast<float>(weights.x), static_cast<float>(weights.y));
}

BakedScene floorOf(float half_m, uint32_t points = 8) {
    Scene scene;
    addFloor(scene, half_m, addMaterial(scene, lambert(0.5f)));
    return BakedScene(scene, 4, points);
}

// f = 10 + x^2 + z^2. Over a texel of h the mean is h^2 / 6 above the middle, and straight lines between texels run
// another h^2 / 3 above the curve: together h^2 / 2, which is gone once sharpened. 15 % of that: a texel's 8 points
// have moments of their own.
TEST(Sharpen, LightOfTheSecondDegreeIsRightInTheMean) {
    const BakedScene b = floorOf(2);
    const auto f = [](glm::dvec3 p) { return 10 + p.x * p.x + p.z * p.z; };
    std::vector<double> means;
    for (size_t i = 0; i < b.texels.size(); ++i) means.push_back(b.mean(i, f));
    const auto after = sharpened(b, 0, [&](size_t i) { return means[i]; });
    const double blur = texel_m * texel_m / 2;
    const auto inside = [](glm::dvec3 p) { return std::abs(p.x) < 1.5 && std::abs(p.z) < 1.5; };
    const Miss before = missOf(b, means, inside, f), now = missOf(b, after, inside, f);
    EXPECT_NEAR(before.mean, blur, 0.15 * blur);
    EXPECT_NEAR(now.mean, 0, 0.15 * blur);
    EXPECT_LT(now.mean_size, 0.5 * before.mean_size);
}

// A slanted edge leaves strips and corners of texels, whose means lie up to half a texel from where they are looked up.
// A step takes off what they miss of it by their own share in what they show, about half.
TEST(Sharpen, TexelsThatAnEdgeCutsOffAreCarriedOn) {
    Scene scene;
    addQuad(scene, "floor", {0, 0, 0}, {0, 0, 2}, {2, 0, 0.7f}, addMaterial(scene, lambert(0.5f)));
    const BakedScene b(scene, 4, 8);
    const auto f = [](glm::dvec3 p) { return 10 + p.x + p.z; };
    std::vector<double> means;
    for (size_t i = 0; i < b.texels.size(); ++i) means.push_back(b.mean(i, f));
    const auto after = sharpened(b, 0, [&](size_t i) { return means[i]; });
    const float whole_m2 = b.charts.texel_area_m2[0];
    double before_off = 0, now_off = 0;
    int cut_off = 0;
    for (size_t i = 0; i < b.texels.size(); ++i) {
        if (b.texels.area_m2[i] > 0.3f * whole_m2) continue;
        const double middle = f(centreOf(b, i));
        before_off += std::abs(means[i] - middle);
        now_off += std::abs(after[i] - middle);
        ++cut_off;
    }
    EXPECT_GT(cut_off, 5);
    EXPECT_GT(before_off / cut_off, 0.05 * texel_m);
    EXPECT_LT(now_off, 0.6 * before_off);
}

// Differences as large as their noise say nothing: nothing moves.
TEST(Sharpen, StepsThatNoiseExplainsAreLeftOut) {
    const BakedScene b = floorOf(2);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> lux(9, 11);
    std::vector<double> means;
    for (size_t i = 0; i < b.texels.size(); ++i) means.push_back(lux(random));
    const auto noisy = sharpened(b, 10, [&](size_t i) { return means[i]; });
    const auto sure = sharpened(b, 0, [&](size_t i) { return means[i]; });
    double moved = 0;
    for (size_t i = 0; i < b.texels.size(); ++i) {
        EXPECT_FLOAT_EQ(static_cast<float>(noisy[i]), static_cast<float>(means[i]));
        moved = std::max(moved, std::abs(sure[i] - means[i]));
    }
    EXPECT_GT(moved, 0.1);
}

// One bright texel: those around it lose no more than half, and those beyond, or beside one without light, nothing.
TEST(Sharpen, NoTexelGoesDarkBesideABrightOne) {
    const BakedScene b = floorOf(2);
    const auto steps = [&](size_t i, size_t j) {
        const auto away = [](uint32_t p, uint32_t q) { return p > q ? p - q : q - p; };
        const uint32_t p = b.texels.address[i], q = b.texels.address[j];
        return std::max(away(TexelAddress::x(p), TexelAddress::x(q)), away(TexelAddress::y(p), TexelAddress::y(q)));
    };
    const size_t bright =
        b.texels.receiver_at[(b.charts.charts[0].y + 8) * b.charts.page_width + b.charts.charts[0].x + 8];
    const auto after = sharpened(b, 0, [&](size_t i) { return i == bright ? 1000 : 1; });
    for (size_t i = 0; i < b.texels.size(); ++i) {
        if (i == bright)
            EXPECT_GT(after[i], 1000);
        else if (steps(i, bright) == 1)
            EXPECT_FLOAT_EQ(static_cast<float>(after[i]), 0.5f);
        else
            EXPECT_FLOAT_EQ(static_cast<float>(after[i]), 1);
    }
    const auto lone = sharpened(b, 0, [&](size_t i) { return i == bright ? 1000 : NAN; });
    EXPECT_EQ(lone[bright], 1000);
}

// A floor of 500,000 texels (and its back) in two meshes, 2,000 blocks of rows: over the seam between them texels of
// one show those of the other, which are replaced long before. In place they become what they become when nothing is
// replaced before the end.
TEST(Sharpen, InPlaceWhatIsReadOverASeamIsAsItWas) {
    Scene scene;
    const uint32_t paint = addMaterial(scene, lambert(0.5f));
    addQuad(scene, "first", {0, 0, 0}, {0, 0, 64}, {64, 0, 0}, paint);
    addQuad(scene, "second", {0, 0, 64}, {0, 0, 64}, {64, 0, 0}, paint);
    const BakedScene b(scene, 4, 2);
    ASSERT_GT(b.texels.size(), size_t{2} * 256 * rows_per_block - 1);
    const BilinearTaps taps(b.charts, b.texels);
    size_t far = 0;
    std::vector<Tap> around;
    for (size_t i = 0; i < b.texels.size(); ++i) {
        taps.around(static_cast<uint32_t>(i), around);
        for (const Tap& tap : around) far += i / rows_per_block > tap.receiver / rows_per_block + 256;
    }
    ASSERT_GT(far, 100u);
    const auto after = [&](uint32_t near_blocks) {
        const auto fill = [&](size_t begin, size_t end, auto emit) {
            for (size_t i = begin; i < end; ++i) {
                const ReceiverLight l = lightOf(1 + unitFloat(hash(7, static_cast<uint32_t>(i))), 0.1f);
                emit(std::span<const ReceiverLight>(&l, 1));
            }
        };
        SilentProgress quiet;
        return sharpen(taps, Sparse<ReceiverLight>::build(b.texels.size(), fill), quiet, near_blocks);
    };
    const auto at_once = after(1u << 20), in_place = after(256), least = after(0);
    size_t moved = 0;
    for (size_t i = 0; i < b.texels.size(); ++i) {
        const float lux = at_once.row(i)[0].light.irradiance_lux.x;
        moved += lux != 1 + unitFloat(hash(7, static_cast<uint32_t>(i)));
        ASSERT_EQ(in_place.row(i)[0].light.irradiance_lux.x, lux) << i;
        ASSERT_EQ(least.row(i)[0].light.irradiance_lux.x, lux) << i;
    }
    EXPECT_GT(moved, b.texels.size() / 2);
}

}  // namespace
}  // namespace dimmer::cook::test
