#include <probes/fit.h>

#include <cstddef>

namespace dimmer::cook {
namespace {

// What is traced at a probe itself counts as much as this share of its sites.
constexpr float prior_share = 0.05f;
constexpr int steps_max = 24;  // some 3 digits, with neighbours coupled as closely as tetrahedra couple them

using Vector = std::vector<FitValue>;

// One conjugate gradient for each of the 27 right-hand sides, side by side.
class Solver {
   public:
    Solver(std::span<const FitSite> sites, size_t probes) : sites_(sites), diagonal_(probes, 0), prior_(probes) {
        for (const FitSite& s : sites)
            for (size_t k = 0; k < 4; ++k) diagonal_[s.probes[k]] += s.importance * s.shares[k] * s.shares[k];
        for (size_t i = 0; i < probes; ++i) {
            prior_[i] = diagonal_[i] > 0 ? prior_share * diagonal_[i] : 1;
            diagonal_[i] += prior_[i];
        }
    }

    void solve(std::span<const FitValue> targets, float tolerance, std::span<FitValue> x) const {
        const size_t n = x.size();
        Vector residual(n, FitValue{}), image(n), direction(n);
        for (size_t s = 0; s < sites_.size(); ++s) {
            FitValue missing = targets[s];
            accumulate(missing, sites_[s], x, -1);
            scatter(missing, sites_[s], residual);
        }
        FitValue power{};
        for (size_t i = 0; i < n; ++i)
            for (size_t c = 0; c < 27; ++c) {
                direction[i][c] = residual[i][c] / diagonal_[i];
                power[c] += residual[i][c] * direction[i][c];
            }
        const FitValue enough = powerOfTargets(targets, n, tolerance);
        const auto done = [&] {
            for (size_t c = 0; c < 27; ++c)
                if (power[c] > enough[c]) return false;
            return true;
        };
        for (int step = 0; step < steps_max && !done(); ++step) {
            apply(direction, image);
            FitValue curvature{}, next{};
            for (size_t i = 0; i < n; ++i)
                for (size_t c = 0; c < 27; ++c) curvature[c] += direction[i][c] * image[i][c];
            FitValue length;
            for (size_t c = 0; c < 27; ++c) length[c] = curvature[c] > 0 ? power[c] / curvature[c] : 0;
            for (size_t i = 0; i < n; ++i)
                for (size_t c = 0; c < 27; ++c) {
                    x[i][c] += length[c] * direction[i][c];
                    residual[i][c] -= length[c] * image[i][c];
                    next[c] += residual[i][c] * residual[i][c] / diagonal_[i];
                }
            for (size_t i = 0; i < n; ++i)
                for (size_t c = 0; c < 27; ++c) {
                    const float turn = power[c] > 0 ? next[c] / power[c] : 0;
                    direction[i][c] = residual[i][c] / diagonal_[i] + turn * direction[i][c];
                }
            power = next;
        }
    }

   private:
    // Below which a residual's power is at most `tolerance`, squared, of that of all light.
    FitValue powerOfTargets(std::span<const FitValue> targets, size_t n, float tolerance) const {
        Vector image(n, FitValue{});
        for (size_t s = 0; s < sites_.size(); ++s) scatter(targets[s], sites_[s], image);
        FitValue power{};
        for (size_t i = 0; i < n; ++i)
            for (size_t c = 0; c < 27; ++c) power[c] += image[i][c] * image[i][c] / diagonal_[i];
        for (float& p : power) p *= tolerance * tolerance;
        return power;
    }
    static void accumulate(FitValue& sum, const FitSite& s, std::span<const FitValue> x, float sign) {
        for (size_t k = 0; k < 4; ++k)
            for (size_t c = 0; c < 27; ++c) sum[c] += sign * s.shares[k] * x[s.probes[k]][c];
    }
    static void scatter(const FitValue& value, const FitSite& s, Vector& out) {
        for (size_t k = 0; k < 4; ++k)
            for (size_t c = 0; c < 27; ++c) out[s.probes[k]][c] += s.importance * s.shares[k] * value[c];
    }
    void apply(const Vector& x, Vector& out) const {
        for (size_t i = 0; i < x.size(); ++i)
            for (size_t c = 0; c < 27; ++c) out[i][c] = prior_[i] * x[i][c];
        for (const FitSite& s : sites_) {
            FitValue sum{};
            accumulate(sum, s, x, 1);
            scatter(sum, s, out);
        }
    }

    std::span<const FitSite> sites_;
    std::vector<float> diagonal_, prior_;
};

void replaceGuesses(std::span<const FitSite> sites, std::span<const FitValue> targets, std::span<const uint8_t> guessed,
                    std::span<FitValue> probes) {
    std::vector<FitValue> sums(probes.size(), FitValue{});
    std::vector<float> weights(probes.size(), 0);
    for (size_t s = 0; s < sites.size(); ++s)
        for (size_t k = 0; k < 4; ++k) {
            const uint32_t i = sites[s].probes[k];
            const float weight = sites[s].importance * sites[s].shares[k];
            if (!guessed[i] || !(weight > 0)) continue;
            weights[i] += weight;
            for (size_t c = 0; c < 27; ++c) sums[i][c] += weight * targets[s][c];
        }
    for (size_t i = 0; i < probes.size(); ++i)
        for (size_t c = 0; c < 27 && weights[i] > 0; ++c) probes[i][c] = sums[i][c] / weights[i];
}

}  // namespace

void fitProbes(std::span<const FitSite> sites, std::span<const FitValue> targets, std::span<FitValue> probes,
               float tolerance, std::span<const uint8_t> guessed) {
    if (!guessed.empty()) replaceGuesses(sites, targets, guessed, probes);
    Solver(sites, probes.size()).solve(targets, tolerance, probes);
}

}  // namespace dimmer::cook
