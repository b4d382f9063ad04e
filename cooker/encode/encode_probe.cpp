#include <encode/encode_probe.h>

#include <format/probe.h>
#include <probes/spherical_harmonics.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

namespace dimmer::cook {
namespace {

// What rounding to 1/127 may take below 0 again, a little more of the mean takes back.
constexpr float retreat = 0.97f;
constexpr int retreats_max = 64;
constexpr int jacobi_sweeps_max = 8, newton_steps_max = 32;

// Irradiance on n as c + b.n + n.A n, A symmetric (Ramamoorthi and Hanrahan 2001, equation 12).
struct Quadric {
    double c;
    std::array<double, 3> b;
    std::array<std::array<double, 3>, 3> a;
};

Quadric quadricOf(const ProbeLight& light, int channel) {
    const auto l = [&](size_t i) { return static_cast<double>(cosine_bands[bandOf(i)] * light.radiance[i][channel]); };
    constexpr double y0 = 0.282094792, y1 = 0.488602512, y2 = 0.546274215, y20 = 0.315391565;
    return {y0 * l(0) - y20 * l(6),
            {y1 * l(3), y1 * l(1), y1 * l(2)},
            {{{y2 * l(8), y2 * l(4), y2 * l(7)},
              {y2 * l(4), -y2 * l(8), y2 * l(5)},
              {y2 * l(7), y2 * l(5), 3 * y20 * l(6)}}}};
}

// Jacobi's rotation of axes p and q that makes a[p][q] 0.
void rotate(Quadric& f, size_t p, size_t q) {
    if (f.a[p][q] == 0) return;
    const double theta = (f.a[q][q] - f.a[p][p]) / (2 * f.a[p][q]);
    const double t = std::copysign(1 / (std::abs(theta) + std::sqrt(theta * theta + 1)), theta);
    const double cosine = 1 / std::sqrt(t * t + 1), sine = t * cosine;
    const auto turn = [&](double& at_p, double& at_q) {
        const double old = at_p;
        at_p = cosine * old - sine * at_q;
        at_q = sine * old + cosine * at_q;
    };
    for (size_t k = 0; k < 3; ++k) turn(f.a[k][p], f.a[k][q]);
    for (size_t k = 0; k < 3; ++k) turn(f.a[p][k], f.a[q][k]);
    turn(f.b[p], f.b[q]);
}

double squareOf(const std::array<double, 3>& v) {
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
}

// Turned into the frame of A's eigenvectors, more closely than the floats of its light are known.
void diagonalise(Quadric& f) {
    constexpr double enough = 1e-18;  // squared
    const double square = squareOf(f.a[0]) + squareOf(f.a[1]) + squareOf(f.a[2]);
    for (int sweep = 0; sweep < jacobi_sweeps_max; ++sweep) {
        if (squareOf({f.a[0][1], f.a[0][2], f.a[1][2]}) <= enough * square) return;
        rotate(f, 0, 1);
        rotate(f, 0, 2);
        rotate(f, 1, 2);
    }
}

// Whether that needs no closer look: the least is at least c - |b| + A's least eigenvalue, which lies at most
// sqrt(2/3) of the norm of A's traceless part below their mean (Wolkowicz and Styan 1980).
bool surelyPositive(const ProbeLight& light, int channel) {
    const Quadric f = quadricOf(light, channel);
    const double mean = (f.a[0][0] + f.a[1][1] + f.a[2][2]) / 3;
    const double square = squareOf(f.a[0]) + squareOf(f.a[1]) + squareOf(f.a[2]) - 3 * mean * mean;
    return f.c + mean - std::sqrt(squareOf(f.b)) - std::sqrt(std::max(0.0, square) * 2 / 3) > 0;
}

// A quadratic on the unit sphere has no gap to its dual: the least of b.n + n.A n is the largest of
// l - sum b_i^2 / (4 (a_i - l)) over l up to the least eigenvalue, in the frame of the eigenvectors, and lies where
// n_i = b_i / (2 (l - a_i)) has length 1 (More and Sorensen 1983). 1 / length is concave in l, so that Newton's method
// comes down to the root from above after one step.
struct Lowest {
    float irradiance;  // lux
    double l;
};
Lowest lowestOf(const ProbeLight& light, int channel) {
    Quadric f = quadricOf(light, channel);
    diagonalise(f);
    const std::array<double, 3> a = {f.a[0][0], f.a[1][1], f.a[2][2]};
    const auto lowest = static_cast<size_t>(std::ranges::min_element(a) - a.begin());
    // Here the length is at most 1, and at least 1.
    const double length_b = std::hypot(f.b[0], f.b[1], f.b[2]);
    const double below = a[lowest] - length_b / 2, above = a[lowest] - std::abs(f.b[lowest]) / 2;
    double l = below;
    for (int step = 0; step < newton_steps_max; ++step) {
        double squared = 0, slope = 0;  // of n, and half the slope of its square
        for (size_t i = 0; i < 3; ++i) {
            if (f.b[i] == 0 || !(a[i] > l)) continue;
            const double n = f.b[i] / (2 * (a[i] - l));
            squared += n * n;
            slope += n * n / (a[i] - l);
        }
        if (!(slope > 0)) {
            l = above;
            break;
        }
        const double length = std::sqrt(squared);
        const double next = std::clamp(l + (1 - length) * squared / slope, below, above);
        if (std::abs(next - l) <= 1e-12 * (length_b + std::abs(l))) break;
        l = next;
    }
    double least = f.c + l;
    for (size_t i = 0; i < 3; ++i)
        if (f.b[i] != 0 && a[i] > l) least -= f.b[i] * f.b[i] / (4 * (a[i] - l));
    return {static_cast<float>(least), l};
}

// Whether the least is below 0, where some l shows it: with A - l positive definite, it is at least
// c + l - b.(A - l)^-1 b / 4, and at most the irradiance on the normal along -(A - l)^-1 b. Both are close where l is
// about what lowestOf() ends at.
std::optional<bool> isNegativeBy(const Quadric& f, double l) {
    // A - l = L D L^T.
    const double d0 = f.a[0][0] - l, l10 = f.a[1][0] / d0, l20 = f.a[2][0] / d0;
    const double d1 = f.a[1][1] - l - l10 * f.a[1][0], l21 = (f.a[2][1] - l20 * f.a[1][0]) / d1;
    const double d2 = f.a[2][2] - l - l20 * f.a[2][0] - l21 * l21 * d1;
    if (!(d0 > 0 && d1 > 0 && d2 > 0)) return {};
    const double y0 = f.b[0], y1 = f.b[1] - l10 * y0, y2 = f.b[2] - l20 * y0 - l21 * y1;
    const double x2 = y2 / d2, x1 = y1 / d1 - l21 * x2, x0 = y0 / d0 - l10 * x1 - l20 * x2;
    if (f.c + l - (f.b[0] * x0 + f.b[1] * x1 + f.b[2] * x2) / 4 > 0) return false;
    const std::array<double, 3> n = {-x0, -x1, -x2};
    const double square = squareOf(n), length = std::sqrt(square);
    double linear = 0, quadratic = 0;
    for (size_t i = 0; i < 3; ++i) {
        linear += f.b[i] * n[i];
        for (size_t k = 0; k < 3; ++k) quadratic += n[i] * f.a[i][k] * n[k];
    }
    if (square > 0 && f.c + linear / length + quadratic / square < 0) return true;
    return {};
}

// The largest share, 0 to 1, that leaves no channel negative, and per channel the l of its least irradiance: 0 where
// that was not looked for.
struct PositiveShare {
    float share = 1;
    std::array<double, 3> l{};
};
PositiveShare findPositiveShare(const ProbeLight& light) {
    PositiveShare out;
    for (int channel = 0; channel < 3; ++channel) {
        if (surelyPositive(light, channel)) continue;
        const float mean = light.irradiance()[channel];
        const Lowest lowest = lowestOf(light, channel);
        out.l[static_cast<size_t>(channel)] = lowest.l;
        if (lowest.irradiance < 0) out.share = std::min(out.share, mean / (mean - lowest.irradiance));
    }
    out.share = std::max(out.share, 0.0f);
    return out;
}

// `light`: what about this share of the bands became.
bool negativeSomewhere(const ProbeLight& light, const PositiveShare& of) {
    for (int channel = 0; channel < 3; ++channel) {
        if (surelyPositive(light, channel)) continue;
        const double l = static_cast<double>(of.share) * of.l[static_cast<size_t>(channel)];
        const auto known = isNegativeBy(quadricOf(light, channel), l);
        if (known ? *known : leastIrradiance(light, channel) < 0) return true;
    }
    return false;
}

ProbeRecord encodePlain(const ProbeLight& light, const ProbeEncoding& encoding) {
    const glm::vec3 dc = glm::max(light.radiance[0], 0.0f) * encoding.exposure;
    ProbeRecord record{.light = encodeColor(encoding.color_format, dc.x, dc.y, dc.z), .bands = {}};
    const auto stored = decodeColor(encoding.color_format, record.light);
    std::array<int8_t, probe_codes> codes{};
    for (size_t i = 1; i < sh_count; ++i)
        for (int c = 0; c < 3; ++c) {
            const float bound = stored[static_cast<size_t>(c)] * band_bounds[bandOf(i)];
            if (!(bound > 0)) continue;
            const float q = std::round(127 * light.radiance[i][c] * encoding.exposure / bound);
            codes[3 * (i - 1) + static_cast<size_t>(c)] = static_cast<int8_t>(std::clamp(q, -127.0f, 127.0f));
        }
    record.bands = std::bit_cast<std::array<uint32_t, probe_words>>(codes);
    return record;
}

}  // namespace

float leastIrradiance(const ProbeLight& light, int channel) {
    return lowestOf(light, channel).irradiance;
}

ProbeLight flattened(const ProbeLight& light, float share) {
    ProbeLight out = light * share;
    out.radiance[0] = light.radiance[0];
    return out;
}

float positiveShare(const ProbeLight& light) {
    return findPositiveShare(light).share;
}

ProbeLight decodeProbe(const ProbeRecord& record, const ProbeEncoding& encoding) {
    const auto dc = decodeColor(encoding.color_format, canonicalProbe(encoding.color_format, record).light);
    const auto codes = std::bit_cast<std::array<int8_t, probe_codes>>(record.bands);
    ProbeLight out;
    for (int c = 0; c < 3; ++c) {
        const auto channel = static_cast<size_t>(c);
        out.radiance[0][c] = dc[channel] / encoding.exposure;
        for (size_t i = 1; i < sh_count; ++i)
            out.radiance[i][c] = out.radiance[0][c] * band_bounds[bandOf(i)] *
                                 (static_cast<float>(codes[3 * (i - 1) + channel]) / 127.0f);
    }
    return out;
}

ProbeRecord encodeProbe(const ProbeLight& light, const ProbeEncoding& encoding) {
    PositiveShare of = findPositiveShare(light);
    ProbeRecord record = encodePlain(flattened(light, of.share), encoding);
    for (int i = 0; i < retreats_max && negativeSomewhere(decodeProbe(record, encoding), of); ++i) {
        of.share = i + 1 < retreats_max ? of.share * retreat : 0;
        record = encodePlain(flattened(light, of.share), encoding);
    }
    return record;
}

}  // namespace dimmer::cook
