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

// One conjugate gradient for each of the 27 right-hand sides, side by side.
class Solver {
   public:
    Solver(std::span<const FitSite> sites, std::span<const float> own, size_t probes)
        : sites_(sites), diagonal_(probes, 0), prior_(probes, 1) {  // 1: of what counts nowhere, and stays as it is
        std::vector<float> squares(probes, 0);
        for (const FitSite& s : sites)
            for (size_t k = 0; k < 4; ++k) {
                diagonal_[s.probes[k]] += s.importance * s.shares[k] * s.shares[k];
                squares[s.probes[k]] += s.shares[k] * s.shares[k];
            }
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
        for (size_t i = 0; i < n; ++i) x[i] = Lanes(values[i]);
        for (size_t s = 0; s < sites_.size(); ++s) {
            Lanes missing(targets[s]);
            accumulate(missing, sites_[s], x, -1);
            scatter(missing, sites_[s], residual);
        }
        Lanes power;
        for (size_t i = 0; i < n; ++i)
            for (size_t c = 0; c < Lanes::count; ++c) {
                direction[i].v[c] = residual[i].v[c] / diagonal_[i];
                power.v[c] += residual[i].v[c] * direction[i].v[c];
            }
        const Lanes enough = powerOfTargets(targets, n, tolerance);
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
    // Below which a residual's power is at most `tolerance`, squared, of that of all light.
    Lanes powerOfTargets(std::span<const FitValue> targets, size_t n, float tolerance) const {
        Vector image(n);
        for (size_t s = 0; s < sites_.size(); ++s) scatter(Lanes(targets[s]), sites_[s], image);
        Lanes power;
        for (size_t i = 0; i < n; ++i)
            for (size_t c = 0; c < Lanes::count; ++c) power.v[c] += image[i].v[c] * image[i].v[c] / diagonal_[i];
        for (float& p : power.v) p *= tolerance * tolerance;
        return power;
    }
    static void accumulate(Lanes& sum, const FitSite& s, const Vector& x, float sign) {
        for (size_t k = 0; k < 4; ++k) sum.add(sign * s.shares[k], x[s.probes[k]]);
    }
    static void scatter(const Lanes& value, const FitSite& s, Vector& out) {
        for (size_t k = 0; k < 4; ++k) out[s.probes[k]].add(s.importance * s.shares[k], value);
    }
    void apply(const Vector& x, Vector& out) const {
        for (size_t i = 0; i < x.size(); ++i)
            for (size_t c = 0; c < Lanes::count; ++c) out[i].v[c] = prior_[i] * x[i].v[c];
        for (const FitSite& s : sites_) {
            Lanes sum;
            accumulate(sum, s, x, 1);
            scatter(sum, s, out);
        }
    }

    std::span<const FitSite> sites_;
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
