#include <dimmer/model_mesh.h>

#include <probes/spherical_harmonics.h>

#include <algorithm>
#include <cmath>

namespace dimmer {
namespace {

using Vec3 = std::array<float, 3>;
using Mat3 = std::array<Vec3, 3>;  // columns

// Scale is left out: light does not know it.
Mat3 rotationOf(const Transform& transform) {
    Mat3 columns;
    for (size_t c = 0; c < 3; ++c) {
        float squares = 0;
        for (size_t r = 0; r < 3; ++r) {
            columns[c][r] = transform.rows[r][c];
            squares += columns[c][r] * columns[c][r];
        }
        const float inverse = squares > 0 ? 1 / std::sqrt(squares) : 0.0f;
        for (float& v : columns[c]) v *= inverse;
    }
    return columns;
}

Vec3 times(const Mat3& m, const Vec3& v) {
    Vec3 out;
    for (size_t r = 0; r < 3; ++r) out[r] = m[0][r] * v[0] + m[1][r] * v[1] + m[2][r] * v[2];
    return out;
}

// Factors of harmonics of band 2: of a product of axes, of z^2, of x^2 - y^2.
constexpr float band2_product = 1.092548431f, band2_polar = 0.315391565f, band2_across = 0.546274215f;

// Band 2 as w.M w, M symmetric without trace.
Mat3 quadratic(const std::array<float, 9>& t) {
    const float xy = 0.5f * band2_product * t[4], yz = 0.5f * band2_product * t[5], xz = 0.5f * band2_product * t[7];
    return {{{band2_across * t[8] - band2_polar * t[6], xy, xz},
             {xy, -band2_across * t[8] - band2_polar * t[6], yz},
             {xz, yz, 2 * band2_polar * t[6]}}};
}

}  // namespace

std::array<float, 3> modelPosition(const ModelMesh& mesh, const ModelVertex& vertex) {
    Vec3 p;
    for (size_t i = 0; i < 3; ++i)
        p[i] = mesh.min_m[i] + static_cast<float>(vertex.position[i]) / 65535 * (mesh.max_m[i] - mesh.min_m[i]);
    return p;
}

// Cigolle et al. 2014, A Survey of Efficient Representations for Independent Unit Vectors.
std::array<float, 3> modelNormal(const ModelVertex& vertex) {
    const auto unfold = [](int16_t v) { return std::max(static_cast<float>(v) / 32767, -1.0f); };
    float x = unfold(vertex.normal[0]), y = unfold(vertex.normal[1]);
    const float z = 1 - std::abs(x) - std::abs(y), fold = std::max(-z, 0.0f);
    x -= std::copysign(fold, x);
    y -= std::copysign(fold, y);
    const float inverse = 1 / std::sqrt(x * x + y * y + z * z);
    return {x * inverse, y * inverse, z * inverse};
}

LightTransfer modelTransfer(const ModelVertex& vertex, const Transform& world_from_model) {
    std::array<float, 9> t;
    for (size_t i = 0; i < 9; ++i)
        t[i] = std::max(static_cast<float>(vertex.transfer[i]) / 127, -1.0f) * transfer_bounds[bandOf(i)];
    return turned({t}, world_from_model);
}

LightTransfer turned(const LightTransfer& transfer, const Transform& world_from_model) {
    const auto& t = transfer.coefficients;
    const Mat3 r = rotationOf(world_from_model);
    const Vec3 lobe = times(r, {t[3], t[1], t[2]});
    // R M R^T, column by column: its columns are R M (R^T e), and the rows of R are what R^T e picks.
    const Mat3 m = quadratic(t);
    Mat3 q;
    for (size_t c = 0; c < 3; ++c) q[c] = times(r, times(m, {r[0][c], r[1][c], r[2][c]}));
    return {{t[0], lobe[1], lobe[2], lobe[0], 2 * q[1][0] / band2_product, 2 * q[2][1] / band2_product,
             q[2][2] / (2 * band2_polar), 2 * q[2][0] / band2_product, (q[0][0] - q[1][1]) / (2 * band2_across)}};
}

LightTransfer normalTransfer(std::array<float, 3> normal) {
    const auto y = sphericalHarmonics(normal);
    LightTransfer transfer;
    for (size_t i = 0; i < 9; ++i) transfer.coefficients[i] = cosine_bands[bandOf(i)] * y[i];
    return transfer;
}

}  // namespace dimmer
