#include <dimmer/light_state.h>
#include <format/texel.h>
#include <gtest/gtest.h>

#include "random_pack.h"

#include <limits>

namespace dimmer {
namespace {

// From the definition of Vulkan's unsigned 11 and 10 bit floats.
double ufloatValue(uint32_t code, int mantissa_bits) {
    const int exponent = static_cast<int>(code >> mantissa_bits);
    const double mantissa = std::ldexp(code & ((1u << mantissa_bits) - 1), -mantissa_bits);
    return exponent == 0 ? std::ldexp(mantissa, -14) : std::ldexp(1 + mantissa, exponent - 15);
}

// The nearest of 0 and all normal codes, ties to the even one, as an encoder without denormal numbers sees it: below
// 2^-14 the steps go on as in the binade underneath, and what rounds to less than 2^-14 is 0.
uint32_t nearestCode(double value, int mantissa_bits) {
    const uint32_t first = 1u << mantissa_bits, codes = 31u << mantissa_bits;
    if (value < std::ldexp(1 - std::ldexp(0.25, -mantissa_bits), -14)) return 0;
    uint32_t best = first;
    for (uint32_t code = first + 1; code < codes; ++code) {
        const double distance = std::abs(ufloatValue(code, mantissa_bits) - value);
        const double best_distance = std::abs(ufloatValue(best, mantissa_bits) - value);
        if (distance < best_distance || (distance == best_distance && code % 2 == 0)) best = code;
    }
    return best;
}

template <int bits>
void everyNormalCodeSurvives() {
    for (uint32_t code = 0; code < (31u << bits); ++code) {
        ASSERT_EQ(decodeUfloat<bits>(code), ufloatValue(code, bits)) << code;
        ASSERT_EQ(encodeUfloat<bits>(decodeUfloat<bits>(code)), code < (1u << bits) ? 0 : code);
    }
}

template <int bits>
void roundsToTheNearestCode(uint32_t seed) {
    test::Random random(seed);
    for (int i = 0; i < 3000; ++i) {
        const auto value = std::pow(2.0f, test::uniform(random, -16, 18));
        ASSERT_EQ(encodeUfloat<bits>(value), nearestCode(value, bits)) << value;
    }
    // Ties, and their neighbours on both sides.
    for (uint32_t code = 1u << bits; code + 1 < (31u << bits); ++code) {
        const auto middle = static_cast<float>((ufloatValue(code, bits) + ufloatValue(code + 1, bits)) / 2);
        ASSERT_EQ(encodeUfloat<bits>(middle), code + code % 2) << middle;
        ASSERT_EQ(encodeUfloat<bits>(std::nextafter(middle, 0.0f)), code) << middle;
        ASSERT_EQ(encodeUfloat<bits>(std::nextafter(middle, 1e9f)), code + 1) << middle;
    }
}

TEST(Ufloat, EveryNormalCodeSurvivesDecodingAndEncoding) {
    everyNormalCodeSurvives<6>();
    everyNormalCodeSurvives<5>();
}

TEST(Ufloat, RoundsToTheNearestCodeTiesToEven) {
    roundsToTheNearestCode<6>(1);
    roundsToTheNearestCode<5>(2);
}

TEST(Ufloat, WhatIsNoLightBecomesBlackAndTooMuchBecomesTheLargest) {
    const float infinity = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
    for (float dark : {0.0f, -0.0f, -1.0f, -infinity, nan, -nan, 1e-30f, std::numeric_limits<float>::denorm_min()}) {
        EXPECT_EQ(encodeUfloat<6>(dark), 0u) << dark;
        EXPECT_EQ(encodeUfloat<5>(dark), 0u) << dark;
    }
    for (float bright : {65536.0f, 1e30f, std::numeric_limits<float>::max(), infinity}) {
        EXPECT_EQ(ufloatValue(encodeUfloat<6>(bright), 6), 65024) << bright;
        EXPECT_EQ(ufloatValue(encodeUfloat<5>(bright), 5), 64512) << bright;
    }
}

TEST(Ufloat, ACanonicalCodeHasNoInfinityNanOrDenormalAndIsOtherwiseAsItWas) {
    test::Random random(3);
    const auto expected = [](uint32_t c, uint32_t first, uint32_t largest) {  // codes ascend with value
        return c < first ? 0 : std::min(c, largest);
    };
    for (int i = 0; i < 100000; ++i) {
        const auto code = static_cast<uint32_t>(random());
        ASSERT_EQ(canonicalR11G11B10(code), expected(code & 0x7ff, 64, 0x7bf) |
                                                expected(code >> 11 & 0x7ff, 64, 0x7bf) << 11 |
                                                expected(code >> 22, 32, 0x3df) << 22)
            << code;
    }
}

// From the definition of Vulkan's shared exponent format.
std::array<double, 3> sharedExponentValue(uint32_t code) {
    const int exponent = static_cast<int>(code >> 27) - 15 - 9;
    return {std::ldexp(code & 0x1ff, exponent), std::ldexp(code >> 9 & 0x1ff, exponent),
            std::ldexp(code >> 18 & 0x1ff, exponent)};
}

// The step of the smallest exponent that holds `largest` once it is rounded.
double sharedStep(double largest) {
    int exponent = 0;
    while (exponent < 31 && std::floor(std::ldexp(largest, 24 - exponent) + 0.5) > 511) ++exponent;
    return std::ldexp(1.0, exponent - 24);
}

TEST(SharedExponent, CodesDecodeByDefinitionAndComeBack) {
    test::Random random(11);
    for (int i = 0; i < 200000; ++i) {
        const auto code = static_cast<uint32_t>(random());
        const auto expected = sharedExponentValue(code);
        const auto [r, g, b] = decodeE5B9G9R9(code);
        ASSERT_EQ((std::array<double, 3>{r, g, b}), expected) << std::hex << code;
        // Another code may stand for the same number, with a smaller exponent.
        ASSERT_EQ(sharedExponentValue(encodeE5B9G9R9(r, g, b)), expected) << std::hex << code;
    }
}

TEST(SharedExponent, ACanonicalCodeIsTheOneThatTheEncoderWouldWrite) {
    test::Random random(12);
    for (int i = 0; i < 200000; ++i) {
        // Of small mantissas, which other codes stand for as well.
        const uint32_t mask = 0x1ffu >> test::pick(random, 0, 9), mantissas = mask | mask << 9 | mask << 18;
        const auto code = static_cast<uint32_t>(random()) & (mantissas | 31u << 27);
        const auto [r, g, b] = decodeE5B9G9R9(code);
        ASSERT_EQ(canonicalE5B9G9R9(code), encodeE5B9G9R9(r, g, b)) << std::hex << code;
    }
}

TEST(SharedExponent, RoundsEachChannelToTheNearestStepOfTheLargest) {
    test::Random random(12);
    for (int i = 0; i < 100000; ++i) {
        const double top = std::pow(2.0, test::uniform(random, -26, 15.99f));
        std::array<float, 3> v{};
        for (float& c : v) c = static_cast<float>(top) * test::uniform(random, 0, 1);
        // Near where the mantissa rounds up to the next exponent, too.
        if (i % 3 == 0)
            v[i % 2] = std::exp2(std::ceil(std::log2(static_cast<float>(top)))) * test::uniform(random, 0.996f, 1);
        for (float& c : v) c = std::min(c, e5b9g9r9_largest);
        const double step = sharedStep(static_cast<double>(std::max({v[0], v[1], v[2]})));
        const auto stored = sharedExponentValue(encodeE5B9G9R9(v[0], v[1], v[2]));
        // 1e-6 of 512 steps: the float that the half is added to.
        for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(stored[c], static_cast<double>(v[c]), step * 0.5001) << v[0] << " " << v[1] << " " << v[2];
    }
}

TEST(SharedExponent, WhatIsNoLightBecomesBlackAndTooMuchBecomesTheLargest) {
    const float infinity = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
    for (float dark : {0.0f, -0.0f, -1.0f, -infinity, nan, -nan, 1e-30f, std::numeric_limits<float>::denorm_min()})
        EXPECT_EQ(sharedExponentValue(encodeE5B9G9R9(dark, dark, dark)), (std::array<double, 3>{})) << dark;
    for (float bright : {65408.0f, 65536.0f, 1e30f, std::numeric_limits<float>::max(), infinity})
        EXPECT_EQ(sharedExponentValue(encodeE5B9G9R9(0, bright, nan)), (std::array<double, 3>{0, 65408, 0})) << bright;
}

// In double, from the definition.
struct Direction {
    double r, bx, by;
};

Direction directionOf(uint32_t code) {
    const auto moment = [](uint32_t c) { return (static_cast<double>(c) - 512) * 5 / 256; };
    return {(code & 0x3ff) / 1023.0, moment(code >> 10 & 0x3ff), moment(code >> 20 & 0x3ff)};
}

TEST(Direction, EveryLobeComesBackWithinHalfAStep) {
    constexpr float z_min = 0.1f;  // closer to the surface, b would outgrow its 10 bits
    test::Random random(7);
    for (int i = 0; i < 100000; ++i) {
        // r and a unit d at least z_min off the surface; b = (1-r) d_xy / d_z.
        const double r = test::uniform(random, 0, 1), z = test::uniform(random, z_min, 1);
        const double angle = test::uniform(random, 0, 6.2831853f), across = std::sqrt(1 - z * z) / z * (1 - r);
        const double bx = across * std::cos(angle), by = across * std::sin(angle);
        const double l = std::exp2(test::uniform(random, -10, 10));
        const auto code = encodeDirection(static_cast<float>(l), static_cast<float>(l * r), static_cast<float>(l * bx),
                                          static_cast<float>(l * by));
        const Direction d = directionOf(code);
        // 1e-5 for the floats, whose 6e-8 are of values up to 10.
        ASSERT_NEAR(d.r, r, 0.5 / 1023 + 1e-5);
        ASSERT_NEAR(d.bx, bx, 2.5 / 256 + 1e-5);
        ASSERT_NEAR(d.by, by, 2.5 / 256 + 1e-5);
        const Highlight decoded = decodeDirection(code);
        ASSERT_NEAR(decoded.ambient, d.r, 1e-6);
        ASSERT_NEAR(decoded.bx, d.bx, 1e-6);
        ASSERT_NEAR(decoded.by, d.by, 1e-6);
    }
    EXPECT_EQ(encodeDirection(0, 0, 0, 0), direction_none);
    EXPECT_EQ(encodeDirection(1, 1, 0, 0), direction_none);
}

constexpr float lift = weightScale(ColorFormat::R11G11B10F);

std::array<double, 3> r11g11b10Value(uint32_t code) {
    return {ufloatValue(code & 0x7ff, 6), ufloatValue(code >> 11 & 0x7ff, 6), ufloatValue(code >> 22, 5)};
}

struct Sum {
    double e[3] = {}, l = 0, ambient = 0, bx = 0, by = 0;

    void add(TexelRecord record, Weight w) { add(r11g11b10Value(record.irradiance), record, w); }
    void add(const std::array<double, 3>& value, TexelRecord record, Weight w) {
        const double c[3] = {w.r * value[0], w.g * value[1], w.b * value[2]};
        const double cl = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
        const Direction d = directionOf(record.direction);
        for (int i = 0; i < 3; ++i) e[i] += c[i];
        l += cl;
        ambient += cl * d.r;
        bx += cl * d.bx;
        by += cl * d.by;
    }
};

// Half a step of the format, and what 13 additions in 32-bit floats may lose. Below 2^-14 there is only 0.
void expectWithinHalfAStep(uint32_t code, int mantissa_bits, double exact) {
    if (exact < 0x1p-14) {
        EXPECT_LE(ufloatValue(code, mantissa_bits), 0x1p-14);
        return;
    }
    const double step = std::ldexp(1.0, std::max(std::ilogb(std::max(exact, 1e-9)), -14) - mantissa_bits);
    EXPECT_NEAR(ufloatValue(code, mantissa_bits), exact, step / 2 + exact * 2e-6);
}

TEST(TexelBlend, IsWithinHalfAQuantumOfTheSumInDouble) {
    test::Random random(4);
    for (int round = 0; round < 20000; ++round) {
        TexelBlend blend;
        Sum exact;
        for (uint32_t terms = test::pick(random, 1, 13); terms > 0; --terms) {
            const TexelRecord record = test::randomRecord(random, 1.0f / 64);
            const float scalar = test::uniform(random, 0, 2);
            const Weight w = round % 2 ? Weight(scalar) : Weight(scalar, test::uniform(random, 0, 2), 0);
            blend.add(record, w.r * lift, w.g * lift, w.b * lift);
            exact.add(record, w);
        }
        const TexelRecord result = blend.encode();
        expectWithinHalfAStep(result.irradiance & 0x7ff, 6, exact.e[0]);
        expectWithinHalfAStep(result.irradiance >> 11 & 0x7ff, 6, exact.e[1]);
        expectWithinHalfAStep(result.irradiance >> 22, 5, exact.e[2]);
        if (exact.l < 1e-5) continue;  // black: no direction to compare
        // 0.02 of a step for the floats, whose 13 roundings of 6e-8 are of codes up to 1023.
        EXPECT_NEAR(result.direction & 0x3ff, exact.ambient / exact.l * 1023, 0.52);
        EXPECT_NEAR(result.direction >> 10 & 0x3ff, 512 + exact.bx / exact.l * 256 / 5, 0.52);
        EXPECT_NEAR(result.direction >> 20 & 0x3ff, 512 + exact.by / exact.l * 256 / 5, 0.52);
        EXPECT_EQ(result.direction >> 30, 0u);
        if (HasFailure()) FAIL() << "in round " << round;
    }
}

TEST(TexelBlend, OfSharedExponentsIsWithinHalfAQuantumOfTheSumInDouble) {
    constexpr float scale = weightScale(ColorFormat::E5B9G9R9);
    test::Random random(13);
    for (int round = 0; round < 20000; ++round) {
        TexelBlend<ColorFormat::E5B9G9R9> blend;
        Sum exact;
        for (uint32_t terms = test::pick(random, 1, 13); terms > 0; --terms) {
            const TexelRecord record{test::randomSharedExponent(random), test::randomDirection(random)};
            const float scalar = test::uniform(random, 0, 2);
            const Weight w = round % 2 ? Weight(scalar) : Weight(scalar, test::uniform(random, 0, 2), 0);
            blend.add(record, w.r * scale, w.g * scale, w.b * scale);
            exact.add(sharedExponentValue(record.irradiance), record, w);
        }
        const TexelRecord result = blend.encode();
        const double largest = std::max({exact.e[0], exact.e[1], exact.e[2]});
        const auto stored = sharedExponentValue(result.irradiance);
        // Half a step, and what 13 additions in 32-bit floats may lose: 2e-6 of 512 steps.
        for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(stored[c], exact.e[c], sharedStep(largest) * 0.502) << "round " << round;
        if (exact.l < 1e-5) continue;  // black: no direction to compare
        EXPECT_NEAR(result.direction & 0x3ff, exact.ambient / exact.l * 1023, 0.52);
        EXPECT_NEAR(result.direction >> 10 & 0x3ff, 512 + exact.bx / exact.l * 256 / 5, 0.52);
        EXPECT_NEAR(result.direction >> 20 & 0x3ff, 512 + exact.by / exact.l * 256 / 5, 0.52);
        if (HasFailure()) FAIL() << "in round " << round;
    }
}

TEST(TexelBlend, OneRecordAtFullWeightKeepsItsIrradianceAndItsDirection) {
    test::Random random(5);
    for (int i = 0; i < 50000; ++i) {
        const uint32_t light = test::randomIrradiance(random, 1.0f / 64);
        const TexelRecord record{light == 0 ? 64u : light, test::randomDirection(random)};
        TexelBlend blend;
        blend.add(record, lift, lift, lift);
        ASSERT_EQ(blend.encode(), record) << std::hex << record.irradiance << " " << record.direction;
    }
}

TEST(TexelBlend, HostileRecordsAndWeightsGiveCanonicalCodes) {
    test::Random random(6);
    for (int round = 0; round < 100000; ++round) {
        TexelBlend blend;
        TexelBlend<ColorFormat::E5B9G9R9> shared;
        for (uint32_t terms = test::pick(random, 1, 40); terms > 0; --terms) {
            // Up to 2^27, more than max_weight_limit, and down to where the product with the scale is a denormal
            // number.
            const float w = std::exp2(test::uniform(random, -149, 127));
            const TexelRecord record{static_cast<uint32_t>(random()), static_cast<uint32_t>(random())};
            blend.add(record, w, w, w);
            shared.add(record, w, w, w);
        }
        ASSERT_EQ(shared.encode().direction >> 30, 0u);
        const TexelRecord result = blend.encode();
        ASSERT_EQ(canonicalR11G11B10(result.irradiance), result.irradiance);
        ASSERT_EQ(result.direction >> 30, 0u);
    }
}

}  // namespace
}  // namespace dimmer
