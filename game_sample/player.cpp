#include "player.h"

#include "exposure.h"
#include "image_file.h"
#include "output_files.h"
#include "progress.h"
#include "stage.h"
#include "timeline.h"

#include <fmt/format.h>
#include <gpu/vk_result.h>

namespace dimmer::sample {

Expected<PlayResult> playHeadless(const Pack& pack, const Script& script, const PlayOptions& options) {
    const auto device = HeadlessDevice::create({.validation = options.validate, .graphics = true});
    if (!device) return std::unexpected(device.error());
    PlayResult result{{}, device->name(), device->driver(), {}};
    {
        auto stage = Stage::create(*device, pack, script, options.self_visibility);
        if (!stage) return std::unexpected(stage.error());
        DIMMER_TRY((*stage)->rehearse(script.frames));
        DIMMER_TRY(prepareFolder(options.out, {options.pack, options.script}));
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
            DIMMER_TRY(writePng(frameFile(options.out, frame), radiance.width, radiance.height,
                                developPicture(radiance, exposure)));
            progress.update(frame + 1);
        }
        DIMMER_TRY(result.cost.writeJson(costFile(options.out), options.pack.filename().string(), result.device,
                                         result.driver));
    }
    result.validation_messages = device->validationMessages();  // destruction was watched too
    return result;
}

}  // namespace dimmer::sample
