#include <bake/convergence.h>

#include <bake/sums.h>

#include <cfloat>
#include <cmath>
#include <utility>

namespace dimmer::cook {
namespace {

// Places where a group has less than this share of its mean light count for less: what is still to come there is faint.
constexpr float dim_share = 1e-2f;

// Steps of less than this share of the light are as much the doing of what rounds it (TermLight): they say nothing of
// how the light shrinks, which is then as it was before.
constexpr double rounding_share = 0.002;

// Walks are long enough for what they began with not to count, and many enough for a percent.
constexpr uint32_t walks = 4096, walk_bounces = 8;
// Of a closed room of perfect mirrors nothing can be foreseen.
constexpr float albedo_max = 0.98f;

}  // namespace

glm::vec3 longRunAlbedo(const Gatherer& gatherer, const Links& links, uint32_t rays) {
    // Per bounce and channel, what is left of all walks.
    constexpr size_t channels = 3;
    const size_t receivers = gatherer.receiverCount();
    const Sums left = sumOverRows(
        receivers == 0 ? 0 : walks, Sums(channels * walk_bounces), [&](size_t begin, size_t end, Sums& sum) {
            std::vector<Link> seen;
            for (size_t walk = begin; walk < end; ++walk) {
                auto at = static_cast<size_t>(static_cast<uint64_t>(walk) * receivers / walks);
                glm::dvec3 weight(1);
                for (uint32_t bounce = 0; bounce < walk_bounces; ++bounce) {
                    links.get(at, seen);
                    const auto free = static_cast<size_t>(std::ranges::count(seen, free_path, &Link::path));
                    if (free == 0) break;
                    // Links are sorted by path, those over free paths come first.
                    const uint32_t chosen = hash(static_cast<uint32_t>(walk), bounce) % free;
                    at = seen[chosen].receiver;
                    weight *= glm::dvec3(gatherer.reflectance(at)) * (static_cast<double>(free) / rays);
                    for (size_t c = 0; c < channels; ++c) sum.of[channels * bounce + c] += weight[static_cast<int>(c)];
                }
            }
        });
    glm::vec3 albedo(0);
    constexpr uint32_t half = walk_bounces / 2;
    for (size_t c = 0; c < channels; ++c) {
        const double middle = left.of[channels * (half - 1) + c], last = left.of[channels * (walk_bounces - 1) + c];
        if (middle > 0)
            albedo[static_cast<int>(c)] = static_cast<float>(std::pow(last / middle, 1.0 / (walk_bounces - half)));
    }
    return glm::min(albedo, albedo_max);
}

Acceleration::Acceleration(glm::vec3 albedo) : albedo_(albedo), weight_after_(2.0f / (2.0f - albedo * albedo)) {}

glm::vec3 Acceleration::nextWeight() {
    const glm::vec3 weight_then = 1.0f / (1.0f - albedo_ * albedo_ * weight_after_ / 4.0f);
    return std::exchange(weight_, std::exchange(weight_after_, weight_then));
}

glm::vec3 Acceleration::ratio() const {
    return albedo_ / (1.0f + glm::sqrt(1.0f - albedo_ * albedo_));
}

Convergence::Convergence(const Gatherer& gatherer, glm::vec3 ratio)
    : gatherer_(gatherer), paths_(gatherer.paths()), ratio_(ratio), groups_(paths_.groupCount()) {}

// Light of each group at a receiver, added to `there`; and taken away again.
void Convergence::addUp(std::span<const TermLight> row, std::vector<glm::vec3>& there) const {
    for (const TermLight& l : row) there[paths_.group(l.term)] += l.value();
}
void Convergence::clear(std::span<const TermLight> row, std::vector<glm::vec3>& there) const {
    for (const TermLight& l : row) there[paths_.group(l.term)] = glm::vec3(0);
}

// A share of each group's mean over the area that has light of it.
void Convergence::measureFloors(const SparseLight& light) {
    const size_t count = groups_.size();
    const Sums all = sumOverRows(light.rows(), Sums(2 * count), [&](size_t begin, size_t end, Sums& sum) {
        std::vector<glm::vec3> there(count);  // of each group
        for (size_t i = begin; i < end; ++i) {
            addUp(light.row(i), there);
            for (const TermLight& l : light.row(i)) {
                const size_t group = paths_.group(l.term);
                const float lux = luminance(std::exchange(there[group], glm::vec3(0)));
                if (!(lux > 0)) continue;
                sum.of[2 * group] += static_cast<double>(gatherer_.areaM2(i));
                sum.of[2 * group + 1] += static_cast<double>(gatherer_.areaM2(i) * lux);
            }
        }
    });
    for (size_t g = 0; g < count; ++g)
        groups_[g].floor_lux =
            glm::vec3(dim_share * static_cast<float>(all.of[2 * g + 1] / std::max(all.of[2 * g], 1e-30)) + FLT_MIN);
}

void Convergence::measure(const SparseLight& before, const SparseLight& after, std::span<const uint8_t> running) {
    measureFloors(after);
    // Of each group and channel the light and the step, as shares of what is there; and the step as a share of what
    // was there when the step before was measured, so that light which grows does not make its steps look smaller.
    constexpr size_t numbers = 9;
    const size_t count = groups_.size();
    const Sums now = sumOverRows(after.rows(), Sums(numbers * count), [&](size_t begin, size_t end, Sums& sum) {
        std::vector<glm::vec3> there(count), there_before(count);  // of each group
        for (size_t i = begin; i < end; ++i) {
            const auto old_row = before.row(i), row = after.row(i);
            addUp(row, there);
            addUp(old_row, there_before);
            auto old = old_row.begin();
            for (const TermLight& l : row) {
                while (old != old_row.end() && old->term < l.term) ++old;
                const glm::vec3 had = old != old_row.end() && old->term == l.term ? old->value() : glm::vec3(0);
                const size_t group = paths_.group(l.term);
                const glm::vec3 is = there[group] + groups_[group].floor_lux;
                // Where there was none, a step is no more than twice what is there.
                const glm::vec3 was = glm::max(there_before[group] + groups_[group].floor_lux, 0.5f * is);
                const glm::vec3 step = glm::abs(l.value() - had);
                const float area = gatherer_.areaM2(i);
                for (int c = 0; c < 3; ++c) {
                    double* const of = &sum.of[numbers * group + 3 * static_cast<size_t>(c)];
                    of[0] += static_cast<double>(area * l.value()[c] / is[c]);
                    of[1] += static_cast<double>(area * step[c] / is[c]);
                    of[2] += static_cast<double>(area * step[c] / was[c]);
                }
            }
            clear(row, there);
            clear(old_row, there_before);
        }
    });
    for (size_t g = 0; g < count; ++g) {
        if (!running[g]) continue;
        Flux& group = groups_[g];
        glm::dvec3 step(0), ratio(1);
        for (int c = 0; c < 3; ++c) {
            const double* const of = &now.of[numbers * g + 3 * static_cast<size_t>(c)];
            if (group.step[c] > 0) ratio[c] = of[2] / group.step[c];
            group.sum[c] = of[0];
            step[c] = of[1];
        }
        foresee(group, step, ratio);
    }
}

void Convergence::foresee(Flux& group, glm::dvec3 step, glm::dvec3 ratio) const {
    const double most = std::max({group.sum.x, group.sum.y, group.sum.z});
    for (int c = 0; c < 3; ++c) {
        const bool by_light = step[c] > rounding_share * most;
        // Steps shrink now faster, now slower.
        if (by_light) group.ratio[c] = std::max(std::sqrt(ratio[c] * group.last_ratio[c]), ratio_[c]);
        const double steps = group.ratio[c] < 1 ? group.ratio[c] / (1 - group.ratio[c]) : HUGE_VAL;
        const double by_step = step[c] > 0 ? step[c] * steps : 0;
        group.to_come[c] = by_light ? by_step : std::min(by_step, group.to_come[c] * group.ratio[c]);
    }
    group.step = step;
    group.last_ratio = ratio;
}

bool Convergence::ends(uint32_t g, float tail_max) const {
    const Flux& group = groups_[g];
    const double most = static_cast<double>(tail_max) * std::max({group.sum.x, group.sum.y, group.sum.z});
    for (int c = 0; c < 3; ++c)
        if (group.to_come[c] > 0 && group.to_come[c] >= most) return false;
    return true;
}

}  // namespace dimmer::cook
