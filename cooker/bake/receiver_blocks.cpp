#include <bake/receiver_blocks.h>

#include <charts/planar.h>
#include <pack/pack_data.h>

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

namespace dimmer::cook {
namespace {

constexpr float joined_texel_max_m2 = 0.25f;
constexpr uint32_t side = 2;  // texels

// Of the block that a texel is in: its chart, and where in it.
uint64_t keyOf(const Unwrap& unwrap, const Texels& texels, size_t texel) {
    const uint32_t chart = unwrap.face_chart[texels.face(texel)], address = texels.address[texel];
    const uint64_t x = (TexelAddress::x(address) - unwrap.charts[chart].x) / side,
                   y = (TexelAddress::y(address) - unwrap.charts[chart].y) / side;
    return uint64_t{chart} << 32 | y << 16 | x;
}

bool joins(const Unwrap& unwrap, const Texels& texels, size_t texel) {
    const uint32_t face = texels.face(texel);
    return unwrap.texel_area_m2[face] <= joined_texel_max_m2 && !unwrap.charts[unwrap.face_chart[face]].curved;
}

// Something stands between two texels: a wall, a closed door, a chair's leg.
bool parted(const Gatherer& gatherer, uint32_t a, uint32_t b) {
    const auto above = [&](uint32_t texel) {
        const SamplePoint p = samplePoint(gatherer.rays(), gatherer.unwrap(), gatherer.texels(), texel, 0);
        return p.position_m + wall_probe_low_m * gatherer.frameOf(p).normal;
    };
    const glm::vec3 from = above(a), to = above(b);
    return gatherer.rays().blocked(from, to) || gatherer.rays().blocked(to, from);
}

// Per receiver, the first one of its block.
std::vector<uint32_t> firstsOfBlocks(const Gatherer& gatherer) {
    std::vector<uint32_t> firsts(gatherer.receiverCount());
    std::iota(firsts.begin(), firsts.end(), 0u);
    std::vector<std::pair<uint64_t, uint32_t>> joined;  // what may be a block's, side by side
    for (uint32_t i = 0; i < gatherer.texels().size(); ++i)
        if (joins(gatherer.unwrap(), gatherer.texels(), i))
            joined.emplace_back(keyOf(gatherer.unwrap(), gatherer.texels(), i), i);
    tbb::parallel_sort(joined.begin(), joined.end());
    tbb::parallel_for(size_t{0}, joined.size(), [&](size_t begin) {
        const uint64_t key = joined[begin].first;
        if (begin > 0 && joined[begin - 1].first == key) return;
        std::array<uint32_t, side * side> found{};
        size_t blocks = 0;
        for (size_t k = begin; k < joined.size() && joined[k].first == key; ++k) {
            const uint32_t i = joined[k].second;
            const auto end = found.begin() + static_cast<std::ptrdiff_t>(blocks);
            const auto with = std::find_if(found.begin(), end, [&](uint32_t f) { return !parted(gatherer, f, i); });
            if (with == end) found[blocks++] = i;
            firsts[i] = *with;
        }
    });
    return firsts;
}

}  // namespace

ReceiverBlocks::ReceiverBlocks(const Gatherer& gatherer) : gatherer_(gatherer) {
    const auto count = static_cast<uint32_t>(gatherer.receiverCount());
    const std::vector<uint32_t> firsts = firstsOfBlocks(gatherer);
    uint32_t blocks = 0;
    for (uint32_t i = 0; i < count; ++i) of_receiver_.push_back(firsts[i] == i ? blocks++ : of_receiver_[firsts[i]]);
    first_.resize(blocks + 1);
    for (const uint32_t block : of_receiver_) ++first_[block + 1];
    for (size_t block = 0; block < blocks; ++block) first_[block + 1] += first_[block];
    receivers_.resize(count);
    std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
    for (uint32_t i = 0; i < count; ++i) receivers_[next[of_receiver_[i]]++] = i;
    for (size_t block = 0; block < blocks; ++block) {
        float area_m2 = 0;
        glm::vec3 reflected_m2(0);
        for (const uint32_t i : receivers(block)) {
            area_m2 += gatherer.areaM2(i);
            reflected_m2 += gatherer.areaM2(i) * gatherer.reflectance(i);
        }
        area_m2_.push_back(area_m2);
        reflectance_.push_back(area_m2 > 0 ? reflected_m2 / area_m2 : glm::vec3(0));
        condition_.push_back(gatherer.conditionOf(receivers(block)[0]));
    }
}

Links ReceiverBlocks::links(const Links& of_receivers) const {
    Links::Builder builder(size());
    forEachBlock(size(), [&](size_t begin, size_t end) {
        std::vector<Link> of_one, some;
        for (size_t block = begin; block < end; ++block) {
            const auto members = receivers(block);
            const auto step = static_cast<uint32_t>(members.size());
            const uint32_t chance = hash(static_cast<uint32_t>(block));
            some.clear();
            // Each begins at another of its links, which are sorted: together they sample all evenly.
            for (uint32_t m = 0; m < step; ++m) {
                of_receivers.get(members[m], of_one);
                for (size_t k = (chance + m) % step; k < of_one.size(); k += step)
                    some.push_back({of(of_one[k].receiver), of_one[k].path});
            }
            builder.put(block, some);
        }
        builder.close(begin);
    });
    return builder.finish();
}

SparseLight ReceiverBlocks::arriving(const SparseLight& at_receivers, uint32_t terms) const {
    return SparseLight::build(size(), [&](size_t begin, size_t end, auto emit) {
        TermAccumulator<glm::vec3> reflected_m2(terms);
        std::vector<TermLight> row;
        for (size_t block = begin; block < end; ++block) {
            for (const uint32_t i : receivers(block)) {
                const glm::vec3 reflects_m2 = gatherer_.areaM2(i) * gatherer_.reflectance(i);
                for (const TermLight& l : at_receivers.row(i)) reflected_m2[l.term] += reflects_m2 * l.value();
            }
            const glm::vec3 all_m2 = area_m2_[block] * reflectance_[block];
            const auto share = [&](glm::vec3 lm) {
                const auto of = [](float a, float b) { return b > 0 ? a / b : 0; };
                return glm::vec3(of(lm.x, all_m2.x), of(lm.y, all_m2.y), of(lm.z, all_m2.z));
            };
            row.clear();
            for (const uint32_t t : reflected_m2.touched())
                row.emplace_back(t, share(reflected_m2[t]), Rounding(block, Rounding::Of::BlockDirect));
            reflected_m2.clear();
            emit(std::span<const TermLight>(row));
        }
    });
}

}  // namespace dimmer::cook
