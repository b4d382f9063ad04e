#include <pipeline/losses.h>

#include <bake/sampling.h>
#include <charts/pages.h>
#include <pack/pack_data.h>
#include <pipeline/light_error.h>
#include <pipeline/settings.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

namespace dimmer::cook {
namespace {

uint8_t lostAt(const ReceiverLight& light, const Ladder& thresholds) {
    if (!std::isfinite(light.keep) || !(thresholds[0] > 0)) return threshold_rungs.size();
    uint8_t rung = 1;
    while (rung < threshold_rungs.size() && light.keep >= thresholds[rung]) ++rung;
    return rung;
}

// Whether light of the term is there while all doors stand open, or all closed.
bool isLit(const Term& term, bool open) {
    return open ? term.doors_closed.empty() : term.doors_open.empty();
}

uint64_t areaOf(glm::uvec2 size) {
    return uint64_t{size.x} * size.y;
}

std::vector<uint32_t> copiesOf(const Texels& texels) {
    std::vector<uint32_t> copies(texels.size(), 1);
    for (const FillTexel& fill : texels.fills) ++copies[fill.source];
    return copies;
}

}  // namespace

Ladder ladderOf(float threshold) {
    Ladder ladder;
    for (size_t r = 0; r < ladder.size(); ++r)
        ladder[r] = std::min(threshold_max,
                             static_cast<float>(static_cast<double>(threshold_rungs[r]) * shortDecimal(threshold)));
    return ladder;
}

// All light of one state of the doors.
struct LossTable::StateLight {
    std::vector<float> lux;  // luminance per receiver
    float floor_lux = 0;

    explicit StateLight(size_t receivers) : lux(receivers) {}
    void setFloor(const std::vector<float>& area_m2) {
        double sum = 0, area = 0;
        for (size_t i = 0; i < lux.size(); ++i) {
            sum += static_cast<double>(lux[i] * area_m2[i]);
            area += static_cast<double>(area_m2[i]);
        }
        floor_lux = static_cast<float>(area > 0 ? floor_share * sum / area : 0);
    }
    double above(size_t i) const { return static_cast<double>(lux[i] + floor_lux); }
};

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
    ChartSizes out{page_size, {}, std::vector<bool>(unwrap.charts.size()), unwrap.face_chart};
    for (const Chart& c : unwrap.charts) out.charts.emplace_back(c.width, c.height);
    for (size_t f = 0; f < unwrap.faces.size(); ++f) {
        const SceneMesh& mesh = rays.scene().meshes[rays.triangles()[unwrap.faces[f].triangle].mesh];
        out.fixed[unwrap.face_chart[f]] = mesh.texels_per_metre.has_value();
    }
    return out;
}

LossTable::LossTable(const Baked& baked, const Texels& texels, std::span<const float> thresholds, uint32_t overlap_max,
                     ChartSizes sizes)
    : terms_(baked.terms),
      overlap_max_(overlap_max == 0 ? UINT32_MAX : overlap_max),
      copies_(copiesOf(texels)),
      shown_(listTexels(texels)),
      sizes_(std::move(sizes)),
      probes_errors_(baked.grid.errors) {
    for (const Term& term : terms_) {
        group_count_ = std::max(group_count_, term.group + 1);
        for (const auto* list : {&term.doors_open, &term.doors_closed})
            for (const uint32_t door : *list) door_count_ = std::max(door_count_, door + 1);
    }
    const std::vector<float> lux = listRecords(baked, thresholds);
    std::array<StateLight, 2> states = {StateLight(texels.size()), StateLight(texels.size())};
    const auto add = [&](uint32_t receiver, uint32_t term, float part) {
        for (const bool open : {false, true})
            if (isLit(terms_[term], open)) states[open].lux[receiver] += part;
    };
    for (uint32_t i = 0; i < texels.size(); ++i)
        for (const ReceiverLight& l : baked.light.row(i))
            if (l.term == always_group) add(i, l.term, luminance(l.light.irradiance()));
    forKept(Rungs(groupCount(), 0), [&](const Record& r, size_t k) { add(r.receiver, r.term, lux[k]); });
    for (StateLight& state : states) state.setFloor(texels.area_m2);
    weigh(texels, lux, states);
    coarser_ = CoarserTexels(texels, sizes_.of_face, sizes_.fixed, states[0].lux, states[0].floor_lux);
}

std::vector<float> LossTable::listRecords(const Baked& baked, std::span<const float> thresholds) {
    std::vector<float> lux;
    std::vector<std::pair<float, Record>> row;
    std::vector<Ladder> ladders;
    for (const float threshold : thresholds) ladders.push_back(ladderOf(threshold));
    for (uint32_t i = 0; i < baked.light.rows(); ++i) {
        row.clear();
        for (const ReceiverLight& l : baked.light.row(i))
            if (l.term != always_group)
                row.push_back(
                    {luminance(l.light.irradiance()), {i, l.term, {}, 0, lostAt(l, ladders[terms_[l.term].group])}});
        // As limitOverlap() has them: of equals the earlier term.
        std::ranges::stable_sort(row, std::greater{}, [](const auto& entry) { return entry.first; });
        for (const auto& [light, record] : row) {
            lux.push_back(light);
            records_.push_back(record);
        }
    }
    return lux;
}

void LossTable::forKept(const Rungs& rungs, auto&& each) const {
    uint32_t receiver = UINT32_MAX, count = 0;
    for (size_t k = 0; k < records_.size(); ++k) {
        const Record& r = records_[k];
        if (r.receiver != receiver) count = 0;
        receiver = r.receiver;
        if (r.lost_at <= rungs[groupOf(r)] || count == overlap_max_) continue;
        ++count;
        each(r, k);
    }
}

void LossTable::weigh(const Texels& texels, std::span<const float> lux, std::span<const StateLight> states) {
    double area_m2 = 0;
    for (const float texel_m2 : texels.area_m2) area_m2 += static_cast<double>(texel_m2);
    std::vector<double> energy(groupCount());
    const auto energyOf = [&](const Record& r, size_t k) {
        return static_cast<double>(lux[k] * texels.area_m2[r.receiver]);
    };
    forKept(Rungs(groupCount(), 0), [&](const Record& r, size_t k) { energy[groupOf(r)] += energyOf(r, k); });
    for (size_t k = 0; k < records_.size(); ++k) {
        Record& r = records_[k];
        for (const bool open : {false, true})
            if (const StateLight& state = states[open]; isLit(terms_[r.term], open) && state.above(r.receiver) > 0)
                r.error[open] = static_cast<float>(static_cast<double>(lux[k] * texels.area_m2[r.receiver]) /
                                                   (state.above(r.receiver) * 2 * std::max(area_m2, 1e-30)));
        if (const double all = energy[groupOf(r)]; all > 0) r.energy = static_cast<float>(energyOf(r, k) / all);
    }
}

LossSteps LossTable::steps(const Rungs& rungs) const {
    LossSteps sum(groupCount(), door_count_);
    forKept(rungs, [&](const Record& r, size_t) {
        const Loss loss{copies_[r.receiver] * sizeof(TexelRecord), static_cast<double>(r.error[0] + r.error[1]),
                        static_cast<double>(r.energy)};
        if (r.lost_at < threshold_rungs.size()) sum.add(groupOf(r), r.lost_at, loss, terms_[r.term]);
    });
    return sum;
}

// Of what each receiver loses, less what comes back in its place: with doors closed and open apart, as what is gained
// in one of them makes up for nothing in the other, nor at another receiver.
double LossTable::errorOf(const Rungs& rungs) const {
    std::vector<std::array<float, 2>> lost(copies_.size());
    forKept(Rungs(groupCount(), 0), [&](const Record& r, size_t) {
        for (const bool open : {false, true}) lost[r.receiver][open] += r.error[open];
    });
    forKept(rungs, [&](const Record& r, size_t) {
        for (const bool open : {false, true}) lost[r.receiver][open] -= r.error[open];
    });
    double error = 0;
    for (const auto& of_state : lost) error += static_cast<double>(std::abs(of_state[0]) + std::abs(of_state[1]));
    return error;
}

Loss LossTable::loss(const Rungs& rungs) const {
    struct Held {
        uint64_t bytes = 0;
        std::vector<double> energy;
    };
    const auto held = [&](const Rungs& at) {
        Held sum{.energy = std::vector<double>(groupCount())};
        forKept(at, [&](const Record& r, size_t) {
            sum.bytes += copies_[r.receiver] * sizeof(TexelRecord);
            sum.energy[groupOf(r)] += static_cast<double>(r.energy);
        });
        return sum;
    };
    const Held before = held(Rungs(groupCount(), 0)), after = held(rungs);
    Loss loss{before.bytes - after.bytes, errorOf(rungs), 0};
    for (uint32_t g = 0; g < groupCount(); ++g)
        if (const double lost = before.energy[g] - after.energy[g]; lost > loss.energy) {
            loss.energy = lost;
            loss.energy_group = g;
        }
    return loss;
}

RecordBytes LossTable::bytes(const Rungs& rungs) const {
    RecordBytes sum{0, std::vector<uint64_t>(groupCount()), std::vector<uint64_t>(door_count_)};
    uint32_t based = UINT32_MAX;
    forKept(rungs, [&](const Record& r, size_t) {
        const uint64_t bytes = copies_[r.receiver] * sizeof(TexelRecord);
        sum.dynamic += based == r.receiver ? bytes : 2 * bytes;  // with the receiver's base
        based = r.receiver;
        sum.by_group[groupOf(r)] += bytes;
        for (const auto* list : {&terms_[r.term].doors_open, &terms_[r.term].doors_closed})
            for (const uint32_t door : *list) sum.by_door[door] += bytes;
    });
    return sum;
}

// Between the numbers that were measured, along a power of the number; with fewer than any, along the cube root that
// places twice as far apart would have.
std::optional<double> LossTable::probesError(double left) const {
    const std::vector<ProbesError>& e = probes_errors_;
    if (e.empty()) return {};
    const auto errorAt = [&](size_t i) { return static_cast<double>(e[i].error); };
    const double probes = left * e.back().probes;
    const auto above = std::ranges::find_if(e, [&](const ProbesError& at) { return at.probes >= probes; });
    const auto i = static_cast<size_t>(above - e.begin());
    double error = errorAt(std::min(i, e.size() - 1));
    if (i == 0) {
        error *= std::cbrt(e[0].probes / std::max(probes, 1.0));
    } else if (i < e.size() && errorAt(i) > 0 && errorAt(i - 1) > 0) {
        const double along =
            std::log(probes / e[i - 1].probes) / std::log(static_cast<double>(e[i].probes) / e[i - 1].probes);
        error = errorAt(i - 1) * std::pow(errorAt(i) / errorAt(i - 1), along);
    }
    return std::max(0.0, error - errorAt(e.size() - 1));
}

uint64_t LossTable::storedBytes(const Rungs& rungs) const {
    std::vector<std::vector<uint32_t>> terms(copies_.size());
    forKept(rungs, [&](const Record& r, size_t) { terms[r.receiver].push_back(r.term); });
    for (auto& list : terms) std::ranges::sort(list);
    const uint32_t limit = isLimited() ? overlap_max_ : 0;
    uint64_t records = 0;
    for (const Group& group : groupTexels(
             shown_, [&](uint32_t receiver) { return terms[receiver]; }, limit))
        records += group.items.size() * (group.contributions.size() + 1);  // with the receivers' base
    return records * sizeof(TexelRecord);
}

LossSteps::LossSteps(uint32_t groups, uint32_t doors) : steps_(groups) {
    for (auto& group : steps_)
        for (Step& step : group) step.door_bytes.resize(doors);
}

void LossSteps::add(uint32_t group, uint8_t lost_at, const Loss& loss, const Term& term) {
    Step& step = steps_[group][lost_at];
    step.loss.bytes += loss.bytes;
    step.loss.error += loss.error;
    step.loss.energy += loss.energy;
    for (const auto* list : {&term.doors_open, &term.doors_closed})
        for (const uint32_t door : *list) step.door_bytes[door] += loss.bytes;
}

Loss LossSteps::step(uint32_t group, uint8_t from, uint8_t to) const {
    Loss sum;
    for (uint8_t r = from + 1; r <= to; ++r) {
        sum.bytes += steps_[group][r].loss.bytes;
        sum.error += steps_[group][r].loss.error;
        sum.energy += steps_[group][r].loss.energy;
    }
    return sum;
}

uint64_t LossSteps::doorBytes(uint32_t group, uint8_t from, uint8_t to, uint32_t door) const {
    uint64_t sum = 0;
    for (uint8_t r = from + 1; r <= to; ++r)
        if (door < steps_[group][r].door_bytes.size()) sum += steps_[group][r].door_bytes[door];
    return sum;
}

}  // namespace dimmer::cook
