#include <probes/model_fit.h>

#include <bake/sampling.h>
#include <probes/envelope.h>
#include <probes/spherical_harmonics.h>

#include <algorithm>
#include <cmath>

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
constexpr double gain_min = 1e-4;  // of what there is to minimise

using Coefficients = std::vector<double>;
using Row = std::array<double, sh_count>;

// Irradiance on each normal, less the share of the mean that it has to be, as a row over a probe's coefficients.
const std::array<Row, asked_normals>& askedRows() {
    static const auto rows = [] {
        std::array<Row, asked_normals> out;
        for (uint32_t i = 0; i < asked_normals; ++i) {
            const glm::vec3 n = uniformSphereDirection(sequence2d(i, 0));
            std::ranges::copy(normalTransfer({n.x, n.y, n.z}).coefficients, out[i].begin());
            out[i][0] *= 1 - least_share;
        }
        return out;
    }();
    return rows;
}

class ModelFit {
   public:
    // `probes` as gathered: what they say of the places weighs these. The places' own light would not do: what noise
    // makes dark would count for more, and all would come out too dark.
    ModelFit(std::span<const ModelPlace> places, std::span<const ProbeLight> probes)
        : places_(places), probes_(probes.size()), squares_(envelopeOf(places, probes.size())) {
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

    void solve(std::span<const glm::vec3> lux, int channel, std::span<ProbeLight> probes) const {
        Coefficients target(size()), x(size());
        for (size_t i = 0; i < size(); ++i)
            target[i] =
                gathered_weight * scale_ * static_cast<double>(probes[i / sh_count].radiance[i % sh_count][channel]);
        for (size_t s = 0; s < places_.size(); ++s)
            forRow(s,
                   [&](size_t i, double a) { target[i] += importance_[s] * a * static_cast<double>(lux[s][channel]); });
        x = target;
        factor_.solve(x);
        minimise(target, x);
        for (size_t i = 0; i < size(); ++i)
            probes[i / sh_count].radiance[i % sh_count][channel] = static_cast<float>(x[i]);
    }

   private:
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

    static std::vector<size_t> envelopeOf(std::span<const ModelPlace> places, size_t probes) {
        std::vector<size_t> nearest(probes);
        for (size_t p = 0; p < probes; ++p) nearest[p] = p;
        for (const ModelPlace& place : places) {
            const auto& near = place.near.number;
            for (const uint32_t p : near) nearest[p] = std::min(nearest[p], size_t{std::ranges::min(near)});
        }
        std::vector<size_t> first;
        for (size_t i = 0; i < probes * sh_count; ++i) first.push_back(nearest[i / sh_count] * sh_count);
        return first;
    }

    void forRow(size_t s, auto&& visit) const {
        const ModelPlace& p = places_[s];
        for (size_t k = 0; k < 8; ++k)
            for (size_t c = 0; c < sh_count; ++c)
                visit(p.near.number[k] * sh_count + c,
                      static_cast<double>(p.near.share[k] * p.transfer.coefficients[c]));
    }

    void addPlace(size_t s) {
        forRow(s, [&](size_t i, double a) {
            forRow(s, [&](size_t j, double b) {
                if (j <= i) squares_.at(i, j) += importance_[s] * a * b;
            });
        });
    }

    static double negative(std::span<const double> x, size_t probe, const Row& row) {
        double e = 0;
        for (size_t c = 0; c < sh_count; ++c) e += row[c] * x[probe * sh_count + c];
        return std::min(e, 0.0);
    }
    double penalty(std::span<const double> x) const {
        double sum = 0;
        for (size_t p = 0; p < probes_; ++p)
            for (const Row& row : askedRows()) sum += negative(x, p, row) * negative(x, p, row);
        return 0.5 * negative_weight * scale_ * sum;
    }

    // 1/2 x.A x - target.x + the penalty, from the least of what comes before the penalty. Between changes of which
    // normals are negative it is a quadratic, of which each of Newton's steps finds the least.
    void minimise(std::span<const double> target, Coefficients& x) const {
        if (!(penalty(x) > 0)) return;
        Coefficients image(size()), step(size()), image_of_step(size()), trial(size());
        squares_.multiply(x, image);
        double value = penalty(x);
        for (size_t i = 0; i < size(); ++i) value += x[i] * (0.5 * image[i] - target[i]);
        for (int n = 0; n < newton_steps; ++n) {
            newton(target, x, step);
            squares_.multiply(step, image_of_step);
            double slope = 0, curvature = 0;
            for (size_t i = 0; i < size(); ++i) {
                slope += step[i] * (image[i] - target[i]);
                curvature += step[i] * image_of_step[i];
            }
            const double plain = value - penalty(x);
            double length = 1, next = value;
            for (int h = 0; h < halvings_max; ++h, length /= 2) {
                for (size_t i = 0; i < size(); ++i) trial[i] = x[i] + length * step[i];
                next = plain + length * (slope + 0.5 * length * curvature) + penalty(trial);
                if (next < value) break;
            }
            if (!(next < value)) return;
            for (size_t i = 0; i < size(); ++i) image[i] += length * image_of_step[i];
            x = trial;
            const double gain = value - next;
            value = next;
            if (gain <= gain_min * std::abs(value)) return;
        }
    }

    // From x to the least of the quadratic around it.
    void newton(std::span<const double> target, std::span<const double> x, Coefficients& step) const {
        EnvelopeMatrix hessian = squares_;
        for (size_t p = 0; p < probes_; ++p)
            for (const Row& row : askedRows()) {
                if (!(negative(x, p, row) < 0)) continue;
                for (size_t i = 0; i < sh_count; ++i)
                    for (size_t j = 0; j <= i; ++j)
                        hessian.at(p * sh_count + i, p * sh_count + j) += negative_weight * scale_ * row[i] * row[j];
            }
        hessian.factor();
        std::ranges::copy(target, step.begin());
        hessian.solve(step);
        for (size_t i = 0; i < size(); ++i) step[i] -= x[i];
    }

    std::span<const ModelPlace> places_;
    size_t probes_;
    EnvelopeMatrix squares_, factor_{{}};
    std::vector<double> importance_;
    double scale_ = 0;
};

}  // namespace

void fitModel(std::span<const ModelPlace> places, std::span<const glm::vec3> lux, std::span<ProbeLight> probes) {
    if (std::ranges::all_of(lux, [](glm::vec3 e) { return !(luminance(e) > 0); })) return;
    const ModelFit fit(places, probes);
    for (int channel = 0; channel < 3; ++channel) fit.solve(lux, channel, probes);
}

}  // namespace dimmer::cook
