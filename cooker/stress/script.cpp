#include <stress/script.h>

#include <pack/pack_data.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

// Frames between the begin of loading and the wait for its end: some hundred kilobytes arrive one piece a frame.
constexpr uint32_t loading_frames = 24;

}  // namespace

StressScript::StressScript(const Pack& pack, uint32_t seed)
    : elements_(pack.elements().begin(), pack.elements().end()), random_(seed), records_(elements_.size()) {
    for (uint32_t i = 0; i < elements_.size(); ++i) {
        const bool door = elements_[i].kind == ElementKind::Door;
        state_.weights.push_back(door ? Weight(0) : Weight(std::min(1.0f, elements_[i].max_weight)));
        if (!door) sets_.push_back(i);
    }
    state_.movers.resize(movers_max);
    const auto& positions = pack.data().probes.global.positions;
    grid_ = !positions.empty();
    if (!grid_) return;
    min_m_ = max_m_ = {positions[0].x_m, positions[0].y_m, positions[0].z_m};
    for (const ProbePosition& p : positions) {
        const std::array<float, 3> at = {p.x_m, p.y_m, p.z_m};
        for (size_t i = 0; i < 3; ++i) {
            min_m_[i] = std::min(min_m_[i], at[i]);
            max_m_[i] = std::max(max_m_[i], at[i]);
        }
    }
}

float StressScript::uniform(float low, float high) {
    return low + (high - low) * (static_cast<float>(random_() >> 8) * 0x1p-24f);
}

uint32_t StressScript::below(uint32_t end) {
    return static_cast<uint32_t>(random_() % end);
}

const std::vector<StressEvent>& StressScript::next() {
    events_.clear();
    ++frame_;
    if (load_ends_ == frame_) {
        events_.push_back(FinishLoadEvent{});
        std::ranges::replace(records_, Records::Loading, Records::Loaded);
    }
    // Shares of a thousand frames. Most change one thing, as games do; some nothing, some everything.
    const uint32_t kind = below(1000);
    if (kind < 550)
        changeElement();
    else if (kind < 560)
        changeAllSets();
    else if (kind < 580)
        changeRecords();
    else if (kind < 590)
        changeLimits();
    else if (kind < 900)
        changeMover();
    return events_;
}

const std::vector<StressEvent>& StressScript::settle() {
    events_.clear();
    events_.push_back(LimitsEvent{});
    events_.push_back(FinishLoadEvent{});
    std::ranges::replace(records_, Records::Loading, Records::Loaded);
    load_ends_ = 0;
    return events_;
}

void StressScript::setWeight(uint32_t element, Weight weight) {
    state_.weights[element] = weight;
    if (elements_[element].kind == ElementKind::Door)
        events_.push_back(SetDoorEvent{Door{element}, weight.r});
    else
        events_.push_back(SetWeightEvent{LightSet{element}, weight});
}

void StressScript::changeElement() {
    if (elements_.empty()) return;
    const uint32_t element = below(static_cast<uint32_t>(elements_.size()));
    if (records_[element] != Records::Loaded) return;
    const float most = elements_[element].max_weight;
    const uint32_t kind = below(8);
    if (kind < 2) return setWeight(element, 0);
    if (kind < 4) return setWeight(element, most);
    if (kind < 6 || elements_[element].kind == ElementKind::Door) return setWeight(element, uniform(0, most));
    // Numbers that hurt: tiny ones, and one channel alone.
    if (kind == 6) return setWeight(element, std::exp2(uniform(-40, 0)) * most);
    Weight colour{uniform(0, most), uniform(0, most), uniform(0, most)};  // drawn in this order
    if (below(4) == 0) colour.g = colour.b = 0;
    setWeight(element, colour);
}

void StressScript::changeAllSets() {
    const float share = static_cast<float>(below(3)) * 0.5f;
    for (const uint32_t set : sets_)
        if (records_[set] == Records::Loaded) setWeight(set, share * elements_[set].max_weight);
}

void StressScript::changeRecords() {
    if (sets_.empty()) return;
    const uint32_t set = sets_[below(static_cast<uint32_t>(sets_.size()))];
    if (records_[set] == Records::Loaded) {
        records_[set] = Records::Dropped;
        state_.weights[set] = 0;
        events_.push_back(DropEvent{LightSet{set}});
    } else if (records_[set] == Records::Dropped) {
        records_[set] = Records::Loading;
        if (load_ends_ <= frame_) load_ends_ = frame_ + loading_frames;
        events_.push_back(BeginLoadEvent{LightSet{set}});
    }
}

void StressScript::changeLimits() {
    constexpr std::array<uint32_t, 4> receivers = {0, 64, 512, 4096};
    constexpr std::array<float, 3> tolerances = {0, 0.5f, 4};
    events_.push_back(LimitsEvent{{.receivers_max = receivers[below(4)], .tolerance_quanta = tolerances[below(3)]}});
}

// Anywhere in the grid's box and a little outside of it, any way up, 0.1 to 3 times the size.
Transform StressScript::randomTransform() {
    // A uniform rotation from a quaternion (K. Shoemake, Uniform random rotations, Graphics Gems III, 1992).
    constexpr float two_pi = 6.2831853f;
    const float u = uniform(0, 1), a = two_pi * uniform(0, 1), b = two_pi * uniform(0, 1);
    const float x = std::sqrt(1 - u) * std::sin(a), y = std::sqrt(1 - u) * std::cos(a), z = std::sqrt(u) * std::sin(b),
                w = std::sqrt(u) * std::cos(b);
    const float s = std::exp2(uniform(-3.3f, 1.6f));
    Transform t;
    t.rows = {{{s * (1 - 2 * (y * y + z * z)), s * 2 * (x * y - z * w), s * 2 * (x * z + y * w), 0},
               {s * 2 * (x * y + z * w), s * (1 - 2 * (x * x + z * z)), s * 2 * (y * z - x * w), 0},
               {s * 2 * (x * z - y * w), s * 2 * (y * z + x * w), s * (1 - 2 * (x * x + y * y)), 0}}};
    for (size_t i = 0; i < 3; ++i) {
        const float margin = 0.1f * (max_m_[i] - min_m_[i]);
        t.rows[i][3] = uniform(min_m_[i] - margin, max_m_[i] + margin);
    }
    return t;
}

void StressScript::changeMover() {
    if (!grid_) return;
    const uint32_t number = below(movers_max);
    StressState::Mover& mover = state_.movers[number];
    const Transform transform = randomTransform();
    if (!mover.there) {
        mover = {true, {.counts = {1 + below(4), 1 + below(4), 1 + below(4)}}, transform};
        events_.push_back(AddMoverEvent{number, mover.grid, transform});
    } else if (below(10) == 0) {
        mover.there = false;
        events_.push_back(RemoveMoverEvent{number});
    } else {
        mover.transform = transform;
        events_.push_back(MoveMoverEvent{number, transform});
    }
}

}  // namespace dimmer::cook
