#include <bake/sparse_light.h>
#include <gtest/gtest.h>

namespace dimmer::cook::test {
namespace {

struct Number {
    uint32_t term = 0;
    double value = 0;
};

// Rows of 0 to 3 entries.
Sparse<Number> numbers(size_t rows) {
    return Sparse<Number>::build(rows, [&](size_t begin, size_t end, auto emit) {
        for (size_t i = begin; i < end; ++i) {
            std::vector<Number> row(i % 4);
            for (uint32_t k = 0; k < row.size(); ++k) row[k] = {k, static_cast<double>(10 * i + k)};
            emit(std::span<const Number>(row));
        }
    });
}

// Each row takes what the rows `reach` before and behind it were, over 700 blocks: more than are made at once.
TEST(Sparse, RewritesRowsFromWhatAllWere) {
    constexpr size_t rows = 700 * rows_per_block + 13;
    for (const size_t reach : {size_t{4}, 3 * rows_per_block, 300 * rows_per_block}) {
        const Sparse<Number> before = numbers(rows);
        Sparse<Number> light = numbers(rows);
        std::vector<uint32_t> last_reader(blockCount(rows));
        for (size_t b = 0; b < last_reader.size(); ++b)
            last_reader[b] = static_cast<uint32_t>(std::min(b + reach / rows_per_block + 1, last_reader.size() - 1));
        light.rewrite(last_reader, [&](size_t begin, size_t end, auto row_of) {
            for (size_t i = begin; i < end; ++i)
                for (Number& n : row_of(i)) {
                    if (i >= reach) n.value += 1e6 * light.row(i - reach)[n.term].value;
                    if (i + reach < rows) n.value -= 1e7 * light.row(i + reach)[n.term].value;
                }
        });
        size_t wrong = 0;
        for (size_t i = 0; i < rows; ++i) {
            ASSERT_EQ(light.row(i).size(), before.row(i).size());
            for (const Number& n : before.row(i)) {
                double expected = n.value;
                if (i >= reach) expected += 1e6 * (10 * static_cast<double>(i - reach) + n.term);
                if (i + reach < rows) expected -= 1e7 * (10 * static_cast<double>(i + reach) + n.term);
                wrong += light.row(i)[n.term].value != expected;
            }
        }
        EXPECT_EQ(wrong, 0u) << reach;
    }
}

TEST(Sparse, ChangesRowsInPlace) {
    Sparse<Number> light = numbers(1000);
    light.forEachRow([](size_t i, std::span<Number> row) {
        for (Number& n : row) n.value -= 10 * static_cast<double>(i);
    });
    for (size_t i = 0; i < light.rows(); ++i)
        for (const Number& n : light.row(i)) EXPECT_EQ(n.value, n.term);
}

}  // namespace
}  // namespace dimmer::cook::test
