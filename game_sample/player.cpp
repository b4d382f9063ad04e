#include "player.h"

#include "exposure.h"
#include "image_file.h"
#include "progress.h"
#include "stage.h"
#include "timeline.h"

#include <fmt/format.h>
#include <gpu/vk_result.h>

namespace dimmer::sample {

Expected<PlayResult> playHeadless(const Pack& pack, const Script& script, const PlayOptions& options) {
    std::error_code failed;
    std::filesystem::create_directories(options.out, failed);
    if (failed) return fail(ErrorCode::Io, fmt::format("{}: {}.", options.out.string(), failed.message()));

    const auto device = HeadlessDevice::create({.validation = options.validate, .graphics = true});
    if (!device) return std::unexpected(device.error());
    PlayResult result{{}, device->name(), device->driver(), {}};
    {
        auto stage = Stage::create(*device, pack, script, options.self_visibility);
        if (!stage) return std::unexpected(stage.error());
        DIMMER_TRY((*stage)->rehearse(script.frames));
        Timeline timeline(script);
        AutoExposure eye(script.adaptation_s, script.fps);
        Progress progress("frames", script.frames);
        for (uint32_t frame = 0; frame < script.frames; ++frame) {
            auto changes = timeline.advance(frame, (*stage)->lights());
            if (!changes) return std::unexpected(changes.error());
            const auto stats = (*stage)->draw(frame, timeline.camera());
            if (!stats) return std::unexpected(stats.error());
            result.cost.add({frame, std::move(*changes), *stats});
            const RadianceFrame radiance = (*stage)->read();
            const float exposure = eye.update(medianLuminance(radiance), frame == 0 || timeline.cut());
            const auto file = options.out / fmt::format("frame_{:04}.png", frame);
            DIMMER_TRY(writePng(file, radiance.width, radiance.height, developPicture(radiance, exposure)));
            progress.update(frame + 1);
        }
        DIMMER_TRY(result.cost.writeJson(options.out / "cost.json", options.pack.filename().string(), result.device,
                                         result.driver));
    }
    result.validation_messages = device->validationMessages();  // destruction was watched too
    return result;
}

}  // namespace dimmer::sample
