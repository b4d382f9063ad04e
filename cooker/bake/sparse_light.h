// Light per receiver and term (bake/door_paths.h), stored only where there is some.
#pragma once

#include <bake/door_paths.h>
#include <bake/sampling.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cfloat>
#include <cstdint>
#include <cstring>
#include <functional>
#include <glm/glm.hpp>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace dimmer::cook {

// What the last bits of light at a receiver are decided by. The same for all terms and bounces, so that more light is
// never held to be less, and none depends on what else is baked. But another for each kind of light: what was rounded
// and is rounded again by the same would no longer be right in the mean. (An accelerated bounce takes a little of the
// light of two rounds ago along, so rounded: a hundredth of a percent.)
class Rounding {
   public:
    enum class Of : uint32_t { Direct, Bounced, Outgoing, Around, BlockDirect, BlockBounced, BlockOutgoing };
    Rounding(size_t receiver, Of of) {
        for (uint32_t c = 0; c < 3; ++c)
            bits_[c] = hash(static_cast<uint32_t>(receiver), 3 * static_cast<uint32_t>(of) + c);
    }
    uint32_t operator[](size_t channel) const { return bits_[channel]; }

   private:
    std::array<uint32_t, 3> bits_;
};

// Light of one term at a receiver, in 8 bytes: a bake holds some dozens for each texel, and rays read them wherever
// they end. Of each channel's float the sign and the lower half are left out, after it was rounded at random up or
// down, in proportion to how near that is: off by a quarter of a percent (standard deviation), by nothing in the mean
// over receivers.
struct TermLight {
    static constexpr uint32_t term_bits = 19, channel_bits = 15;

    TermLight() = default;
    // `value`: irradiance in lux, or radiance in cd/m2, by context; below 0 counts as 0.
    TermLight(uint32_t term_number, glm::vec3 value, const Rounding& rounding)
        : term(term_number),
          red(rounded(value.x, rounding[0])),
          green(rounded(value.y, rounding[1])),
          blue(rounded(value.z, rounding[2])) {
        assert(term == term_number);
    }

    uint64_t term : term_bits = 0;
    uint64_t red : channel_bits = 0, green : channel_bits = 0, blue : channel_bits = 0;

    glm::vec3 value() const {
        const Four light = four();
        return {light[0], light[1], light[2]};
    }
    // The same light in another term.
    TermLight in(uint32_t other) const {
        TermLight light = *this;
        light.term = other;
        return light;
    }

    // value(), and a 0.
    using Four [[gnu::vector_size(16)]] = float;
    Four four() const {
        using Longs [[gnu::vector_size(32)]] = uint64_t;
        using Words [[gnu::vector_size(32)]] = uint32_t;
        // Each channel where a float has its upper half, in the lower word of a lane.
        constexpr uint32_t upper = 16, first = term_bits - upper;
        const auto bits = std::bit_cast<uint64_t>(*this);
        const Longs lanes =
            (Longs{bits, bits, bits, bits} >> Longs{first, first + channel_bits, first + 2 * channel_bits, 63}) &
            (uint64_t{0x7fff} << upper);
        Words words;
        std::memcpy(&words, &lanes, sizeof words);  // bit_cast would return what not every processor has registers for
        return std::bit_cast<Four>(__builtin_shufflevector(words, words, 0, 2, 4, 6));
    }

   private:
    static uint16_t rounded(float value, uint32_t random) {
        const auto bits = std::bit_cast<uint32_t>(value < 0 ? 0.0f : value);
        constexpr uint32_t half = 0xffff, largest = std::bit_cast<uint32_t>(FLT_MAX) & ~half;
        return static_cast<uint16_t>((bits < largest ? bits + (random & half) : bits & 0x7fffffff) >> 16);
    }
};
static_assert(sizeof(TermLight) == 8);
// Terms that a bake can tell apart.
inline constexpr uint32_t terms_max = 1u << TermLight::term_bits;

// The unit of parallel work: small enough to share out, large enough to keep scratch memory warm.
inline constexpr size_t rows_per_block = 256;
inline size_t blockCount(size_t rows) {
    return (rows + rows_per_block - 1) / rows_per_block;
}

// visit(begin, end) for every block, in parallel.
template <class Visit>
void forEachBlock(size_t rows, Visit&& visit) {
    tbb::parallel_for(size_t{0}, blockCount(rows),
                      [&](size_t b) { visit(b * rows_per_block, std::min(rows, (b + 1) * rows_per_block)); });
}

// Compressed rows: row i holds the terms that reach receiver i, ascending. Each block of rows has memory of its own:
// they are filled in parallel, and never copied into one.
template <class Entry>
class Sparse {
   public:
    std::span<const Entry> row(size_t i) const {
        const size_t begin = i % rows_per_block == 0 ? 0 : ends_[i];
        return {blocks_[i / rows_per_block].data() + begin, ends_[i + 1] - begin};
    }
    // Whether a row has entries, from a bit of it: of a light set alone most rows have none, and rays end anywhere.
    bool any(size_t i) const { return any_[i / rows_per_word] >> i % rows_per_word & 1; }
    // Begins to load a row that is asked for soon.
    void prefetch(size_t i) const {
        if (!any(i)) return;
        constexpr size_t line_bytes = 64, lines_max = 4;
        const std::span<const Entry> entries = row(i);
        const auto* line = reinterpret_cast<const char*>(entries.data());
        const auto* end = reinterpret_cast<const char*>(entries.data() + entries.size());
        for (size_t n = 0; n < lines_max && line < end; ++n, line += line_bytes) __builtin_prefetch(line);
    }
    size_t rows() const { return ends_.size() - 1; }
    size_t entryCount() const {
        size_t count = 0;
        for (const auto& block : blocks_) count += block.size();
        return count;
    }

    // Gives back the memory of a row's block, of which nobody reads any row again (any() still says what it had).
    void dropBlock(size_t row) { blocks_[row / rows_per_block] = {}; }

    // change(entry) for every entry, in parallel.
    void forEach(auto&& change) {
        tbb::parallel_for(size_t{0}, blocks_.size(), [&](size_t b) {
            for (Entry& entry : blocks_[b]) change(entry);
        });
    }

    // change(i, entries) for every row, in parallel.
    void forEachRow(auto&& change) {
        forEachBlock(rows(), [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i) change(i, rowIn(blocks_[begin / rows_per_block], i));
        });
    }

    // Fills rows anew, in parallel, from what all of them were: fill(begin, end, rowOf) for each block, where rowOf(i)
    // are the entries of row i to begin with and may be changed, and row() is as it was. `last_reader`: per block, the
    // last one whose rows are made from its own. After that it is replaced: only what lies in between is there twice.
    template <class Fill>
    void rewrite(std::span<const uint32_t> last_reader, Fill&& fill) {
        constexpr size_t blocks_at_once = 256;
        std::vector<std::vector<Entry>> fresh(blocks_.size());
        std::vector<uint32_t> replaced(blocks_.size());  // in this order
        std::iota(replaced.begin(), replaced.end(), 0u);
        std::ranges::stable_sort(replaced, {}, [&](uint32_t b) { return std::max(b, last_reader[b]); });
        auto next = replaced.begin();
        for (size_t first = 0; first < blocks_.size(); first += blocks_at_once) {
            const size_t last = std::min(first + blocks_at_once, blocks_.size());
            tbb::parallel_for(first, last, [&](size_t b) {
                fresh[b] = blocks_[b];
                const size_t begin = b * rows_per_block, end = std::min(begin + rows_per_block, rows());
                fill(begin, end, [&](size_t i) { return rowIn(fresh[b], i); });
            });
            for (; next != replaced.end() && (std::max(*next, last_reader[*next]) < last || last == blocks_.size());
                 ++next)
                blocks_[*next] = std::exchange(fresh[*next], {});
        }
    }

    // Collects rows block by block; blocks may be filled in parallel, the result does not depend on how.
    class Builder {
       public:
        explicit Builder(size_t rows) {
            out_.ends_ = std::vector<uint32_t>(rows + 1);
            out_.any_ = std::vector<uint64_t>(rows / rows_per_word + 1);
            out_.blocks_ = std::vector<std::vector<Entry>>(blockCount(rows));
        }

        // Rows of one block must come in order; those left out are empty.
        void put(size_t row, std::span<const Entry> entries) {
            auto& block = out_.blocks_[row / rows_per_block];
            block.insert(block.end(), entries.begin(), entries.end());
            out_.ends_[row + 1] = static_cast<uint32_t>(block.size());
        }

        // No more comes of a row's block: gives back what memory it does not need.
        void close(size_t row) { out_.blocks_[row / rows_per_block].shrink_to_fit(); }

        Sparse finish() {
            forEachBlock(out_.rows(), [&](size_t begin, size_t end) {
                close(begin);
                uint32_t last = 0;
                for (size_t i = begin; i < end; ++i) {
                    uint32_t& at = out_.ends_[i + 1];
                    out_.any_[i / rows_per_word] |= uint64_t{at > last} << i % rows_per_word;
                    last = at = std::max(at, last);
                }
            });
            return std::move(out_);
        }

       private:
        Sparse out_;
    };

    // `fill(begin, end, emit)` calls emit(entries) once for every row of its range, in order. Ranges run in parallel.
    template <class Fill>
    static Sparse build(size_t rows, Fill&& fill) {
        Builder builder(rows);
        forEachBlock(rows, [&](size_t begin, size_t end) {
            size_t row = begin;
            fill(begin, end, [&](std::span<const Entry> entries) { builder.put(row++, entries); });
            builder.close(begin);
        });
        return builder.finish();
    }

   private:
    std::span<Entry> rowIn(std::vector<Entry>& block, size_t i) const {
        const size_t begin = i % rows_per_block == 0 ? 0 : ends_[i];
        return std::span(block).subspan(begin, ends_[i + 1] - begin);
    }

    static constexpr size_t rows_per_word = 64;
    static_assert(rows_per_block % rows_per_word == 0, "blocks share no word");

    std::vector<uint32_t> ends_ = {0};  // per row, and a 0 before: where its entries end within its block
    std::vector<uint64_t> any_;         // a bit per row
    std::vector<std::vector<Entry>> blocks_;
};

using SparseLight = Sparse<TermLight>;

// The term of any such entry, for algorithms that ask for a projection.
inline constexpr auto term_of = [](const auto& entry) -> uint32_t { return entry.term; };

// visit(index in `here`, entry of `other`) for the terms that both hold; both ascend by term.
template <class Entry>
void forEachCommonTerm(std::span<const Entry> here, std::span<const Entry> other, auto&& visit) {
    size_t j = 0;
    for (size_t i = 0; i < here.size(); ++i) {
        while (j < other.size() && other[j].term < here[i].term) ++j;
        if (j == other.size()) return;
        if (other[j].term == here[i].term) visit(i, other[j]);
    }
}

// Whether light that comes from elsewhere is light of `rows` receivers and terms below `terms`.
template <class Entry>
bool fits(const Sparse<Entry>& light, size_t rows, size_t terms) {
    if (light.rows() != rows) return false;
    for (size_t i = 0; i < rows; ++i)
        for (const Entry& l : light.row(i))
            if (l.term >= terms) return false;
    return true;
}

// One worker's dense scratch over terms, read and emptied in time proportional to what was touched (and a 64th of the
// rest: levels with many doors have thousands of terms, of which some ten are touched).
template <class Value>
class TermAccumulator {
   public:
    explicit TermAccumulator(uint32_t terms)
        : slots_(terms), marks_((terms + marks_per_line - 1) / marks_per_line * marks_per_line), into_(terms) {
        std::iota(into_.begin(), into_.end(), 0u);
    }

    // Which term light of `term` is to be added to: its own to begin with, or another, or no_term where nobody wants
    // it.
    uint32_t into(uint32_t term) const { return into_[term]; }
    void setInto(uint32_t term, uint32_t other) { into_[term] = other; }
    void setWanted(uint32_t term, bool wanted) { into_[term] = wanted ? term : no_term; }
    bool wants(uint32_t term) const { return into_[term] != no_term; }
    void wantNone() { std::ranges::fill(into_, no_term); }

    Value& operator[](uint32_t term) {
        marks_[term] = Mark::Set;
        return slots_[term].value;
    }
    // Terms touched since the last clear, ascending.
    std::span<const uint32_t> touched() {
        touched_.clear();
        for (uint32_t first = 0; first < marks_.size(); first += marks_per_line) {
            std::array<uint64_t, marks_per_line / marks_per_word> words;
            std::memcpy(&words, &marks_[first], sizeof words);
            if (std::accumulate(words.begin(), words.end(), uint64_t{0}, std::bit_or()) == 0) continue;
            for (uint32_t w = 0; w < words.size(); ++w)
                for (uint64_t word = words[w]; word != 0; word &= word - 1)  // marks are 1, so that each has one bit
                    touched_.push_back(first + w * marks_per_word + static_cast<uint32_t>(std::countr_zero(word)) / 8);
        }
        return touched_;
    }
    void clear() {
        for (uint32_t t : touched()) {
            slots_[t].value = Value{};
            marks_[t] = Mark::None;
        }
    }

   private:
    // A byte each: bits of one word would make every term wait for the one before. Not a number of a byte, which might
    // lie in any object: each store would load all pointers anew.
    enum class Mark : uint8_t { None, Set };
    static constexpr uint32_t marks_per_word = sizeof(uint64_t), marks_per_line = 64;
    // No sum lies across two lines of memory where it need not.
    struct alignas(std::min<size_t>(std::bit_ceil(sizeof(Value)), 32)) Slot {
        Value value{};
    };

    std::vector<Slot> slots_;
    std::vector<Mark> marks_;  // per term, and up to a whole line
    std::vector<uint32_t> into_;
    std::vector<uint32_t> touched_;
};

}  // namespace dimmer::cook
