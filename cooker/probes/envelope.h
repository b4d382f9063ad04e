// Symmetric positive definite systems of which each row's entries begin somewhere before its diagonal (the envelope of
// Jennings 1966): a lattice's neighbours are near, so that most of a dense matrix is never touched.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace dimmer::cook {

class EnvelopeMatrix {
   public:
    // `first`: per row, the column of its first entry, at most the row's own number. All entries 0.
    explicit EnvelopeMatrix(std::vector<size_t> first) : first_(std::move(first)), begin_(first_.size() + 1) {
        for (size_t i = 0; i < size(); ++i) begin_[i + 1] = begin_[i] + i + 1 - first_[i];
        entries_.resize(begin_.back());
    }

    size_t size() const { return first_.size(); }
    // Below the diagonal or on it, in the envelope.
    double& at(size_t row, size_t column) { return entries_[begin_[row] + column - first_[row]]; }

    // The matrix becomes the factor L of its Cholesky decomposition L L^T, with the inverses of its diagonal.
    void factor() {
        for (size_t i = 0; i < size(); ++i) {
            double* const row = rowAt(i);
            for (size_t j = first_[i]; j < i; ++j) row[j] = (row[j] - product(i, j)) * rowAt(j)[j];
            row[i] = 1 / std::sqrt(row[i] - product(i, i));
        }
    }

    // Of a factor: x becomes the solution for the right-hand side x.
    void solve(std::span<double> x) const {
        for (size_t i = 0; i < size(); ++i)
            x[i] = (x[i] - dot(rowAt(i) + first_[i], &x[first_[i]], i - first_[i])) * rowAt(i)[i];
        for (size_t i = size(); i-- > 0;) {
            x[i] *= rowAt(i)[i];
            for (size_t j = first_[i]; j < i; ++j) x[j] -= rowAt(i)[j] * x[i];
        }
    }

    // Of a matrix that is no factor: `out` becomes the product.
    void multiply(std::span<const double> x, std::span<double> out) const {
        for (size_t i = 0; i < size(); ++i) {
            const double* const row = rowAt(i);
            out[i] = dot(row + first_[i], &x[first_[i]], i + 1 - first_[i]);
            for (size_t j = first_[i]; j < i; ++j) out[j] += row[j] * x[i];
        }
    }

   private:
    // Indexed by column.
    double* rowAt(size_t i) { return entries_.data() + begin_[i] - first_[i]; }
    const double* rowAt(size_t i) const { return entries_.data() + begin_[i] - first_[i]; }
    // Of the parts of two rows left of column j, j <= i.
    double product(size_t i, size_t j) const {
        const size_t from = std::max(first_[i], first_[j]);
        return from < j ? dot(rowAt(i) + from, rowAt(j) + from, j - from) : 0;
    }
    // In lanes of their own, which compilers may not make of one sum.
    static double dot(const double* a, const double* b, size_t n) {
        std::array<double, 8> lanes{};
        size_t i = 0;
        for (; i + lanes.size() <= n; i += lanes.size())
            for (size_t l = 0; l < lanes.size(); ++l) lanes[l] += a[i + l] * b[i + l];
        double sum = 0;
        for (; i < n; ++i) sum += a[i] * b[i];
        for (const double l : lanes) sum += l;
        return sum;
    }

    std::vector<size_t> first_, begin_;
    std::vector<double> entries_;
};

}  // namespace dimmer::cook
