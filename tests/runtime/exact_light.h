// What the pages must hold, in double and from the definitions alone: L = B + sum of w S, receiver by receiver.
#pragma once

#include <dimmer/light_state.h>
#include <pack/pack_data.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace dimmer::test {

// From the definition of Vulkan's unsigned 11 and 10 bit floats.
inline double ufloatValue(uint32_t code, int mantissa_bits) {
    const int exponent = static_cast<int>(code >> mantissa_bits);
    const double mantissa = std::ldexp(code & ((1u << mantissa_bits) - 1), -mantissa_bits);
    return exponent == 0 ? std::ldexp(mantissa, -14) : std::ldexp(1 + mantissa, exponent - 15);
}

inline std::array<uint32_t, 3> channelCodes(uint32_t irradiance) {
    return {irradiance & 0x7ff, irradiance >> 11 & 0x7ff, irradiance >> 22};
}
inline constexpr std::array<int, 3> channel_mantissa_bits = {6, 6, 5};

inline std::array<double, 3> decoded(uint32_t irradiance) {
    const auto codes = channelCodes(irradiance);
    return {ufloatValue(codes[0], 6), ufloatValue(codes[1], 6), ufloatValue(codes[2], 5)};
}

// One step of the format at a value; below the first normal number there is only 0.
inline double quantum(double value, int mantissa_bits) {
    if (value < 0x1p-14) return 0x1p-14;
    return std::ldexp(1.0, std::ilogb(value) - mantissa_bits);
}

// From the definition of VK_FORMAT_E5B9G9R9_UFLOAT_PACK32: 9 bits a channel, times 2^(exponent - 15 - 9).
inline std::array<double, 3> sharedExponentDecoded(uint32_t irradiance) {
    const int exponent = static_cast<int>(irradiance >> 27) - 24;
    return {std::ldexp(irradiance & 0x1ff, exponent), std::ldexp(irradiance >> 9 & 0x1ff, exponent),
            std::ldexp(irradiance >> 18 & 0x1ff, exponent)};
}

inline std::array<double, 3> decoded(uint32_t irradiance, ColorFormat format) {
    return format == ColorFormat::E5B9G9R9 ? sharedExponentDecoded(irradiance) : decoded(irradiance);
}

// One step of each channel where the light is `exact`; the brightest channel decides for all where they share an
// exponent.
inline std::array<double, 3> quanta(const std::array<double, 3>& exact, ColorFormat format) {
    std::array<double, 3> steps{};
    const double largest = std::max({exact[0], exact[1], exact[2]});
    for (size_t c = 0; c < 3; ++c)
        steps[c] = format == ColorFormat::E5B9G9R9 ? std::max(quantum(largest, 8), 0x1p-24)
                                                   : quantum(exact[c], channel_mantissa_bits[c]);
    return steps;
}

inline size_t texelOf(const PackData& data, uint32_t receiver) {
    const uint32_t address = data.addresses[receiver];
    return (size_t{TexelAddress::page(address)} * data.page_height + TexelAddress::y(address)) * data.page_width +
           TexelAddress::x(address);
}

// Stored irradiance per texel of the pages.
inline std::vector<std::array<double, 3>> exactPages(const PackData& data, const LightState& state) {
    std::vector<std::array<double, 3>> pages;
    for (const TexelRecord& record : data.base_pages) pages.push_back(decoded(record.irradiance, data.color_format));
    for (const Cluster& cluster : data.clusters)
        for (uint32_t t = cluster.first_term; t < cluster.first_term + cluster.term_count; ++t) {
            const Contribution& contribution = data.contributions[data.terms[t].contribution];
            double doors = 1;
            for (uint32_t door : contribution.doors_open) doors *= static_cast<double>(state.open(Door{door}));
            for (uint32_t door : contribution.doors_closed) doors *= 1 - static_cast<double>(state.open(Door{door}));
            const Weight dim = contribution.light_set ? state.weight(LightSet{*contribution.light_set}) : Weight(1);
            const std::array<double, 3> weight = {doors * static_cast<double>(dim.r),
                                                  doors * static_cast<double>(dim.g),
                                                  doors * static_cast<double>(dim.b)};
            for (uint32_t i = 0; i < cluster.receiver_count; ++i) {
                const auto record = decoded(data.payload[data.terms[t].first_record + i].irradiance, data.color_format);
                auto& sum = pages[texelOf(data, cluster.first_receiver + i)];
                for (size_t c = 0; c < 3; ++c) sum[c] += weight[c] * record[c];
            }
        }
    return pages;
}

}  // namespace dimmer::test
