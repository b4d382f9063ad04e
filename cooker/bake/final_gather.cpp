#include <bake/final_gather.h>

#include <bake/sampling.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace dimmer::cook {
namespace {

// Fewer rounds say too little about their spread to stop on it.
constexpr uint32_t rounds_min = 4;
constexpr float normal_95 = 1.96f;
// Rays are aimed for a term while without them, by what they found, its rounds would differ by more than this many
// times their variance more: where a light comes from all around, or the door is out of sight, they gain nothing.
constexpr float aim_gain_min = 3;
// Light below this share of its term's mean need not be exact to a share of itself: the error metric's own floor.
constexpr float noise_floor = 0.01f;
// Terms with doors are many and faint, and would keep rays going for the others: they need not be exact to a share of
// less than what the door changes around it on average, a third of Series::threshold_base.
constexpr float door_noise_floor = 1.0f / 3;

}  // namespace

std::vector<float> noiseFloors(const Series& series, uint32_t group_count) {
    std::vector<float> floors;
    for (const TermReport& r : series.reports) floors.push_back(noise_floor * r.mean_lux);
    for (size_t t = group_count; t < floors.size(); ++t)
        floors[t] = std::max(floors[t], door_noise_floor * series.threshold_base[t]);
    return floors;
}

FinalGatherOptions finalGatherOptions(const BakeSettings& settings, std::span<const float> floors_lux) {
    return {.rays_max = settings.final_rays,
            .emitter_samples = settings.emitter_samples,
            .noise_max = settings.noise_max,
            .seed = settings.seed + 1,
            .floor_lux = floors_lux};
}

template <class Light>
void FinalGather<Light>::State::add(const Light& round) {
    sum += round;
    ++rounds;
    const float value = luminance(round.irradiance()), step = value - mean;
    mean += step / static_cast<float>(rounds);
    squares += step * (value - mean);
}

template <class Light>
float FinalGather<Light>::State::varianceOfMean() const {
    return rounds < 2 ? 0 : squares / static_cast<float>(rounds * (rounds - 1));
}

// At the doors that the terms are about.
template <class Light>
void FinalGather<Light>::aim(const GatherFrom& from, std::span<const uint32_t> terms,
                             const FinalGatherOptions& options) {
    aims_.clear();
    wanted_in_aim_.clear();
    for (uint32_t t : terms) {
        aim_of_term_[t] = 0;
        spared_variance_[t] = 0;
        const uint32_t guide = options.aim_at_doors ? gatherer_.guideOf(t) : no_guide;
        if (guide == no_guide) continue;
        const auto known = std::ranges::find(aims_, guide, &DoorAim::guide) - aims_.begin();
        if (static_cast<size_t>(known) == aims_.size()) aims_.push_back(gatherer_.aimAt(from, guide));
        aim_of_term_[t] = static_cast<uint16_t>(known + 1);
        wanted_in_aim_.resize(aims_.size());
        ++wanted_in_aim_[static_cast<size_t>(known)];
    }
}

// Terms that are not asked for and count for one that is.
template <class Light>
void FinalGather<Light>::takeAlong(uint32_t term, uint32_t into) {
    for (const uint32_t t : gatherer_.paths().moreClosed(term)) {
        if (round_.wants(t)) continue;
        round_.setInto(t, into);
        along_.emplace_back(t, into);
        takeAlong(t, into);
    }
}

// By past rounds alone, so that no round's own luck decides what it counts for.
template <class Light>
bool FinalGather<Light>::aimPays(uint32_t term) const {
    const State& s = state_[term];
    const auto rounds = static_cast<float>(s.rounds);
    return spared_variance_[term] / rounds > aim_gain_min * s.squares / (rounds - 1);
}

template <class Light>
void FinalGather<Light>::leaveAim(uint32_t term) {
    --wanted_in_aim_[aim_of_term_[term] - 1u];
    aim_of_term_[term] = 0;
}

template <class Light>
void FinalGather<Light>::want(uint32_t term, bool wanted) {
    round_.setWanted(term, wanted);
    if (!wanted)
        for (const auto& [other, into] : along_)
            if (into == term) round_.setWanted(other, false);
    wanted_in_group_[gatherer_.paths().terms()[term].group] += wanted ? 1u : UINT32_MAX;
}

template <class Light>
RowEnds* FinalGather<Light>::endsOfRound(RowEnds* row, uint32_t round) {
    const size_t end = (size_t{round} + 1) * rays_per_round;
    if (!row || end > std::max<size_t>(row->ends.size(), row->kept_max)) return nullptr;
    if (row->ends.size() < end) row->ends.resize(end, RayEnd::unknown);
    return row;
}

template <class Light>
uint64_t FinalGather<Light>::gather(const GatherFrom& from, std::span<const uint32_t> terms,
                                    const SparseLight& outgoing, const FinalGatherOptions& options,
                                    std::vector<LightOfTerm<Light>>& out, RowEnds* ends,
                                    std::span<const uint32_t> bounced) {
    for (uint32_t t : terms) {
        state_[t] = {};
        want(t, true);
    }
    along_.clear();
    for (uint32_t t : terms) takeAlong(t, t);
    aim(from, terms, options);
    const uint32_t rounds_max = std::max(1u, (options.rays_max + rays_per_round / 2) / rays_per_round);
    size_t waiting = terms.size();
    uint64_t traced = 0;
    for (uint32_t r = 0; r < rounds_max && waiting > 0; ++r) {
        const bool known = ends && ends->ends.size() >= size_t{r + 1} * rays_per_round;
        gatherer_.gather(from,
                         {.rays = rays_per_round,
                          .emitter_samples = options.emitter_samples,
                          .seed = options.seed,
                          .first_ray = r * rays_per_round,
                          .wanted_in_group = wanted_in_group_,
                          .row = endsOfRound(ends, r)},
                         &outgoing, round_, nullptr, {aims_, aim_of_term_, wanted_in_aim_, spared_variance_});
        const auto idle = static_cast<size_t>(std::ranges::count(wanted_in_aim_, 0u));
        traced += (known ? 0 : rays_per_round) + (aims_.size() - idle) * aimed_rays;
        for (uint32_t t : terms) {
            State& s = state_[t];
            if (s.done) continue;
            s.add(round_[t]);
            const float interval = normal_95 * std::sqrt(s.varianceOfMean());
            // What no ray has found yet may come from a small bright place.
            const bool sought = s.mean == 0 && std::ranges::binary_search(bounced, t);
            s.done = r + 1 >= rounds_min && options.noise_max > 0 && !sought &&
                     interval <= options.noise_max * (s.mean + options.floor_lux[t]);
            const bool aimed = aim_of_term_[t] != 0, look = r + 1 >= rounds_min && std::has_single_bit(r + 1);
            if (aimed && (s.done || (look && !aimPays(t)))) leaveAim(t);
            if (!s.done) continue;
            want(t, false);
            --waiting;
        }
        round_.clear();
    }
    for (uint32_t t : terms) {
        const State& s = state_[t];
        if (!s.done) want(t, false);
        out.push_back({t, s.sum * (1 / static_cast<float>(s.rounds)), s.varianceOfMean()});
    }
    return traced;
}

template class FinalGather<Gathered>;
template class FinalGather<ProbeLight>;

}  // namespace dimmer::cook
