#include <pipeline/draw_places.h>

#include <bake/sampling.h>

#include <numeric>

namespace dimmer::cook {

DrawnPlaces drawPlaces(std::span<const double> density, uint32_t count, uint32_t seed) {
    const double step = std::accumulate(density.begin(), density.end(), 0.0) / count;
    double target = step * static_cast<double>(unitFloat(hash(seed, 0xd00fu))), cumulative = 0;
    DrawnPlaces out;
    if (!(step > 0)) return out;
    for (size_t i = 0; i < density.size(); ++i) {
        cumulative += density[i];
        uint32_t times = 0;
        for (; target < cumulative; target += step) ++times;
        if (times == 0) continue;
        out.index.push_back(i);
        out.weight.push_back(times * step / density[i]);
    }
    return out;
}

}  // namespace dimmer::cook
