#include <probes/model_fit.h>

#include <bake/sampling.h>
#include <probes/envelope.h>
#include <probes/spherical_harmonics.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace dimmer::cook {
namespace {

// Of the mean over the places, below which light need not be exact to a share of itself.
constexpr double light_floor = 0.1;
// Weights, in means of the diagonal of the places' least squares: of the distance from what was gathered at probes, and
// of negative irradiance.
constexpr double gathered_weight = 0.1, negative_weight = 100;
// Irradiance is asked on so many normals to be at least this share of its mean: between them it is a little less.
constexpr uint32_t asked_normals = 128;
constexpr double least_share = 0.05;
constexpr int newton_steps = 40, halvings_max = 20;
constexpr double gain_min = 1e-6;  // of what there is to minimise

static_assert(EnvelopeMatrix::block == sh_count);

using Coefficients = std::vector<double>;
using Square = std::array<std::array<double, sh_count>, sh_count>;
// Of a probe, on each normal.
using Asked = std::array<double, asked_normals>;

// Irradiance on each normal, less the share of the mean that it has to be: what each of a probe's coefficients brings.
const std::array<Asked, sh_count>& askedOfCoefficients() {
    static const auto asked = [] {
        std::array<Asked, sh_count> out;
        for (uint32_t i = 0; i < asked_normals; ++i) {
            const glm::vec3 n = uniformSphereDirection(sequence2d(i, 0));
            const auto transfer = normalTransfer({n.x, n.y, n.z});
            for (size_t c = 0; c < sh_count; ++c) out[c][i] = static_cast<double>(transfer.coefficients[c]);
            out[0][i] *= 1 - least_share;
        }
        return out;
    }();
    return asked;
}

class ModelFit {
   public:
    // `probes` as gathered: what they say of the places weighs these. The places' own light would not do: what noise
    // makes dark would count for more, and all would come out too dark.
    ModelFit(std::span<const ModelPlace> places, std::span<const ProbeLight> probes, glm::uvec3 lattice)
        : places_(places), probes_(probes.size()), block_(shortestAxisFirst(lattice)), squares_(envelope()) {
        double mean = 0;
        for (const ModelPlace& p : places) {
            importance_.push_back(readAt(p, probes));
            mean += importance_.back() / static_cast<double>(places.size());
        }
        for (double& i : importance_) i = mean > 0 ? mean / (i + light_floor * mean) : 1;
        for (size_t s = 0; s < places.size(); ++s) addPlace(s);
        for (size_t i = 0; i < size(); ++i) scale_ += squares_.at(i, i) / static_cast<double>(size());
        for (size_t i = 0; i < size(); ++i) squares_.at(i, i) += gathered_weight * scale_;
        factor_ = squares_;
        factor_.factor();
    }

    // Where irradiance is negative is alike in all channels: each begins with what the one before it ended with.
    void solve(std::span<const glm::vec3> lux, std::span<ProbeLight> probes) const {
        Lack lack{std::vector<Asked>(probes_), 0};
        for (int channel = 0; channel < 3; ++channel) {
            const Coefficients target = targetOf(lux, channel, probes);
            Coefficients x = leastAround(lack, target);
            minimise(target, x, lack);
            for (size_t p = 0; p < probes_; ++p)
                for (size_t c = 0; c < sh_count; ++c)
                    probes[p].radiance[c][channel] = static_cast<float>(x[block_[p] * sh_count + c]);
        }
    }

   private:
    // Irradiance of each probe where it is negative, 0 elsewhere, and what that costs.
    struct Lack {
        std::vector<Asked> irradiance;
        double cost;
    };

    size_t size() const { return probes_ * sh_count; }

    // Luminance of the irradiance.
    static double readAt(const ModelPlace& place, std::span<const ProbeLight> probes) {
        float lux = 0;
        for (size_t k = 0; k < 8; ++k)
            for (size_t c = 0; c < sh_count; ++c)
                lux += place.near.share[k] * place.transfer.coefficients[c] *
                       luminance(probes[place.near.number[k]].radiance[c]);
        return std::max(static_cast<double>(lux), 0.0);
    }

    // Of each probe: next to one another along the shortest axis, so that all neighbours are near.
    static std::vector<size_t> shortestAxisFirst(glm::uvec3 lattice) {
        std::array<int, 3> axes{0, 1, 2};
        std::ranges::stable_sort(axes, {}, [&](int axis) { return lattice[axis]; });
        glm::uvec3 step(1);
        step[axes[1]] = lattice[axes[0]], step[axes[2]] = lattice[axes[0]] * lattice[axes[1]];
        std::vector<size_t> blocks;
        for (uint32_t z = 0; z < lattice.z; ++z)
            for (uint32_t y = 0; y < lattice.y; ++y)
                for (uint32_t x = 0; x < lattice.x; ++x) blocks.push_back(x * step.x + y * step.y + z * step.z);
        return blocks;
    }

    std::vector<size_t> envelope() const {
        std::vector<size_t> last(probes_);
        for (size_t b = 0; b < probes_; ++b) last[b] = b;
        for (const ModelPlace& place : places_)
            for (const uint32_t p : place.near.number)
                for (const uint32_t q : place.near.number) last[block_[p]] = std::max(last[block_[p]], block_[q]);
        return last;
    }

    void forRow(size_t s, auto&& visit) const {
        const ModelPlace& p = places_[s];
        for (size_t k = 0; k < 8; ++k)
            for (size_t c = 0; c < sh_count; ++c)
                visit(block_[p.near.number[k]] * sh_count + c,
                      static_cast<double>(p.near.share[k] * p.transfer.coefficients[c]));
    }

    void addPlace(size_t s) {
        const ModelPlace& place = places_[s];
        Square square;
        for (size_t c = 0; c < sh_count; ++c)
            for (size_t d = 0; d < sh_count; ++d)
                square[c][d] = importance_[s] * static_cast<double>(place.transfer.coefficients[c]) *
                               static_cast<double>(place.transfer.coefficients[d]);
        for (size_t k = 0; k < 8; ++k)
            for (size_t l = 0; l < 8; ++l) {
                const size_t row = block_[place.near.number[k]], column = block_[place.near.number[l]];
                const double share =
                    static_cast<double>(place.near.share[k]) * static_cast<double>(place.near.share[l]);
                if (row > column || share == 0) continue;
                for (size_t c = 0; c < sh_count; ++c) {
                    double* const at = &squares_.at(row * sh_count + c, column * sh_count);
                    for (size_t d = 0; d < sh_count; ++d) at[d] += share * square[c][d];
                }
            }
    }

    Coefficients targetOf(std::span<const glm::vec3> lux, int channel, std::span<const ProbeLight> probes) const {
        Coefficients target(size());
        for (size_t p = 0; p < probes_; ++p)
            for (size_t c = 0; c < sh_count; ++c)
                target[block_[p] * sh_count + c] =
                    gathered_weight * scale_ * static_cast<double>(probes[p].radiance[c][channel]);
        for (size_t s = 0; s < places_.size(); ++s) {
            const double light = importance_[s] * static_cast<double>(lux[s][channel]);
            forRow(s, [&](size_t i, double a) { target[i] += a * light; });
        }
        return target;
    }

    void findLack(std::span<const double> x, Lack& lack) const {
        const auto& asked = askedOfCoefficients();
        std::array<double, 8> lanes{};  // which compilers may not make of one sum
        for (size_t p = 0; p < probes_; ++p) {
            Asked e{};
            for (size_t c = 0; c < sh_count; ++c)
                for (size_t n = 0; n < asked_normals; ++n) e[n] += asked[c][n] * x[p * sh_count + c];
            for (double& one : e) one = std::min(one, 0.0);
            for (size_t n = 0; n < asked_normals; n += lanes.size())
                for (size_t l = 0; l < lanes.size(); ++l) lanes[l] += e[n + l] * e[n + l];
            lack.irradiance[p] = e;
        }
        lack.cost = 0.5 * negative_weight * scale_ * std::accumulate(lanes.begin(), lanes.end(), 0.0);
    }

    // 1/2 x.A x - target.x + the lack's cost. Between changes of which normals are negative it is a quadratic, of which
    // each of Newton's steps finds the least: the sum's own, where the same normals are negative there.
    void minimise(std::span<const double> target, Coefficients& x, Lack& lack) const {
        Coefficients image(size()), step(size()), image_of_step(size()), trial(size());
        Lack of_trial = lack;
        squares_.multiply(x, image);
        findLack(x, lack);
        double plain = 0;  // without the cost
        for (size_t i = 0; i < size(); ++i) plain += x[i] * (0.5 * image[i] - target[i]);
        for (int n = 0; n < newton_steps; ++n) {
            const Coefficients least = leastAround(lack, target);
            for (size_t i = 0; i < size(); ++i) step[i] = least[i] - x[i];
            squares_.multiply(step, image_of_step);
            double slope = 0, curvature = 0;
            for (size_t i = 0; i < size(); ++i) {
                slope += step[i] * (image[i] - target[i]);
                curvature += step[i] * image_of_step[i];
            }
            double length = 1, change = 0, gain = 0;
            for (int h = 0; h < halvings_max && !(gain > 0); ++h) {
                if (h > 0) length /= 2;
                for (size_t i = 0; i < size(); ++i) trial[i] = x[i] + length * step[i];
                findLack(trial, of_trial);
                change = length * (slope + 0.5 * length * curvature);
                gain = lack.cost - of_trial.cost - change;
            }
            if (!(gain > 0)) return;
            const bool found = length == 1 && haveSameNormals(lack, of_trial);
            for (size_t i = 0; i < size(); ++i) image[i] += length * image_of_step[i];
            std::swap(x, trial);
            std::swap(lack, of_trial);
            plain += change;
            if (found || gain <= gain_min * std::abs(plain + lack.cost)) return;
        }
    }

    static bool haveSameNormals(const Lack& a, const Lack& b) {
        for (size_t p = 0; p < a.irradiance.size(); ++p)
            for (size_t n = 0; n < asked_normals; ++n)
                if ((a.irradiance[p][n] < 0) != (b.irradiance[p][n] < 0)) return false;
        return true;
    }

    // Where the quadratic has its least that is so negative on just these normals.
    Coefficients leastAround(const Lack& lack, std::span<const double> target) const {
        Coefficients x(target.begin(), target.end());
        if (!(lack.cost > 0)) {
            factor_.solve(x);
            return x;
        }
        EnvelopeMatrix hessian = squares_;
        for (size_t p = 0; p < probes_; ++p) {
            const Square square = squareOfNegative(lack.irradiance[p]);
            for (size_t c = 0; c < sh_count; ++c)
                for (size_t d = c; d < sh_count; ++d)
                    hessian.at(p * sh_count + c, p * sh_count + d) += negative_weight * scale_ * square[c][d];
        }
        hessian.factor();
        hessian.solve(x);
        return x;
    }

    static Square squareOfNegative(const Asked& irradiance) {
        const auto& asked = askedOfCoefficients();
        Square square{};
        for (size_t n = 0; n < asked_normals; ++n) {
            if (!(irradiance[n] < 0)) continue;
            std::array<double, sh_count> row;
            for (size_t c = 0; c < sh_count; ++c) row[c] = asked[c][n];
            for (size_t c = 0; c < sh_count; ++c)
                for (size_t d = 0; d < sh_count; ++d) square[c][d] += row[c] * row[d];
        }
        return square;
    }

    std::span<const ModelPlace> places_;
    size_t probes_;
    std::vector<size_t> block_;  // of each probe, in the matrices
    EnvelopeMatrix squares_, factor_{{}};
    std::vector<double> importance_;
    double scale_ = 0;
};

}  // namespace

void fitModel(std::span<const ModelPlace> places, std::span<const glm::vec3> lux, std::span<ProbeLight> probes,
              glm::uvec3 lattice) {
    if (std::ranges::all_of(lux, [](glm::vec3 e) { return !(luminance(e) > 0); })) return;
    const ModelFit fit(places, probes, lattice);
    fit.solve(lux, probes);
}

}  // namespace dimmer::cook
