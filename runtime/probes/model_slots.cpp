#include <probes/model_slots.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace dimmer {
namespace {

using Vec3 = std::array<float, 3>;

constexpr uint32_t item_probes_max = 64;
constexpr float infinite = std::numeric_limits<float>::infinity();
constexpr Box empty_box = {{infinite, infinite, infinite}, {-infinite, -infinite, -infinite}};

void extend(Box& box, const Vec3& p) {
    for (size_t i = 0; i < 3; ++i) {
        box.min_m[i] = std::min(box.min_m[i], p[i]);
        box.max_m[i] = std::max(box.max_m[i], p[i]);
    }
}

// As a walk through the grid begins: what is not a number is the lower end.
Vec3 clamped(Vec3 p, const Box& box) {
    for (size_t i = 0; i < 3; ++i) p[i] = p[i] > box.min_m[i] ? std::min(p[i], box.max_m[i]) : box.min_m[i];
    return p;
}

Vec3 transformed(const Transform& t, const Vec3& p) {
    Vec3 out;
    for (size_t i = 0; i < 3; ++i)
        out[i] = t.rows[i][0] * p[0] + t.rows[i][1] * p[1] + t.rows[i][2] * p[2] + t.rows[i][3];
    return out;
}

double determinant(const Transform& t) {
    const auto m = [&](size_t i, size_t j) { return static_cast<double>(t.rows[i][j]); };
    return m(0, 0) * (m(1, 1) * m(2, 2) - m(1, 2) * m(2, 1)) - m(0, 1) * (m(1, 0) * m(2, 2) - m(1, 2) * m(2, 0)) +
           m(0, 2) * (m(1, 0) * m(2, 1) - m(1, 1) * m(2, 0));
}

// Infinite beyond the floats, where a cast would be anything.
float toFloat(double value) {
    constexpr double largest = std::numeric_limits<float>::max();
    return std::abs(value) <= largest ? static_cast<float>(value) : infinite;
}

// Of a transform whose determinant is not 0. Cramer's rule. Numbers beyond the floats are infinite.
Transform inverse(const Transform& t) {
    const auto m = [&](size_t i, size_t j) { return static_cast<double>(t.rows[i % 3][j % 3]); };
    const double scale = 1 / determinant(t);
    Transform out;
    for (size_t i = 0; i < 3; ++i) {
        double moved = 0;
        for (size_t j = 0; j < 3; ++j) {
            const double entry = scale * (m(j + 1, i + 1) * m(j + 2, i + 2) - m(j + 1, i + 2) * m(j + 2, i + 1));
            out.rows[i][j] = toFloat(entry);
            moved -= entry * static_cast<double>(t.rows[j][3]);
        }
        out.rows[i][3] = toFloat(moved);
    }
    return out;
}

// An axis too short for floats to tell its places apart is as good as flat: all of it is probe 0.
void flattenUnlessFinite(std::array<float, 4>& row) {
    if (!std::ranges::all_of(row, [](float v) { return std::isfinite(v); })) row = {};
}

Expected<void> check(const ModelGrid& grid) {
    for (size_t i = 0; i < 3; ++i) {
        const bool finite = std::isfinite(grid.min_m[i]) && std::isfinite(grid.max_m[i]);
        if (!finite || grid.min_m[i] > grid.max_m[i])
            return fail(ErrorCode::InvalidArgument,
                        fmt::format("The model's box reaches from {} to {} along axis {}; both must be finite, the "
                                    "first one not above the other.",
                                    grid.min_m[i], grid.max_m[i], i));
        if (grid.counts[i] == 0 || grid.counts[i] > local_grid_side_max)
            return fail(ErrorCode::InvalidArgument, fmt::format("The model has {} probes along axis {}, not 1..{}.",
                                                                grid.counts[i], i, local_grid_side_max));
    }
    return {};
}

Expected<void> check(const Transform& transform) {
    for (const auto& row : transform.rows)
        for (const float v : row)
            if (!std::isfinite(v))
                return fail(ErrorCode::InvalidArgument, "The model's transform has a number that is not finite.");
    if (determinant(transform) == 0)
        return fail(ErrorCode::InvalidArgument, "The model's transform is singular: it flattens the model.");
    return {};
}

// What stands on a floor or against a wall has a face of its box in theirs, where light of both sides meets: probes
// keep off it. In the model's units.
float insetOf(const ModelGrid& grid, const Transform& t, size_t axis) {
    constexpr float most_m = 0.05f, most_of_side = 0.1f;
    const float unit_m = std::hypot(t.rows[0][axis], t.rows[1][axis], t.rows[2][axis]);
    return std::min(most_m / unit_m, most_of_side * (grid.max_m[axis] - grid.min_m[axis]));
}

float spacing(const ModelGrid& grid, const Transform& t, size_t axis) {
    const float side = grid.max_m[axis] - grid.min_m[axis] - 2 * insetOf(grid, t, axis);
    return grid.counts[axis] < 2 ? 0 : side / static_cast<float>(grid.counts[axis] - 1);
}

// A single probe stands in the middle.
float firstAlong(const ModelGrid& grid, const Transform& t, size_t axis) {
    return grid.counts[axis] < 2 ? 0.5f * (grid.min_m[axis] + grid.max_m[axis])
                                 : grid.min_m[axis] + insetOf(grid, t, axis);
}

Vec3 stepOf(const ModelGrid& grid, const Transform& t, size_t axis) {
    const float step = spacing(grid, t, axis);
    return {t.rows[0][axis] * step, t.rows[1][axis] * step, t.rows[2][axis] * step};
}

Vec3 originOf(const ModelGrid& grid, const Transform& t) {
    return transformed(t, {firstAlong(grid, t, 0), firstAlong(grid, t, 1), firstAlong(grid, t, 2)});
}

ResampleItem itemOf(const ModelGrid& grid, const Transform& t, uint32_t first_probe) {
    const Vec3 o = originOf(grid, t), x = stepOf(grid, t, 0), y = stepOf(grid, t, 1), z = stepOf(grid, t, 2);
    return {
        o[0], o[1], o[2], first_probe, x[0], x[1], x[2], grid.counts[0] | grid.counts[1] << 8 | grid.counts[2] << 16,
        y[0], y[1], y[2], 0,           z[0], z[1], z[2], 0};
}

}  // namespace

ModelGrid modelGrid(std::array<float, 3> min_m, std::array<float, 3> max_m, float spacing_m, uint32_t probes_max) {
    ModelGrid grid{min_m, max_m, {2, 2, 2}};
    spacing_m = std::max(spacing_m, 1e-3f);
    const uint32_t most = std::max(probes_max, 8u);
    for (;; spacing_m *= 1.25f) {
        for (size_t i = 0; i < 3; ++i) {
            const float steps = std::ceil((max_m[i] - min_m[i]) / spacing_m);
            // What is not a number, or too many, ends at a limit: addModel says what is wrong with it.
            grid.counts[i] = steps >= 1 ? 1 + static_cast<uint32_t>(std::min(steps, local_grid_side_max - 1.0f)) : 2;
        }
        if (grid.probeCount() <= most) return grid;
    }
}

ModelSlot slotOf(const LocalGrid& grid) {
    ModelSlot slot{grid.first_probe, grid.counts, {}};
    Transform world_from_grid;
    for (size_t r = 0; r < 3; ++r) {
        for (size_t axis = 0; axis < 3; ++axis) world_from_grid.rows[r][axis] = grid.step_m[axis][r];
        world_from_grid.rows[r][3] = grid.origin_m[r];
    }
    const bool flat = determinant(world_from_grid) == 0 || std::ranges::find(grid.counts, 1u) != grid.counts.end();
    const Transform inverted = flat ? Transform{} : inverse(world_from_grid);
    for (size_t axis = 0; axis < 3; ++axis) {
        auto& row = slot.grid_from_world[axis];
        const Vec3& step = grid.step_m[axis];
        const float squares = step[0] * step[0] + step[1] * step[1] + step[2] * step[2];
        if (!flat) {
            row = inverted.rows[axis];
        } else if (squares > 0 && grid.counts[axis] > 1) {  // as if its axes were perpendicular
            for (size_t i = 0; i < 3; ++i) {
                row[i] = step[i] / squares;
                row[3] -= row[i] * grid.origin_m[i];
            }
        }
        flattenUnlessFinite(row);
    }
    return slot;
}

void countResampled(std::span<const ResampleItem> items, UpdateStats& stats) {
    uint64_t probes = 0;
    for (const ResampleItem& item : items) probes += item.count;
    stats.probes_resampled += probes;
    stats.bytes_read += probes * resample_bytes_read;
    stats.bytes_written += probes * resample_bytes_written;
}

ModelSlots::ModelSlots(const PackData& data, uint32_t probes_max, uint32_t page_sets)
    : first_probe_(static_cast<uint32_t>(data.probes.base.size())),
      page_sets_(page_sets),
      has_grid_(!data.probes.global.empty()),
      probes_max_(has_grid_ ? inGranules(std::min(probes_max, moving_probes_limit)) * probes_granule : 0),
      grid_box_{data.probes.global.start.min_m, data.probes.global.start.max_m},
      pool_(itemsMax(), itemsMax()),
      dirty_counts_(page_sets) {
    if (probes_max_ == 0) return;
    cells_ = LitCells(data);
    slots_.reserve(itemsMax());
    free_slots_.reserve(itemsMax());
    items_.reserve(itemsMax());
}

Expected<Model> ModelSlots::add(const ModelGrid& grid, const Transform& transform) {
    if (auto ok = check(grid); !ok) return std::unexpected(std::move(ok.error()));
    if (auto ok = check(transform); !ok) return std::unexpected(std::move(ok.error()));
    if (!has_grid_)
        return fail(ErrorCode::Unsupported, "The pack has no global light grid to light moving models from.");
    const auto first = pool_.allocate(granules(grid));
    if (!first)
        return fail(
            ErrorCode::OutOfMemory,
            fmt::format("There is no room for a model of {} probes, which takes {}: {} models share {}, and the "
                        "largest free range has {}. Remove one, or create the runtime with a higher "
                        "moving_probes_max.",
                        grid.probeCount(), granules(grid) * probes_granule, model_count_, probes_max_,
                        pool_.largestFree() * probes_granule));
    if (free_slots_.empty()) {
        free_slots_.push_back(static_cast<uint32_t>(slots_.size()));
        slots_.emplace_back();
    }
    const uint32_t index = free_slots_.back();
    free_slots_.pop_back();
    Slot& slot = slots_[index];
    slot.grid = grid;
    slot.first_probe = first_probe_ + static_cast<uint32_t>(*first) * probes_granule;
    slot.used = true;
    ++model_count_;
    place(slot, transform);
    return Model{index, slot.generation};
}

Expected<uint32_t> ModelSlots::find(Model model) const {
    if (model.index < slots_.size() && slots_[model.index].used && slots_[model.index].generation == model.generation)
        return model.index;
    return fail(ErrorCode::InvalidArgument,
                fmt::format("Model {} was removed, or never added to this runtime.", model.index));
}

Expected<void> ModelSlots::move(Model model, const Transform& transform) {
    const auto index = find(model);
    if (!index) return std::unexpected(index.error());
    if (auto ok = check(transform); !ok) return ok;
    if (slots_[*index].transform.rows != transform.rows) place(slots_[*index], transform);
    return {};
}

Expected<void> ModelSlots::remove(Model model) {
    const auto index = find(model);
    if (!index) return std::unexpected(index.error());
    Slot& slot = slots_[*index];
    for (uint32_t set = 0; set < page_sets_; ++set) dirty_counts_[set] -= slot.dirty >> set & 1;
    pool_.release((slot.first_probe - first_probe_) / probes_granule, granules(slot.grid));
    const uint32_t generation = slot.generation + 1;
    slot = {};
    slot.generation = generation;
    free_slots_.push_back(*index);
    --model_count_;
    return {};
}

Expected<ModelSlot> ModelSlots::slot(Model model) const {
    const auto index = find(model);
    if (!index) return std::unexpected(index.error());
    const Slot& slot = slots_[*index];
    const Transform model_from_world = inverse(slot.transform);
    ModelSlot out{slot.first_probe, slot.grid.counts, {}};
    for (size_t i = 0; i < 3; ++i) {
        const float step = spacing(slot.grid, slot.transform, i);
        if (!(step > 0)) continue;  // a flat axis: all of it is probe 0
        for (size_t j = 0; j < 4; ++j) out.grid_from_world[i][j] = model_from_world.rows[i][j] / step;
        out.grid_from_world[i][3] -= firstAlong(slot.grid, slot.transform, i) / step;
        flattenUnlessFinite(out.grid_from_world[i]);
    }
    return out;
}

void ModelSlots::place(Slot& slot, const Transform& transform) {
    slot.transform = transform;
    slot.box = empty_box;
    for (uint32_t corner = 0; corner < 8; ++corner) {
        Vec3 p;
        for (size_t i = 0; i < 3; ++i) p[i] = corner >> i & 1 ? slot.grid.max_m[i] : slot.grid.min_m[i];
        extend(slot.box, clamped(transformed(transform, p), grid_box_));
    }
    mark(slot, allSets());
}

void ModelSlots::mark(Slot& slot, uint32_t sets) {
    for (uint32_t set = 0; set < page_sets_; ++set) dirty_counts_[set] += (sets & ~slot.dirty) >> set & 1;
    slot.dirty |= sets;
}

void ModelSlots::touch(uint32_t page_set, std::span<const WorkItem> items) {
    if (model_count_ == 0) return;
    const uint32_t bit = 1u << page_set;
    cells_.clear();
    uint32_t last = UINT32_MAX;
    for (const WorkItem& item : items)
        if (item.cluster != std::exchange(last, item.cluster)) cells_.change(item.cluster);
    for (Slot& slot : slots_)
        if (slot.used && !(slot.dirty & bit) && cells_.changedIn(slot.box)) mark(slot, bit);
}

std::span<const ResampleItem> ModelSlots::take(uint32_t page_set) {
    items_.clear();
    const uint32_t bit = 1u << page_set;
    for (Slot& slot : slots_) {
        slot.taken = slot.dirty & bit;
        if (!slot.taken) continue;
        slot.dirty &= ~bit;
        ResampleItem item = itemOf(slot.grid, slot.transform, slot.first_probe);
        const uint32_t probes = slot.grid.probeCount();
        for (uint32_t first = 0; first < probes; first += item_probes_max) {
            item.first = first;
            item.count = std::min(item_probes_max, probes - first);
            items_.push_back(item);
        }
    }
    dirty_counts_[page_set] = 0;
    return items_;
}

void ModelSlots::rollback(uint32_t page_set) {
    for (Slot& slot : slots_)
        if (slot.taken & 1u << page_set) mark(slot, 1u << page_set);
    items_.clear();
}

void ModelSlots::rollbackAll() {
    for (Slot& slot : slots_)
        if (slot.used) mark(slot, allSets());
    items_.clear();
}

}  // namespace dimmer
