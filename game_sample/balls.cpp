#include "balls.h"

#include <gpu/vk_result.h>
#include <pack/pack_data.h>

#include <glm/gtc/constants.hpp>

namespace dimmer::sample {
namespace {

ModelGrid gridOf(const Ball& ball) {
    const float r = ball.radius_m;
    return modelGrid({-r, -r, -r}, {r, r, r});
}

Transform at(const glm::vec3& place_m) {
    Transform transform;
    for (int i = 0; i < 3; ++i) transform.rows[static_cast<size_t>(i)][3] = place_m[i];
    return transform;
}

}  // namespace

glm::vec3 placeOf(const Ball& ball, uint32_t frame) {
    const uint32_t way = frame % (2 * ball.frames);
    const float share =
        0.5f - 0.5f * std::cos(glm::pi<float>() * static_cast<float>(way) / static_cast<float>(ball.frames));
    return glm::mix(ball.from_m, ball.to_m, share);
}

uint32_t movingProbes(const Script& script) {
    uint32_t probes = 0;
    for (const Ball& ball : script.balls) probes += (gridOf(ball).probeCount() + 7) / 8 * 8;
    return probes;
}

std::vector<Ball> ballsAtPlaces(const Pack& pack) {
    constexpr float radius_m = 0.15f, way_m = 1.2f;
    constexpr uint32_t frames_one_way = 50;
    std::vector<Ball> balls;
    if (pack.data().probes.global.empty()) return balls;
    for (const PlacedModel& model : pack.models()) {
        if (model.mesh_count > 0 || model.local_grid) continue;
        const auto& rows = model.world_from_model.rows;
        const glm::vec3 place(rows[0][3], rows[1][3], rows[2][3]), along(rows[0][0], rows[1][0], rows[2][0]);
        balls.push_back({radius_m, place, place + way_m * along, frames_one_way});
    }
    return balls;
}

Expected<Balls> Balls::create(const Script& script, LightState& lights) {
    Balls balls;
    balls.script_ = &script;
    for (const Ball& ball : script.balls) {
        const auto model = lights.addModel(gridOf(ball), at(ball.from_m));
        if (!model) return std::unexpected(model.error());
        balls.models_.push_back(*model);
        balls.places_m_.push_back(ball.from_m);
    }
    return balls;
}

Expected<void> Balls::move(uint32_t frame, LightState& lights) {
    for (size_t i = 0; i < models_.size(); ++i) {
        places_m_[i] = placeOf(script_->balls[i], frame);
        DIMMER_TRY(lights.moveModel(models_[i], at(places_m_[i])));
    }
    return {};
}

Expected<std::vector<Sphere>> Balls::spheres(const LightState& lights) const {
    std::vector<Sphere> spheres;
    for (size_t i = 0; i < models_.size(); ++i) {
        const auto slot = lights.modelSlot(models_[i]);
        if (!slot) return std::unexpected(slot.error());
        spheres.push_back({places_m_[i], script_->balls[i].radius_m, glm::vec4(0.75f), *slot});
    }
    return spheres;
}

}  // namespace dimmer::sample
