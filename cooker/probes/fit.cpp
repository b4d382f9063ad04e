#include <probes/fit.h>

#include <algorithm>
#include <cstddef>
#include <functional>

namespace dimmer::cook {
namespace {

// What is traced at a probe itself counts as much as this share of its sites at most.
constexpr float prior_share = 0.01f;
constexpr int steps_max = 24;  // some 3 digits, with neighbours coupled as closely as tetrahedra couple them

// A FitValue and zeros up to whole registers: most of a cook's fits is spent adding such up.
struct alignas(32) Lanes {
    static constexpr size_t count = 32;
    std::array<float, count> v{};

    Lanes() = default;
    explicit Lanes(const FitValue& value) { std::ranges::copy(value, v.begin()); }
    void add(float share, const Lanes& o) {
        for (size_t c = 0; c < count; ++c) v[c] += share * o.v[c];
    }
};
using Vector = std::vector<Lanes>;

// Per probe, ascending: the sites that it counts at, and as which of their four.
class CornersOfProbes {
   public:
    struct Corner {
        uint32_t site, number;
    };

    CornersOfProbes(std::span<const FitSite> sites, size_t probes) : first_(probes + 1, 0) {
        forEach(sites, [&](uint32_t probe, Corner) { ++first_[probe + 1]; });
        for (size_t i = 0; i < probes; ++i) first_[i + 1] += first_[i];
        corners_.resize(first_.back());
        std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
        forEach(sites, [&](uint32_t probe, Corner corner) { corners_[next[probe]++] = corner; });
    }
    std::span<const Corner> of(uint32_t probe) const {
        return std::span(corners_).subspan(first_[probe], first_[probe + 1] - first_[probe]);
    }

   private:
    static void forEach(std::span<const FitSite> sites, auto&& visit) {
        for (uint32_t s = 0; s < sites.size(); ++s)
            for (uint32_t k = 0; k < 4; ++k)
                if (sites[s].shares[k] > 0) visit(sites[s].probes[k], Corner{s, k});
    }

    std::vector<uint32_t> first_;  // per probe and one more, into corners_
    std::vector<Corner> corners_;
};

// One conjugate gradient for each of the 27 right-hand sides, side by side. Of the normal equations, with their matrix
// written out: there are several sites to a probe, and a probe has some fifteen neighbours, so that a step over rows
// moves an eighth of the bytes of one over sites.
class Solver {
   public:
    Solver(std::span<const FitSite> sites, std::span<const float> own, size_t probes)
        : sites_(sites), diagonal_(probes, 0) {
        std::vector<float> squares(probes, 0);
        for (const FitSite& s : sites)
            for (size_t k = 0; k < 4; ++k) {
                if (!(s.shares[k] > 0)) continue;
                diagonal_[s.probes[k]] += s.importance * s.shares[k] * s.shares[k];
                squares[s.probes[k]] += s.shares[k] * s.shares[k];
            }
        buildRows(probes);
        prior_.assign(probes, 1);  // of what counts nowhere, and stays as it is
        for (size_t i = 0; i < probes; ++i) {
            const bool known = !own.empty() && own[i] > 0;
            if (diagonal_[i] > 0)
                prior_[i] = prior_share * (known ? std::min(diagonal_[i], own[i] * squares[i]) : diagonal_[i]);
            diagonal_[i] += prior_[i];
        }
    }

    void solve(std::span<const FitValue> targets, float tolerance, std::span<FitValue> values) const {
        const size_t n = values.size();
        Vector x(n), residual(n), image(n), direction(n);
        for (size_t s = 0; s < sites_.size(); ++s) scatter(Lanes(targets[s]), sites_[s], residual);
        const Lanes enough = powerOfTargets(residual, tolerance);
        for (size_t i = 0; i < n; ++i) x[i] = Lanes(values[i]);
        for (size_t i = 0; i < n; ++i) addRow(i, residual[i], x, -1);
        Lanes power;
        for (size_t i = 0; i < n; ++i)
            for (size_t c = 0; c < Lanes::count; ++c) {
                direction[i].v[c] = residual[i].v[c] / diagonal_[i];
                power.v[c] += residual[i].v[c] * direction[i].v[c];
            }
        const auto done = [&] { return std::ranges::equal(power.v, enough.v, std::less_equal<>()); };
        for (int step = 0; step < steps_max && !done(); ++step) {
            apply(direction, image);
            Lanes curvature, next, length, turn;
            for (size_t i = 0; i < n; ++i)
                for (size_t c = 0; c < Lanes::count; ++c) curvature.v[c] += direction[i].v[c] * image[i].v[c];
            for (size_t c = 0; c < Lanes::count; ++c)
                length.v[c] = curvature.v[c] > 0 ? power.v[c] / curvature.v[c] : 0;
            for (size_t i = 0; i < n; ++i)
                for (size_t c = 0; c < Lanes::count; ++c) {
                    x[i].v[c] += length.v[c] * direction[i].v[c];
                    residual[i].v[c] -= length.v[c] * image[i].v[c];
                    next.v[c] += residual[i].v[c] * residual[i].v[c] / diagonal_[i];
                }
            for (size_t c = 0; c < Lanes::count; ++c) turn.v[c] = power.v[c] > 0 ? next.v[c] / power.v[c] : 0;
            for (size_t i = 0; i < n; ++i)
                for (size_t c = 0; c < Lanes::count; ++c)
                    direction[i].v[c] = residual[i].v[c] / diagonal_[i] + turn.v[c] * direction[i].v[c];
            power = next;
        }
        for (size_t i = 0; i < n; ++i) std::copy_n(x[i].v.begin(), values[i].size(), values[i].begin());
    }

   private:
    struct Entry {
        uint32_t probe;
        float weight;
    };

    // Rows of the matrix, without their priors: a row at a time, so that where a neighbour's entry is can be looked up.
    void buildRows(size_t probes) {
        const CornersOfProbes corners(sites_, probes);
        std::vector<uint32_t> entry_of(probes, 0);  // in the row at hand, where it is one of its
        rows_.reserve(probes + 1);
        for (uint32_t i = 0; i < probes; ++i) {
            const size_t first = entries_.size();
            rows_.push_back(first);
            const auto add = [&](uint32_t probe, float weight) {
                uint32_t& entry = entry_of[probe];
                if (entry < first || entry >= entries_.size() || entries_[entry].probe != probe) {
                    entry = static_cast<uint32_t>(entries_.size());
                    entries_.push_back({probe, weight});
                } else {
                    entries_[entry].weight += weight;
                }
            };
            add(i, 0);
            for (const auto& [site, k] : corners.of(i)) {
                const FitSite& s = sites_[site];
                for (size_t o = 0; o < 4; ++o)
                    if (s.shares[o] > 0) add(s.probes[o], s.importance * s.shares[k] * s.shares[o]);
            }
        }
        rows_.push_back(entries_.size());
    }
    void addRow(size_t i, Lanes& sum, const Vector& x, float sign) const {
        for (size_t e = rows_[i]; e < rows_[i + 1]; ++e) sum.add(sign * entries_[e].weight, x[entries_[e].probe]);
    }

    // Below which a residual's power is at most `tolerance`, squared, of that of all light.
    Lanes powerOfTargets(const Vector& image, float tolerance) const {
        Lanes power;
        for (size_t i = 0; i < image.size(); ++i)
            for (size_t c = 0; c < Lanes::count; ++c) power.v[c] += image[i].v[c] * image[i].v[c] / diagonal_[i];
        for (float& p : power.v) p *= tolerance * tolerance;
        return power;
    }
    static void scatter(const Lanes& value, const FitSite& s, Vector& out) {
        for (size_t k = 0; k < 4; ++k) out[s.probes[k]].add(s.importance * s.shares[k], value);
    }
    void apply(const Vector& x, Vector& out) const {
        for (size_t i = 0; i < x.size(); ++i) {
            Lanes sum;
            sum.add(prior_[i], x[i]);
            addRow(i, sum, x, 1);
            out[i] = sum;
        }
    }

    std::span<const FitSite> sites_;
    std::vector<size_t> rows_;  // where each begins in entries_, and the end
    std::vector<Entry> entries_;
    std::vector<float> diagonal_, prior_;
};

void replaceGuesses(std::span<const FitSite> sites, std::span<const FitValue> targets, std::span<const float> own,
                    std::span<FitValue> probes) {
    std::vector<FitValue> sums(probes.size(), FitValue{});
    std::vector<float> weights(probes.size(), 0);
    for (size_t s = 0; s < sites.size(); ++s)
        for (size_t k = 0; k < 4; ++k) {
            const uint32_t i = sites[s].probes[k];
            const float weight = sites[s].importance * sites[s].shares[k];
            if (own[i] > 0 || !(weight > 0)) continue;
            weights[i] += weight;
            for (size_t c = 0; c < 27; ++c) sums[i][c] += weight * targets[s][c];
        }
    for (size_t i = 0; i < probes.size(); ++i)
        for (size_t c = 0; c < 27 && weights[i] > 0; ++c) probes[i][c] = sums[i][c] / weights[i];
}

}  // namespace

void fitProbes(std::span<const FitSite> sites, std::span<const FitValue> targets, std::span<FitValue> probes,
               float tolerance, std::span<const float> own) {
    if (!own.empty()) replaceGuesses(sites, targets, own, probes);
    Solver(sites, own, probes.size()).solve(targets, tolerance, probes);
}

}  // namespace dimmer::cook
