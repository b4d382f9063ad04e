#include <pipeline/reference_state.h>

#include <bake/sampling.h>
#include <scene/open_pose.h>
#include <update/state_text.h>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace dimmer::cook {
namespace {

template <class Named>
Expected<size_t> indexOf(const std::vector<Named>& list, std::string_view name, std::string_view what) {
    const auto it = std::ranges::find(list, name, &Named::name);
    if (it != list.end()) return static_cast<size_t>(it - list.begin());
    std::vector<std::string_view> names;
    for (const Named& entry : list) names.push_back(entry.name);
    const std::string_view near = nearestName(name, names);
    return fail(ErrorCode::NotFound, fmt::format("The level has no {} \"{}\"{}", what, name,
                                                 near.empty() ? "." : fmt::format("; did you mean \"{}\"?", near)));
}

// As the runtime has it.
Expected<glm::vec3> weightOf(const SceneLightSet& set, const StateAssignment& item) {
    const glm::vec3 weight(item.value.r, item.value.g, item.value.b);
    if (glm::all(glm::greaterThanEqual(weight, glm::vec3(0))) &&
        glm::all(glm::lessThanEqual(weight, glm::vec3(set.max_weight))))
        return weight;
    return fail(ErrorCode::InvalidArgument,
                fmt::format("Light set \"{}\": the weight {}/{}/{} is not within 0..{}, the level's dimmer_max_weight.",
                            set.name, weight.r, weight.g, weight.b, set.max_weight));
}

Expected<void> setDoor(const Scene& scene, const StateAssignment& item, ReferenceState& state) {
    const auto door = indexOf(scene.doors, item.name, "door");
    if (!door) return std::unexpected(door.error());
    if (item.value.r != 0 && item.value.r != 1)
        return fail(ErrorCode::InvalidArgument,
                    fmt::format("Door \"{}\" is {} open; the reference takes 0 or 1.", item.name, item.value.r));
    state.door_open[*door] = item.value.r == 1;
    return {};
}

bool enough(const ReferenceEstimate& estimate, const ReferenceTarget& target) {
    if (estimate.paths() < target.paths_min) return false;
    if (estimate.paths() >= target.paths_max) return true;
    const ReferenceValue v = estimate.value();
    return static_cast<double>(v.luminance_error_lux) <=
           target.relative * (std::abs(static_cast<double>(luminance(v.irradiance_lux))) + target.floor_lux);
}

}  // namespace

Expected<ReferenceState> readReferenceState(const Scene& scene, std::string_view text) {
    const auto assignments = parseState(text);
    if (!assignments) return std::unexpected(assignments.error());
    using Target = StateAssignment::Target;
    ReferenceState state{{}, std::vector<bool>(scene.doors.size())};
    for (const auto& set : scene.light_sets) state.set_weights.emplace_back(std::min(1.0f, set.max_weight));
    const auto assign = [&](size_t set, const StateAssignment& item) -> Expected<void> {
        const auto weight = weightOf(scene.light_sets[set], item);
        if (!weight) return std::unexpected(weight.error());
        state.set_weights[set] = *weight;
        return {};
    };
    for (const StateAssignment& item : *assignments)
        for (size_t set = 0; item.target == Target::AllSets && set < scene.light_sets.size(); ++set)
            if (auto ok = assign(set, item); !ok) return std::unexpected(ok.error());
    for (const StateAssignment& item : *assignments) {
        if (item.target == Target::Door)
            if (auto ok = setDoor(scene, item, state); !ok) return std::unexpected(ok.error());
        if (item.target != Target::Set) continue;
        const auto set = indexOf(scene.light_sets, item.name, "light set");
        if (!set) return std::unexpected(set.error());
        if (auto ok = assign(*set, item); !ok) return std::unexpected(ok.error());
    }
    return state;
}

Scene sceneInState(Scene scene, const ReferenceState& state) {
    const auto is_open = [&](const SceneMesh& mesh) { return mesh.door && state.door_open[*mesh.door]; };
    std::erase_if(scene.meshes, [&](const SceneMesh& m) { return is_open(m) && !scene.doors[*m.door].pose; });
    for (SceneMesh& mesh : scene.meshes)
        if (is_open(mesh)) mesh = inOpenPose(std::move(mesh));
    return scene;
}

void refineEach(const RefinePoint& refine, const ReferenceTarget& target, std::span<ReferenceEstimate> estimates,
                Progress& progress) {
    tbb::parallel_for(tbb::blocked_range<size_t>(0, estimates.size(), 1), [&](const auto& range) {
        for (size_t i = range.begin(); i < range.end(); ++i)
            while (!enough(estimates[i], target)) {
                const uint32_t so_far = estimates[i].paths();
                const uint32_t more = std::max(target.paths_min > so_far ? target.paths_min - so_far : 0, so_far / 2);
                refine(i, estimates[i],
                       std::min(std::max(more, 1u), std::max(target.paths_max, target.paths_min) - so_far));
            }
        progress.advance(range.size());
    });
}

void refineAll(const ReferenceTracer& tracer, std::span<const ReferencePoint> points, const ReferenceTarget& target,
               std::span<ReferenceEstimate> estimates, Progress& progress) {
    refineEach(
        [&](size_t i, ReferenceEstimate& estimate, uint32_t paths) { tracer.refine(estimate, points[i], paths); },
        target, estimates, progress);
}

}  // namespace dimmer::cook
