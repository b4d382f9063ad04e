#include <bake/convergence.h>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <numeric>
#include <utility>

namespace dimmer::cook {
namespace {

// Places where a group has less than this share of its mean light count for less: what is still to come there is faint.
constexpr float dim_share = 1e-2f;

// Of TermLight, a standard deviation; and beyond so many of them it is not rounding.
constexpr double rounding_share = 0.0025, deviations = 2;

// The first ones' growth says what they began with.
constexpr uint32_t walks = 2048, walk_bounces = 32, bounces_counted = 8;
// Of a closed room of perfect mirrors nothing can be foreseen.
constexpr float albedo_max = 0.98f;

double beyondRounding(double sum, double variance) {
    return std::max(0.0, std::abs(sum) - deviations * std::sqrt(variance));
}

// Of one channel. After each bounce as many walks go on from each place as light is left there: without that, few
// would carry all of it in the end.
float longRunAlbedo(const Gatherer& gatherer, const Links& links, uint32_t rays, int channel) {
    std::vector<size_t> at(walks), next(walks);
    std::vector<double> left(walks);
    for (uint64_t walk = 0; walk < walks; ++walk) at[walk] = walk * gatherer.receiverCount() / walks;
    double counted = 1;
    for (uint32_t bounce = 0; bounce < walk_bounces; ++bounce) {
        tbb::parallel_for(tbb::blocked_range<uint32_t>(0, walks), [&](const tbb::blocked_range<uint32_t>& some) {
            std::vector<Link> seen;
            for (uint32_t walk = some.begin(); walk < some.end(); ++walk) {
                links.get(at[walk], seen);
                // Links are sorted by path, those over free paths come first.
                const auto free = static_cast<uint32_t>(std::ranges::count(seen, free_path, &Link::path));
                left[walk] = 0;
                if (free == 0) continue;
                at[walk] = seen[hash(walk, bounce) % free].receiver;
                left[walk] = static_cast<double>(gatherer.reflectance(at[walk])[channel]) * free / rays;
            }
        });
        const double sum = std::accumulate(left.begin(), left.end(), 0.0);
        if (!(sum > 0)) return 0;
        if (bounce >= walk_bounces - bounces_counted) counted *= sum / walks;
        double up_to = left[0];
        for (size_t walk = 0, from = 0; walk < walks; ++walk) {
            while (up_to < (static_cast<double>(walk) + 0.5) / walks * sum && from + 1 < walks) up_to += left[++from];
            next[walk] = at[from];
        }
        std::swap(at, next);
    }
    return static_cast<float>(std::pow(counted, 1.0 / bounces_counted));
}

}  // namespace

glm::vec3 longRunAlbedo(const Gatherer& gatherer, const Links& links, uint32_t rays) {
    glm::vec3 albedo(0);
    for (int c = 0; c < 3 && gatherer.receiverCount() > 0; ++c)
        albedo[c] = std::min(longRunAlbedo(gatherer, links, rays, c), albedo_max);
    return albedo;
}

Acceleration::Acceleration(glm::vec3 albedo, uint32_t links)
    : albedo_(albedo),
      links_(static_cast<float>(links)),
      foci2_(albedo * albedo * (1 - 1 / links_)),
      weight_after_(2.0f / (2.0f - foci2_)) {}

glm::vec3 Acceleration::nextWeight() {
    const glm::vec3 weight_then = 1.0f / (1.0f - foci2_ * weight_after_ / 4.0f);
    return std::exchange(weight_, std::exchange(weight_after_, weight_then));
}

glm::vec3 Acceleration::ratio() const {
    return albedo_ * (1 + 1 / std::sqrt(links_)) / (1.0f + glm::sqrt(1.0f - foci2_));
}

// T_n(eigenvalue / foci) / T_n(1 / foci) in the long run, the other way round.
double Acceleration::eigenvalueOf(double ratio, int channel) const {
    const double foci = std::sqrt(static_cast<double>(foci2_[channel]));
    return foci > 0 ? foci * std::cosh(std::max(0.0, std::log(ratio) + std::acosh(1 / foci))) : ratio;
}

Convergence::Convergence(const DoorPaths& paths, std::span<const float> areas_m2, const Acceleration& pace)
    : paths_(paths), areas_m2_(areas_m2), pace_(pace), groups_(paths.groupCount()) {}

// Floors: a share of each group's mean over the area that has light of it.
void Convergence::begin(const SparseLight& light) {
    const size_t groups = groups_.size();
    const Sums all = sumOverRows(light.rows(), Sums(2 * groups), [&](size_t begin, size_t end, Sums& sum) {
        std::vector<glm::vec3> there(groups);  // of each group
        for (size_t i = begin; i < end; ++i) {
            for (const TermLight& l : light.row(i)) there[paths_.group(l.term)] += l.value();
            for (const TermLight& l : light.row(i)) {
                const size_t group = paths_.group(l.term);
                const float lux = luminance(std::exchange(there[group], glm::vec3(0)));
                if (!(lux > 0)) continue;
                sum.of[2 * group] += static_cast<double>(areas_m2_[i]);
                sum.of[2 * group + 1] += static_cast<double>(areas_m2_[i] * lux);
            }
        }
    });
    for (size_t g = 0; g < groups; ++g)
        groups_[g].floor_lux =
            glm::vec3(dim_share * static_cast<float>(all.of[2 * g + 1] / std::max(all.of[2 * g], 1e-30)) + FLT_MIN);
}

Convergence::Part::Part(const Convergence& of, Sums& sums)
    : of_(of), sums_(sums), there_lux_(of.groups_.size()), in_block_(of.paths_.termCount()) {}

void Convergence::Part::addRow(size_t place, std::span<const Change> row) {
    const auto area_m2 = static_cast<double>(of_.areas_m2_[place]);
    for (const Change& c : row) there_lux_[of_.paths_.group(c.term)] += c.gets_lux;
    for (const Change& c : row) {
        const size_t group = of_.paths_.group(c.term);
        // In floats a colour that is not there would be 0 times infinity, as its floor is.
        const glm::dvec3 m2_per_lux = area_m2 / glm::dvec3(there_lux_[group] + of_.groups_[group].floor_lux);
        const glm::dvec3 there_m2 = glm::dvec3(c.gets_lux) * m2_per_lux;
        for (size_t k = 0; k < channels; ++k) sums_.of[index(group, There, k)] += there_m2[static_cast<int>(k)];
        const glm::dvec3 rounding_m2 = rounding_share * glm::dvec3(c.has_lux) * m2_per_lux;
        auto& added = in_block_[c.term];
        added.m2 += glm::dvec3(c.gets_lux - c.has_lux) * m2_per_lux;
        added.variance_m4 += rounding_m2 * rounding_m2;
    }
    for (const Change& c : row) there_lux_[of_.paths_.group(c.term)] = glm::vec3(0);
}

void Convergence::Part::closeBlock() {
    for (const uint32_t t : in_block_.touched())
        for (size_t k = 0; k < channels; ++k) {
            const size_t group = of_.paths_.group(t);
            const double m2 = in_block_[t].m2[static_cast<int>(k)];
            const double variance_m4 = in_block_[t].variance_m4[static_cast<int>(k)];
            sums_.of[index(group, Lacking, k)] += m2;
            sums_.of[index(group, Variance, k)] += variance_m4;
            sums_.of[index(group, LackingInBlocks, k)] += beyondRounding(m2, variance_m4);
        }
    in_block_.clear();
}

void Convergence::end(const Sums& all, std::span<const uint8_t> running) {
    for (size_t g = 0; g < groups_.size(); ++g) {
        if (!running[g]) continue;
        for (size_t k = 0; k < channels; ++k) {
            const auto sum = [&](Number number) { return all.of[index(g, number, k)]; };
            foresee(groups_[g], static_cast<int>(k), sum(There),
                    std::max(beyondRounding(sum(Lacking), sum(Variance)), sum(LackingInBlocks)));
        }
    }
}

void Convergence::foresee(Flux& group, int c, double there_m2, double lacking_m2) const {
    const auto albedo = static_cast<double>(pace_.albedo()[c]), ratio = static_cast<double>(pace_.ratio()[c]);
    // All bounces of what is lacking, as a share of what there will be then.
    const auto allBounces = [&](double eigenvalue) {
        const double m2 = lacking_m2 / (1 - eigenvalue);
        return m2 > 0 ? there_m2 / (there_m2 + eigenvalue * m2) * m2 : 0;
    };
    // Light that stays in a small white room, or beyond an open door, shrinks by less a round than the level's albedo
    // lets expect. Over two rounds, as it shrinks now faster, now slower; and of what was there before, so that light
    // which grows does not make what it lacks smaller.
    const double before_m2 = there_m2 - std::min(lacking_m2, there_m2 / 2);
    const double now =
        group.lacking_m2[c] > 0 && before_m2 > 0 ? lacking_m2 / before_m2 * group.there_m2[c] / group.lacking_m2[c] : 0;
    const double observed = group.last_ratio[c] > 0 ? std::max(now, std::sqrt(now * group.last_ratio[c])) : now;
    const double eigenvalue =
        observed > ratio ? std::clamp(pace_.eigenvalueOf(observed, c), albedo, std::max<double>(albedo, albedo_max))
                         : albedo;
    // As errors of accelerated rounds go to and fro, a small one may be on its way through 0: no smaller than the
    // largest before can have become.
    const bool first = !(group.there_m2[c] > 0);
    group.foreseen_m2[c] = (first ? albedo : ratio) * std::max(allBounces(albedo), group.foreseen_m2[c]);
    group.to_come_m2[c] = std::max(group.foreseen_m2[c], std::clamp(observed, ratio, 1.0) * allBounces(eigenvalue));
    // Of a single round nothing is known.
    if (first) group.to_come_m2[c] = std::max(group.to_come_m2[c], lacking_m2);
    group.there_m2[c] = there_m2;
    group.lacking_m2[c] = lacking_m2;
    group.last_ratio[c] = now;
}

bool Convergence::ends(uint32_t g, float tail_max) const {
    const Flux& group = groups_[g];
    const double most =
        static_cast<double>(tail_max) * std::max({group.there_m2.x, group.there_m2.y, group.there_m2.z});
    for (int c = 0; c < 3; ++c)
        if (group.to_come_m2[c] > 0 && !(group.to_come_m2[c] < most)) return false;
    return true;
}

}  // namespace dimmer::cook
