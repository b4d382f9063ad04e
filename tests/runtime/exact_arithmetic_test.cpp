// What lets a GPU of any make agree with the CPU to the bit.
#include <format/reciprocal.h>
#include <gtest/gtest.h>
#include <spirv/blend_probes_comp.h>
#include <spirv/blend_probes_comp_storage.h>
#include <spirv/blend_texels_comp.h>
#include <spirv/blend_texels_comp_storage.h>
#include <spirv/gather_texels_comp.h>
#include <spirv/gather_texels_comp_storage.h>
#include <spirv/resample_probes_comp.h>
#include <spirv/resample_probes_comp_storage.h>
#include <spirv/sample_lightmap_comp.h>
#include <spirv/scatter_texels_comp.h>
#include <spirv/scatter_texels_comp_storage.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <set>
#include <span>

namespace dimmer {
namespace {

// SPIR-V 1.5, sections 2.3 and 3.42: a header of 5 words, then instructions whose first word is length and opcode. Of
// what Vulkan 1.2 rounds only nearly ("Precision and Operation of SPIR-V Instructions") kernels could ask for division,
// remainders, sums of products in an order of the device's own, and functions of GLSL.std.450, of which min, max and
// the like are exact.
size_t inexactInstructions(std::span<const uint32_t> words) {
    constexpr uint32_t op_ext_inst = 12, op_f_div = 136, op_f_rem = 140, op_f_mod = 141;
    constexpr uint32_t vector_times_matrix = 144, dot = 148;
    constexpr uint32_t radians = 11, pack = 54, length = 66, refract = 72;  // GLSL.std.450
    size_t count = 0;
    for (size_t at = 5; at < words.size(); at += std::max(words[at] >> 16, 1u)) {
        const uint32_t op = words[at] & 0xffff;
        if (op == op_f_div || op == op_f_rem || op == op_f_mod) ++count;
        if (op >= vector_times_matrix && op <= dot) ++count;
        if (op != op_ext_inst) continue;
        const uint32_t function = words[at + 4];
        const bool min_max_clamp = function >= 37 && function <= 45;
        const bool geometric = function >= length && function <= refract;
        if (geometric || (function >= radians && function < pack && !min_max_clamp)) ++count;
    }
    return count;
}

// Sums, differences and products that a device may join into one operation, of one rounding: those without the
// decoration NoContraction, GLSL's `precise`.
size_t contractibleInstructions(std::span<const uint32_t> words) {
    constexpr uint32_t op_decorate = 71, no_contraction = 42;
    constexpr uint32_t f_add = 129, f_sub = 131, f_mul = 133, vector_times_scalar = 142;
    std::set<uint32_t> precise, results;
    for (size_t at = 5; at < words.size(); at += std::max(words[at] >> 16, 1u)) {
        const uint32_t op = words[at] & 0xffff;
        if (op == op_decorate && words[at + 2] == no_contraction) precise.insert(words[at + 1]);
        if (op == f_add || op == f_sub || op == f_mul || op == vector_times_scalar) results.insert(words[at + 2]);
    }
    EXPECT_FALSE(results.empty());
    return static_cast<size_t>(std::ranges::count_if(results, [&](uint32_t id) { return !precise.contains(id); }));
}

TEST(ExactArithmetic, KernelsLetNoDeviceJoinProductsAndSums) {
    EXPECT_EQ(contractibleInstructions(spirv::blend_texels_comp), 0u);
    EXPECT_EQ(contractibleInstructions(spirv::blend_texels_comp_storage), 0u);
    EXPECT_EQ(contractibleInstructions(spirv::blend_probes_comp), 0u);
    EXPECT_EQ(contractibleInstructions(spirv::blend_probes_comp_storage), 0u);
    EXPECT_EQ(contractibleInstructions(spirv::resample_probes_comp), 0u);
    EXPECT_EQ(contractibleInstructions(spirv::resample_probes_comp_storage), 0u);
    EXPECT_EQ(contractibleInstructions(spirv::gather_texels_comp), 0u);
    EXPECT_EQ(contractibleInstructions(spirv::gather_texels_comp_storage), 0u);
    EXPECT_EQ(contractibleInstructions(spirv::scatter_texels_comp), 0u);
    EXPECT_EQ(contractibleInstructions(spirv::scatter_texels_comp_storage), 0u);
    EXPECT_GT(contractibleInstructions(spirv::sample_lightmap_comp), 0u)
        << "which agrees with the CPU but for rounding";
}

TEST(ExactArithmetic, KernelsAskForNothingThatDevicesRoundInTheirOwnWay) {
    EXPECT_EQ(inexactInstructions(spirv::blend_texels_comp), 0u);
    EXPECT_EQ(inexactInstructions(spirv::blend_texels_comp_storage), 0u);
    EXPECT_EQ(inexactInstructions(spirv::blend_probes_comp), 0u);
    EXPECT_EQ(inexactInstructions(spirv::blend_probes_comp_storage), 0u);
    EXPECT_EQ(inexactInstructions(spirv::resample_probes_comp), 0u);
    EXPECT_EQ(inexactInstructions(spirv::resample_probes_comp_storage), 0u);
    EXPECT_EQ(inexactInstructions(spirv::gather_texels_comp), 0u);
    EXPECT_EQ(inexactInstructions(spirv::gather_texels_comp_storage), 0u);
    EXPECT_EQ(inexactInstructions(spirv::scatter_texels_comp), 0u);
    EXPECT_EQ(inexactInstructions(spirv::scatter_texels_comp_storage), 0u);
    EXPECT_GT(inexactInstructions(spirv::sample_lightmap_comp), 0u) << "which takes roots";
}

TEST(ExactArithmetic, ReciprocalsAreRightOverTheirRange) {
    // Three squarings leave 4e-11 of the guess's 5 %. The product, beside 1, is rounded by 2^-25, and the last sum by
    // 2^-24 of it at most: together 9e-8.
    for (int exponent = -120; exponent <= 120; exponent += 5)
        for (uint32_t k = 0; k < (1u << 23); k += 1009) {
            const float x = std::ldexp(std::bit_cast<float>(0x3f800000u + k), exponent);
            for (const float signed_x : {x, -x})
                ASSERT_NEAR(static_cast<double>(reciprocal(signed_x)) * static_cast<double>(signed_x), 1, 1e-7)
                    << signed_x;
        }
    for (int exponent = -120; exponent <= 120; ++exponent)
        EXPECT_EQ(reciprocal(std::ldexp(1.0f, exponent)), std::ldexp(1.0f, -exponent)) << exponent;
}

}  // namespace
}  // namespace dimmer
