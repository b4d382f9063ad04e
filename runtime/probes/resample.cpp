#include <probes/resample.h>

#include <format/probe.h>
#include <probes/tetrahedron_walk.h>

#include <cstring>

namespace dimmer {
namespace {

template <ColorFormat format>
ProbeRecord blend(std::span<const uint32_t> probes, const Tetrahedron& t, const std::array<float, 4>& weights) {
    ProbeBlend<format> sum;
    for (size_t i = 0; i < 4; ++i) {
        const float weight = weights[i] * weightScale(format);
        sum.add(probeAt(probes, t.probes[i]), weight, weight, weight);
    }
    return sum.encode();
}

}  // namespace

ProbeRecord resampleProbe(const PackData& data, std::span<const uint32_t> probes, std::array<float, 3> point_m,
                          uint32_t& tetrahedron) {
    const GlobalGrid& grid = data.probes.global;
    const GridPlace place = locate(grid, point_m, tetrahedron);
    tetrahedron = place.tetrahedron;
    const auto weights = probeWeights(grid, place);
    const Tetrahedron& t = grid.tetrahedra[place.tetrahedron];
    return data.color_format == ColorFormat::E5B9G9R9 ? blend<ColorFormat::E5B9G9R9>(probes, t, weights)
                                                      : blend<ColorFormat::R11G11B10F>(probes, t, weights);
}

void resampleItem(const PackData& data, const ResampleItem& item, uint32_t first_moving, std::span<uint32_t> probes,
                  std::span<uint32_t> hints) {
    const uint32_t count_x = item.counts & 0xff, count_y = item.counts >> 8 & 0xff;
    for (uint32_t i = item.first; i < item.first + item.count; ++i) {
        const auto x = static_cast<float>(i % count_x), y = static_cast<float>(i / count_x % count_y),
                   z = static_cast<float>(i / (count_x * count_y));
        const std::array<float, 3> point = {item.origin_x + x * item.step_x_x + y * item.step_y_x + z * item.step_z_x,
                                            item.origin_y + x * item.step_x_y + y * item.step_y_y + z * item.step_z_y,
                                            item.origin_z + x * item.step_x_z + y * item.step_y_z + z * item.step_z_z};
        const uint32_t number = item.first_probe + i;
        const ProbeRecord probe = resampleProbe(data, probes, point, hints[number - first_moving]);
        std::memcpy(&probes[words_per_probe * number], &probe, sizeof(probe));
    }
}

}  // namespace dimmer
