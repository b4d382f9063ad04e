#include <bake/activity.h>

#include <bake/spread.h>
#include <bake/sums.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace dimmer::cook {
namespace {

// Texels to each side that tell whether light is active at one.
constexpr int activity_reach = 2;
constexpr float around_texel_sizes = 4;  // from corner to corner of so many texels, wherever in them samples lie

// What receivers inside of a lamp's casing have, ten thousand times the room's, is no measure of its light: of each no
// more counts than so many times the median. Of what lamps do to rooms hardly anything is above.
constexpr double counts_medians_max = 20;

// A term with doors ends at the threshold's share of so many times the mean of what its group changes around the door.
// What lies below is then about as little of the change as what other terms lose is of their light: the mean counts
// many receivers that the door hardly changes, theirs only such as are lit straight.
constexpr float door_change_factor = 3;
// Beside a sunlit yard all light of a hall is less than that. What doors let in of always-on light is seen beside what
// of it is there anyhow, which nobody switches off: by so many times the threshold's share of that a term of such light
// may end below its own threshold, down to a share of it.
constexpr float always_on_factor = 3, dark_threshold_share = 0.2f;

float thresholdAt(const TermReport& report, float always_on_lux) {
    return std::clamp(report.share_of_always_on * always_on_lux, report.dark_threshold_lux, report.threshold_lux);
}

}  // namespace

// Per term the luminances, lux, of the receivers that its mean is taken over, and how many these are; and what groups
// send around doors.
struct Activity::Around {
    Sums lux, receivers;
    std::vector<Spread> spread;  // per light group
    DoorSurroundings doors;
    Around& operator+=(const Around& o) {
        lux += o.lux;
        receivers += o.receivers;
        for (size_t g = 0; g < spread.size(); ++g) spread[g] += o.spread[g];
        doors += o.doors;
        return *this;
    }
};

std::vector<TermReport> Activity::thresholds(const Series& light, float most) const {
    const size_t terms = paths_.termCount();
    const Sums zeros(terms);
    const Around around = sumOverRows(
        gatherer_.receiverCount(),
        Around{zeros, zeros, std::vector<Spread>(paths_.groupCount()), DoorSurroundings(paths_, doors_seen_)},
        [&](size_t begin, size_t end, Around& sum) {
            for (size_t i = begin; i < end; ++i) sum.doors.addReceiver(i);
            forEachPair(light, begin, end, [&](size_t i, uint32_t t, float direct, float bounced, float stored) {
                sum.doors.add(i, t, stored);
                const bool of_group = t < paths_.groupCount();
                if (!(of_group ? direct > 0 : seesDoorOf(i, t))) return;
                const auto lux = static_cast<double>(of_group ? bounced : stored);
                ++sum.receivers.of[t];
                sum.lux.of[t] += lux;
                if (of_group) sum.spread[t].add(lux);
            });
        });
    std::vector<TermReport> reports(terms);
    for (uint32_t t = 0; t < terms; ++t) {
        TermReport& report = reports[t];
        report.measured_over = static_cast<uint64_t>(around.receivers.of[t]);
        const double too_much = t < paths_.groupCount() ? around.spread[t].sumAbove(counts_medians_max) : 0;
        if (report.measured_over > 0)
            report.mean_lux = static_cast<float>((around.lux.of[t] - too_much) / around.receivers.of[t]);
        const Term& term = paths_.terms()[t];
        if (term.free() && isAlwaysOn(gatherer_.rays().scene(), term.group)) continue;
        const float base = term.free() ? report.mean_lux : doorBase(term, reports[term.group].mean_lux, around.doors);
        const float share = std::min(settings_.thresholdOf(term.group), most);
        report.threshold_lux = report.dark_threshold_lux = share * base;
        if (!term.free() && isAlwaysOn(gatherer_.rays().scene(), term.group)) {
            report.dark_threshold_lux *= dark_threshold_share;
            report.share_of_always_on = share * always_on_factor;
        }
    }
    return reports;
}

std::vector<double> Activity::flux(const Series& light) const {
    return sumOverRows(gatherer_.receiverCount(), Sums(paths_.termCount()),
                       [&](size_t begin, size_t end, Sums& sum) {
                           forEachPair(light, begin, end, [&](size_t i, uint32_t t, float, float, float stored) {
                               sum.of[t] += static_cast<double>(gatherer_.areaM2(i) * stored);
                           });
                       })
        .of;
}

// Beside the group's other light a door's may be faint, and yet all that there is behind the door.
float Activity::doorBase(const Term& term, float group_mean_lux, const DoorSurroundings& around) const {
    const float of_others = std::max(group_mean_lux, around.light(term));
    return std::clamp(door_change_factor * around.changed(term), settings_.door_share * of_others, of_others);
}

bool Activity::seesDoorOf(size_t receiver, uint32_t term) const {
    return std::ranges::any_of(doors_seen_.row(receiver),
                               [&](uint32_t door) { return paths_.terms()[term].isAbout(door); });
}

void Activity::measure(Series& series) const {
    series.reports = thresholds(series, 1);
    series.threshold_base.clear();
    series.group_of.clear();
    for (uint32_t t = 0; t < paths_.termCount(); ++t) {
        series.group_of.push_back(paths_.terms()[t].group);
        const float share = settings_.thresholdOf(series.group_of[t]);
        series.threshold_base.push_back(share > 0 ? series.reports[t].threshold_lux / share : 0.0f);
    }
}

// By bounced light over neighbouring texels: by its own few rays a receiver that saw little would be cut and its
// neighbour that saw much be kept, which leaves faint light too dark and terms' regions ragged.
void Activity::decide(Series& series) const {
    const size_t terms = paths_.termCount();
    SparseLight active = activeAround(series);
    const std::vector<double> energy = flux(series);
    const std::vector<double> dropped =
        sumOverRows(gatherer_.receiverCount(), Sums(terms), [&](size_t begin, size_t end, Sums& sum) {
            forEachPair(series, begin, end, [&](size_t i, uint32_t t, float direct, float, float stored) {
                const auto row = active.row(i);
                bool kept = series.active(t, direct, 0, series.alwaysOnLux(i, t));
                for (uint32_t into = t; !kept && into != no_term; into = paths_.lessClosed(into))
                    kept = std::ranges::find(row, into, term_of) != row.end();
                if (!kept) sum.of[t] += static_cast<double>(gatherer_.areaM2(i) * stored);
            });
        }).of;
    for (uint32_t t = 0; t < terms; ++t) {
        series.reports[t].energy = energy[t];
        if (energy[t] > 0) series.reports[t].energy_dropped = dropped[t] / energy[t];
    }
    series.bounced = std::move(active);
}

// The mean of what the texels around in the same chart have (models' receivers: their own), where it is active.
SparseLight Activity::activeAround(const Series& series) const {
    const size_t texels = gatherer_.texels().size();
    return SparseLight::build(gatherer_.receiverCount(), [&](size_t begin, size_t end, auto emit) {
        TermAccumulator<glm::vec3> sum(paths_.termCount());
        std::vector<TermLight> row;
        for (size_t i = begin; i < end; ++i) {
            float count = 0;
            const Rounding rounding(i, Rounding::Of::Around);
            const auto add = [&](size_t receiver) {
                ++count;
                for (const TermLight& l : series.bounced.row(receiver)) sum[l.term] += l.value();
            };
            if (i < texels)
                forEachAround(i, add);
            else
                add(i);
            row.clear();
            for (const uint32_t t : sum.touched()) {
                const TermLight mean(t, sum[t] / count, rounding);
                if (series.active(t, 0, luminance(mean.value()), series.alwaysOnLux(i, t))) row.push_back(mean);
            }
            sum.clear();
            emit(std::span<const TermLight>(row));
        }
    });
}

// Charts that came with the level may hold islands that only the page has side by side.
bool Activity::nearInSpace(size_t a, size_t b) const {
    const Texels& texels = gatherer_.texels();
    const auto place = [&](size_t receiver) {
        return samplePoint(gatherer_.rays(), gatherer_.unwrap(), texels, receiver, 0).position_m;
    };
    const float size_m = std::sqrt(std::max(texels.area_m2[a], texels.area_m2[b]));
    return glm::distance(place(a), place(b)) <= around_texel_sizes * size_m;
}

void Activity::forEachAround(size_t texel, auto&& visit) const {
    for (int dy = -activity_reach; dy <= activity_reach; ++dy)
        for (int dx = -activity_reach; dx <= activity_reach; ++dx) {
            const uint32_t other = neighbourInChart(gatherer_.unwrap(), gatherer_.texels(), texel, dx, dy);
            if (other != no_index && nearInSpace(texel, other)) visit(other);
        }
}

// visit(receiver, term, direct, bounced, storable), luminances in lux, for every pair that has light. Storable is all
// of it but the direct light of lamps that a renderer draws itself.
void Activity::forEachPair(const Series& light, size_t begin, size_t end, auto&& visit) const {
    std::vector<float> direct(paths_.termCount()), bounced(direct), left_out(direct);
    std::vector<uint32_t> here;
    for (size_t i = begin; i < end; ++i) {
        here.clear();
        for (const TermLight& l : light.direct.row(i)) {
            direct[l.term] = luminance(l.value());
            here.push_back(l.term);
        }
        for (const TermLight& l : light.bounced.row(i)) {
            bounced[l.term] = luminance(l.value());
            here.push_back(l.term);
        }
        for (const TermLight& l : light.left_to_renderer.row(i)) left_out[l.term] = luminance(l.value());
        std::ranges::sort(here);
        here.erase(std::unique(here.begin(), here.end()), here.end());
        for (const uint32_t t : here) {
            visit(i, t, direct[t], bounced[t], std::max(0.0f, direct[t] - left_out[t]) + bounced[t]);
            direct[t] = bounced[t] = left_out[t] = 0;
        }
    }
}

bool isActive(const TermReport& report, uint32_t term, float direct_lux, float bounced_lux, float always_on_lux) {
    const float threshold = thresholdAt(report, always_on_lux);
    return term == always_group || (direct_lux > 0 && direct_lux >= threshold) ||
           (bounced_lux > 0 && bounced_lux >= threshold);
}

float Series::alwaysOnLux(size_t receiver, uint32_t term) const {
    float lux = 0;
    if (!(reports[term].share_of_always_on > 0)) return lux;
    for (const auto* part : {&direct, &bounced})
        for (const TermLight& l : part->row(receiver))
            if (l.term == group_of[term]) lux += luminance(l.value());
    return lux;
}

float Series::keepUpTo(size_t receiver, uint32_t term) const {
    float brightest = 0;
    for (const auto* part : {&direct, &bounced})
        for (const TermLight& l : part->row(receiver))
            if (l.term == term) brightest = std::max(brightest, luminance(l.value()));
    const TermReport& report = reports[term];
    float base = term == always_group ? 0 : threshold_base[term];
    if (report.threshold_lux > 0) base *= thresholdAt(report, alwaysOnLux(receiver, term)) / report.threshold_lux;
    return base > 0 ? brightest / base : std::numeric_limits<float>::infinity();
}

void Series::activeTerms(size_t receiver, std::vector<uint32_t>& terms) const {
    terms.assign(1, always_group);
    for (const auto* part : {&direct, &bounced})
        for (const TermLight& l : part->row(receiver))
            if (l.term != always_group && active(l.term, luminance(l.value()), 0, alwaysOnLux(receiver, l.term)))
                terms.push_back(l.term);
    std::ranges::sort(terms);
    terms.erase(std::unique(terms.begin(), terms.end()), terms.end());
}

}  // namespace dimmer::cook
