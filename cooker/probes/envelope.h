// Symmetric positive definite systems of blocks of which each couples with a few of the next ones (the envelope of
// Jennings 1966): a lattice's neighbours are near, so that most of a dense matrix is never touched.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace dimmer::cook {

class EnvelopeMatrix {
   public:
    static constexpr size_t block = 9;  // rows and columns: the coefficients of a probe

    // `last`: per block, the last one that it couples with, at least itself. All entries 0.
    explicit EnvelopeMatrix(std::vector<size_t> last) : last_(std::move(last)) {
        // What is eliminated couples all that it coupled with.
        for (size_t b = 1; b < last_.size(); ++b) last_[b] = std::max(last_[b], last_[b - 1]);
        begin_.push_back(0);
        for (size_t b = 0; b < last_.size(); ++b) begin_.push_back(begin_.back() + block * widthOf(b));
        entries_.resize(begin_.back());
    }

    size_t size() const { return last_.size() * block; }
    // On the diagonal or right of it, in the envelope. Entries in a block follow one another along its rows.
    double& at(size_t row, size_t column) { return rowAt(row)[column]; }

    // The matrix becomes the factor U of its Cholesky decomposition U^T U, with the inverses of its diagonal.
    void factor() {
        for (size_t b = 0; b < last_.size(); ++b) {
            const size_t first = b * block, end = endOf(b);
            for (size_t i = first; i < first + block; ++i) {
                double* const row = rowAt(i);
                for (size_t k = first; k < i; ++k) subtract(row, rowAt(k), rowAt(k)[i], i, end);
                row[i] = 1 / std::sqrt(row[i]);
                for (size_t j = i + 1; j < end; ++j) row[j] *= row[i];
            }
            for (size_t i = first + block; i < end; ++i) subtractBlock(rowAt(i), rowAt(first), widthOf(b), i, end);
        }
    }

    // Of a factor: x becomes the solution for the right-hand side x.
    void solve(std::span<double> x) const {
        for (size_t i = 0; i < size(); ++i) {
            const double* const row = rowAt(i);
            x[i] *= row[i];
            subtract(x.data(), row, x[i], i + 1, endOf(i / block));
        }
        for (size_t i = size(); i-- > 0;) {
            const double* const row = rowAt(i);
            x[i] = (x[i] - dot(row, x.data(), i + 1, endOf(i / block))) * row[i];
        }
    }

    // Of a matrix that is no factor: `out` becomes the product.
    void multiply(std::span<const double> x, std::span<double> out) const {
        std::ranges::fill(out, 0.0);
        for (size_t i = 0; i < size(); ++i) {
            const double* const row = rowAt(i);
            out[i] += dot(row, x.data(), i, endOf(i / block));
            subtract(out.data(), row, -x[i], i + 1, endOf(i / block));
        }
    }

   private:
    size_t endOf(size_t b) const { return (last_[b] + 1) * block; }
    size_t widthOf(size_t b) const { return endOf(b) - b * block; }
    // Indexed by column, from its block's first on.
    double* rowAt(size_t i) { return entries_.data() + offsetOf(i); }
    const double* rowAt(size_t i) const { return entries_.data() + offsetOf(i); }
    size_t offsetOf(size_t i) const {
        const size_t b = i / block;
        return begin_[b] + (i - b * block) * widthOf(b) - b * block;
    }

    static void subtract(double* __restrict out, const double* __restrict row, double factor, size_t from, size_t to) {
        for (size_t j = from; j < to; ++j) out[j] -= factor * row[j];
    }
    // What the rows of a block, `stride` apart, leave in row i.
    static void subtractBlock(double* __restrict out, const double* __restrict rows, size_t stride, size_t i,
                              size_t to) {
        std::array<double, block> factors;
        for (size_t r = 0; r < block; ++r) factors[r] = rows[r * stride + i];
        for (size_t j = i; j < to; ++j) {
            double sum = 0;
            for (size_t r = 0; r < block; ++r) sum += factors[r] * rows[r * stride + j];
            out[j] -= sum;
        }
    }
    // In lanes of their own, which compilers may not make of one sum.
    static double dot(const double* a, const double* b, size_t from, size_t to) {
        std::array<double, 8> lanes{};
        size_t i = from;
        for (; i + lanes.size() <= to; i += lanes.size())
            for (size_t l = 0; l < lanes.size(); ++l) lanes[l] += a[i + l] * b[i + l];
        double sum = 0;
        for (; i < to; ++i) sum += a[i] * b[i];
        for (const double l : lanes) sum += l;
        return sum;
    }

    std::vector<size_t> last_;   // ascending
    std::vector<size_t> begin_;  // of each block's rows
    std::vector<double> entries_;
};

}  // namespace dimmer::cook
