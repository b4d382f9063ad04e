// Light of a model's probes such that its surface, lit by them, is as it was gathered there.
#pragma once

#include <bake/gather.h>
#include <models/model_surface.h>

#include <span>

namespace dimmer::cook {

// Least squares of the error of irradiance at the places, weighted with 1 / (light there by `probes` as given + a tenth
// of its mean), and a little of the distance from those, which are what was gathered at the probes: they decide what no
// place asks for. No probe gives any normal a negative irradiance: such light counts as an error a hundred times as
// large, so that de-ringing (encodeProbe) finds next to nothing to take. That is convex, and solved by Newton's method,
// one channel after the other. `lux`: per place; where all are dark the probes stay. `lattice`: probes along each axis,
// x first. All channels take 1 ms for 8 probes, 20 ms for 2 x 2 x 32 in any order, 40 ms for 4 x 4 x 4 and 0.13 s for
// 5 x 5 x 5.
void fitModel(std::span<const ModelPlace> places, std::span<const glm::vec3> lux, std::span<ProbeLight> probes,
              glm::uvec3 lattice);

}  // namespace dimmer::cook
