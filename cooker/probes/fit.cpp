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

// One conjugate gradient for each of the 27 right-hand sides, side by side. Of the normal equations, with their matrix
// written out: there are several sites to a probe, and a probe has some fifteen neighbours, so that a step over rows
// moves an eighth of the bytes of one over sites.
class Solver {
   public:
    Solver(std::span<const FitSite> sites, std::span<const float> own, size_t probes)
        : sites_(sites), rows_(probes), diagonal_(probes, 0) {
        for (uint32_t i = 0; i < probes; ++i) rows_[i].add(i, 0);  // found first from now on
        std::vector<float> squares(probes, 0);
        for (const FitSite& s : sites)
            for (size_t k = 0; k < 4; ++k) {
                if (!(s.shares[k] > 0)) continue;
                for (size_t o = 0; o < 4; ++o)
                    if (s.shares[o] > 0) rows_[s.probes[k]].add(s.probes[o], s.importance * s.shares[k] * s.shares[o]);
                diagonal_[s.probes[k]] += s.importance * s.shares[k] * s.shares[k];
                squares[s.probes[k]] += s.shares[k] * s.shares[k];
            }
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
        for (size_t i = 0; i < n; ++i) rows_[i].addTo(residual[i], x, -1);
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
    // A probe's row of the matrix, without its prior.
    struct MatrixRow {
        std::vector<uint32_t> probes;
        std::vector<float> weights;

        void add(uint32_t probe, float weight) {
            const auto found = std::ranges::find(probes, probe);
            if (found != probes.end()) {
                weights[static_cast<size_t>(found - probes.begin())] += weight;
                return;
            }
            probes.push_back(probe);
            weights.push_back(weight);
        }
        void addTo(Lanes& sum, const Vector& x, float sign) const {
            for (size_t k = 0; k < probes.size(); ++k) sum.add(sign * weights[k], x[probes[k]]);
        }
    };

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
            rows_[i].addTo(sum, x, 1);
            out[i] = sum;
        }
    }

    std::span<const FitSite> sites_;
    std::vector<MatrixRow> rows_;
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
