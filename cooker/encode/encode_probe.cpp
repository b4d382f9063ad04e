#include <encode/encode_probe.h>

#include <format/probe.h>
#include <probes/spherical_harmonics.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace dimmer::cook {
namespace {

// What rounding to 1/127 may take below 0 again, a little more of the mean takes back.
constexpr float retreat = 0.97f;
constexpr int retreats_max = 64;
constexpr int start_normals = 64, starts_kept = 6, descent_steps = 12, newton_steps = 24;

// Irradiance on n as c + b.n + n.A n, A symmetric (Ramamoorthi and Hanrahan 2001, equation 12).
struct Quadric {
    float c;
    glm::vec3 b;
    glm::mat3 a;

    float at(glm::vec3 n) const { return c + glm::dot(b, n) + glm::dot(n, a * n); }
};

Quadric quadricOf(const ProbeLight& light, int channel) {
    const auto l = [&](size_t i) { return cosine_bands[bandOf(i)] * light.radiance[i][channel]; };
    constexpr float y0 = 0.282094792f, y1 = 0.488602512f, y2 = 0.546274215f, y20 = 0.315391565f;
    Quadric q{y0 * l(0) - y20 * l(6), y1 * glm::vec3(l(3), l(1), l(2)), glm::mat3(0)};
    q.a[0] = {y2 * l(8), y2 * l(4), y2 * l(7)};
    q.a[1] = {y2 * l(4), -y2 * l(8), y2 * l(5)};
    q.a[2] = {y2 * l(7), y2 * l(5), 3 * y20 * l(6)};
    return q;
}

// Each step goes to the minimum of a bound from above that touches the quadric at n, so it never climbs; Newton's
// method on the sphere does the last digits.
float descend(const Quadric& q, glm::vec3 n, float shift) {
    for (int step = 0; step < descent_steps; ++step) {
        const glm::vec3 towards = shift * n - q.a * n - 0.5f * q.b;
        const float length = glm::length(towards);
        if (!(length > 0)) break;
        n = towards / length;
    }
    float least = q.at(n), damping = 0.1f * shift;
    for (int step = 0; step < newton_steps && damping < 1e3f * shift; ++step) {
        const glm::vec3 gradient = 2.0f * (q.a * n) + q.b;
        const float along = glm::dot(gradient, n);
        const glm::mat3 tangent = glm::mat3(1) - glm::outerProduct(n, n);
        const glm::mat3 curvature = tangent * (2.0f * q.a + (damping - along) * glm::mat3(1)) * tangent;
        const glm::vec3 next =
            glm::normalize(n - glm::inverse(curvature + shift * glm::outerProduct(n, n)) * (gradient - along * n));
        if (q.at(next) < least) {
            n = next;
            least = q.at(n);
            damping *= 0.2f;
        } else {  // too far, or uphill where the quadric is not convex
            damping *= 5;
        }
    }
    return least;
}

bool negativeSomewhere(const ProbeLight& light) {
    for (int channel = 0; channel < 3; ++channel)
        if (leastIrradiance(light, channel) < 0) return true;
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
    const Quadric q = quadricOf(light, channel);
    // At least the largest eigenvalue of A.
    float shift = 0;
    for (int i = 0; i < 3; ++i) shift = std::max(shift, std::abs(q.a[i].x) + std::abs(q.a[i].y) + std::abs(q.a[i].z));
    std::array<std::pair<float, glm::vec3>, start_normals> starts;
    for (int i = 0; i < start_normals; ++i) {
        const auto n = uniformSphereDirection(sequence2d(static_cast<uint32_t>(i), 7));
        starts[static_cast<size_t>(i)] = {q.at(n), n};
    }
    std::ranges::partial_sort(starts, starts.begin() + starts_kept, {}, [](const auto& s) { return s.first; });
    float least = std::numeric_limits<float>::infinity();
    for (size_t i = 0; i < starts_kept; ++i) least = std::min(least, descend(q, starts[i].second, shift));
    return least;
}

ProbeLight flattened(const ProbeLight& light, float share) {
    ProbeLight out = light * share;
    out.radiance[0] = light.radiance[0];
    return out;
}

float positiveShare(const ProbeLight& light) {
    float share = 1;
    for (int channel = 0; channel < 3; ++channel) {
        const float mean = light.irradiance()[channel], least = leastIrradiance(light, channel);
        if (least < 0) share = std::min(share, mean / (mean - least));
    }
    return std::max(share, 0.0f);
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
    float share = positiveShare(light);
    ProbeRecord record = encodePlain(flattened(light, share), encoding);
    for (int i = 0; i < retreats_max && negativeSomewhere(decodeProbe(record, encoding)); ++i) {
        share = i + 1 < retreats_max ? share * retreat : 0;
        record = encodePlain(flattened(light, share), encoding);
    }
    return record;
}

}  // namespace dimmer::cook
