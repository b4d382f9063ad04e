#include <pipeline/losses.h>

#include <bake/sampling.h>
#include <pack/pack_data.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

constexpr float floor_share = 0.01f;  // of the mean light, as in `dimmer verify`

uint8_t lostAt(const ReceiverLight& light, float threshold) {
    if (!std::isfinite(light.keep) || !(threshold > 0)) return threshold_rungs.size();
    uint8_t rung = 1;
    while (rung < threshold_rungs.size() && light.keep >= std::min(threshold_max, threshold_rungs[rung] * threshold))
        ++rung;
    return rung;
}

// Whether light of the term is there while all doors stand open, or all closed.
bool isLit(const Term& term, bool open) {
    return open ? term.doors_closed.empty() : term.doors_open.empty();
}

// All light of one state of the doors.
struct StateLight {
    std::vector<float> lux;  // luminance per receiver
    float floor_lux = 0;

    explicit StateLight(size_t receivers) : lux(receivers) {}
    void setFloor(const std::vector<uint32_t>& copies) {
        double sum = 0, count = 0;
        for (size_t i = 0; i < lux.size(); ++i) {
            sum += static_cast<double>(lux[i]) * copies[i];
            count += copies[i];
        }
        floor_lux = static_cast<float>(floor_share * sum / std::max(count, 1.0));
    }
    double above(size_t i) const { return static_cast<double>(lux[i] + floor_lux); }
};

uint64_t areaOf(glm::uvec2 size) {
    return uint64_t{size.x} * size.y;
}

std::vector<uint32_t> copiesOf(const Texels& texels) {
    std::vector<uint32_t> copies(texels.size(), 1);
    for (const FillTexel& fill : texels.fills) ++copies[fill.source];
    return copies;
}

}  // namespace

LossTable::TexelsLeft LossTable::texelsLeft(double factor) const {
    if (sizes_.charts.empty()) return {1 / (factor * factor), 1 / (factor * factor)};
    std::vector<glm::uvec2> charts = sizes_.charts;
    uint64_t before = 0, after = 0;
    for (size_t i = 0; i < charts.size(); ++i) {
        before += areaOf(charts[i]);
        if (!sizes_.fixed[i]) charts[i] = chartSize(charts[i], factor);
        after += areaOf(charts[i]);
    }
    const auto ratio = [](uint64_t a, uint64_t b) { return static_cast<double>(a) / static_cast<double>(b); };
    return {ratio(after, before),
            ratio(pageTexels(charts, sizes_.page_size), pageTexels(sizes_.charts, sizes_.page_size))};
}

ChartSizes chartSizes(const RayScene& rays, const Unwrap& unwrap, uint32_t page_size) {
    ChartSizes out{page_size, {}, std::vector<bool>(unwrap.charts.size())};
    for (const Chart& c : unwrap.charts) out.charts.emplace_back(c.width, c.height);
    for (size_t f = 0; f < unwrap.faces.size(); ++f) {
        const SceneMesh& mesh = rays.scene().meshes[rays.triangles()[unwrap.faces[f].triangle].mesh];
        out.fixed[unwrap.face_chart[f]] = mesh.texels_per_metre.has_value();
    }
    return out;
}

LossTable::LossTable(const Baked& baked, const Texels& texels, std::span<const float> thresholds, ChartSizes sizes)
    : copies_(copiesOf(texels)), sizes_(std::move(sizes)) {
    uint64_t fixed = 0, all = 0;
    for (size_t i = 0; i < sizes_.charts.size(); ++i) {
        const uint64_t area = areaOf(sizes_.charts[i]);
        all += area;
        fixed += sizes_.fixed[i] ? area : 0;
    }
    fixed_texels_ = static_cast<double>(fixed) / static_cast<double>(std::max<uint64_t>(all, 1));
    uint32_t doors = 0;
    for (const Term& term : baked.terms) {
        steps_.resize(std::max<size_t>(steps_.size(), term.group + 1));
        for (const auto* list : {&term.doors_open, &term.doors_closed})
            for (const uint32_t door : *list) doors = std::max(doors, door + 1);
    }
    for (auto& group : steps_)
        for (Step& step : group) step.door_bytes.resize(doors);
    std::array<StateLight, 2> states = {StateLight(texels.size()), StateLight(texels.size())};
    std::vector<double> energy(steps_.size());
    double texel_count = 0;
    for (size_t i = 0; i < texels.size(); ++i) {
        texel_count += copies_[i];
        for (const ReceiverLight& l : baked.light.row(i)) {
            const float part = luminance(l.light.irradiance_lux);
            for (const bool open : {false, true})
                if (isLit(baked.terms[l.term], open)) states[open].lux[i] += part;
            energy[baked.terms[l.term].group] += static_cast<double>(part * texels.area_m2[i]);
        }
    }
    for (StateLight& state : states) state.setFloor(copies_);
    for (uint32_t i = 0; i < texels.size(); ++i)
        for (const ReceiverLight& l : baked.light.row(i)) {
            if (l.term == always_group) continue;
            const Term& term = baked.terms[l.term];
            const uint8_t lost = lostAt(l, thresholds[term.group]);
            records_.push_back({i, static_cast<uint16_t>(term.group), lost});
            if (lost == threshold_rungs.size()) continue;
            Step& step = steps_[term.group][lost];
            const auto part = static_cast<double>(luminance(l.light.irradiance_lux));
            const uint64_t bytes = copies_[i] * sizeof(TexelRecord);
            step.loss.bytes += bytes;
            for (const bool open : {false, true})
                if (const StateLight& state = states[open]; isLit(term, open) && state.above(i) > 0)
                    step.loss.error += part / state.above(i) * copies_[i] / (2 * texel_count);
            if (energy[term.group] > 0)
                step.loss.energy += part * static_cast<double>(texels.area_m2[i]) / energy[term.group];
            for (const auto* list : {&term.doors_open, &term.doors_closed})
                for (const uint32_t door : *list) step.door_bytes[door] += bytes;
        }
    measureCurvature(texels, states[0].lux, states[0].floor_lux);
}

// Over neighbours on the pages, which charts' padding continues; |left + right - 2 here| / 2 along both axes.
void LossTable::measureCurvature(const Texels& texels, const std::vector<float>& lux, float floor_lux) {
    std::vector<std::pair<uint32_t, uint32_t>> by_address;
    for (uint32_t i = 0; i < texels.size(); ++i) by_address.emplace_back(texels.address[i], i);
    for (const FillTexel& fill : texels.fills) by_address.emplace_back(fill.address, fill.source);
    std::ranges::sort(by_address);
    const auto at = [&](uint32_t address) {
        const auto it = std::ranges::lower_bound(by_address, address, {}, [](const auto& p) { return p.first; });
        return it != by_address.end() && it->first == address ? &lux[it->second] : nullptr;
    };
    double sum = 0, count = 0;
    for (uint32_t i = 0; i < texels.size(); ++i) {
        const uint32_t a = texels.address[i], page = TexelAddress::page(a), x = TexelAddress::x(a),
                       y = TexelAddress::y(a);
        if (x == 0 || y == 0 || !(lux[i] + floor_lux > 0)) continue;
        double here = 0;
        for (const auto& [dx, dy] : {std::pair{1u, 0u}, {0u, 1u}}) {
            const float* before = at(TexelAddress::pack(page, x - dx, y - dy));
            const float* after = at(TexelAddress::pack(page, x + dx, y + dy));
            if (before && after) here += static_cast<double>(std::abs(*before + *after - 2 * lux[i]) / 2);
        }
        sum += here / static_cast<double>(lux[i] + floor_lux);
        ++count;
    }
    curvature_ = count > 0 ? sum / count : 0;
}

Loss LossTable::step(uint32_t group, uint8_t from, uint8_t to) const {
    Loss sum;
    for (uint8_t r = from + 1; r <= to; ++r) {
        sum.bytes += steps_[group][r].loss.bytes;
        sum.error += steps_[group][r].loss.error;
        sum.energy += steps_[group][r].loss.energy;
    }
    return sum;
}

Loss LossTable::loss(const Rungs& rungs) const {
    Loss sum;
    for (uint32_t g = 0; g < groupCount(); ++g) {
        const Loss own = step(g, 0, rungs[g]);
        sum.bytes += own.bytes;
        sum.error += own.error;
        sum.energy = std::max(sum.energy, own.energy);
    }
    return sum;
}

uint64_t LossTable::doorBytes(uint32_t group, uint8_t from, uint8_t to, uint32_t door) const {
    uint64_t sum = 0;
    for (uint8_t r = from + 1; r <= to; ++r)
        if (door < steps_[group][r].door_bytes.size()) sum += steps_[group][r].door_bytes[door];
    return sum;
}

uint64_t LossTable::dynamicBytes(const Rungs& rungs) const {
    uint64_t texels = 0;
    uint32_t based = UINT32_MAX;
    for (const Record& r : records_) {
        if (r.lost_at <= rungs[r.group]) continue;
        texels += copies_[r.receiver];
        if (based != r.receiver) texels += copies_[r.receiver];
        based = r.receiver;
    }
    return texels * sizeof(TexelRecord);
}

}  // namespace dimmer::cook
