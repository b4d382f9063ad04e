// What a cook says of a level that can be cooked, though not as somebody meant it.
#pragma once

#include <charts/texels.h>
#include <pipeline/profile.h>
#include <scene/scene.h>
#include <trace/ray_scene.h>

#include <optional>
#include <string>
#include <vector>

namespace dimmer::cook {

// The exposure leaves room for every set at its largest weight at once; an absurd one leaves the rest of the level
// black. `group`: the light group that is the brightest somewhere.
std::optional<std::string> coarseExposure(const Scene& scene, float exposure, uint32_t group);

// Coordinates are floats: far from the origin a step of theirs comes near what keeps rays off walls, until these are
// lit from behind themselves.
std::optional<std::string> farFromOrigin(const RayScene& rays);

// No lamp, no sky, nothing that shines: an exporter's lights are easily left out.
std::optional<std::string> withoutLight(const Scene& scene);

// Lights there are, and none of their light arrives: a sky dome stops the sun, say. `energy_lm`: of what packs store.
std::optional<std::string> allInTheDark(const RayScene& rays, const Unwrap& unwrap, const Texels& texels,
                                        double energy_lm);

// Most of the level is narrower than a few texels: it is in another unit, mostly.
std::optional<std::string> tooSmallForTexels(const RayScene& rays, const Unwrap& unwrap, const Texels& texels);

// Or the other way round: hundreds of thousands of texels on few triangles.
std::optional<std::string> tooLargeForTexels(const RayScene& rays, const Unwrap& unwrap);

// Of the command line's settings for another quality, which do nothing.
std::vector<std::string> otherQualities(const Profile& profile, const std::string& quality);

}  // namespace dimmer::cook
