// Irradiance at points of the world, from lightmap pages.
#pragma once

#include <dimmer/pack.h>

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace dimmer::cook {

// A point counts as on a surface up to this far from it.
inline constexpr float surface_reach_m = 0.1f;

struct QueryPoint {
    glm::vec3 position_m, normal;
};

struct LightPages {
    std::vector<uint32_t> irradiance, direction;
    std::vector<uint32_t> probes = {};  // 7 words each; for sampleGrid alone
};

// CSV with the header x,y,z,nx,ny,nz (further columns are ignored); "-" reads stdin. Errors name the line.
Expected<std::vector<QueryPoint>> readPoints(const std::string& file);

// Lux, linear Rec.709; empty where no surface is near. The normal may differ from the surface's own.
std::vector<std::optional<std::array<float, 3>>> sampleSurface(const Pack& pack, const LightPages& pages,
                                                               std::span<const QueryPoint> points);

// The same from the global grid, which the pack must have; every point has light.
std::vector<std::optional<std::array<float, 3>>> sampleGrid(const Pack& pack, const LightPages& pages,
                                                            std::span<const QueryPoint> points);

// x,y,z,nx,ny,nz,Er,Eg,Eb; nan where there is no light to report. "-" writes to stdout.
Expected<void> writeSamples(const std::string& file, std::span<const QueryPoint> points,
                            std::span<const std::optional<std::array<float, 3>>> samples);

}  // namespace dimmer::cook
