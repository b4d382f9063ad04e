#include <probes/resample.h>

#include <format/probe.h>
#include <probes/tetrahedron_walk.h>

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

}  // namespace dimmer
