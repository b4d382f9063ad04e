// A pack against the reference path tracer: how large the error is, and where it comes from.
#pragma once

#include <bake/progress.h>
#include <dimmer/pack.h>
#include <pipeline/light_error.h>
#include <pipeline/reference_state.h>
#include <trace/nearest_surface.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace dimmer::cook {

// A random place on a lightmapped surface, and a random normal within tilt_max_deg of the surface's own.
struct VerifyPoint {
    uint32_t mesh = 0;  // into Pack::meshes()
    std::array<float, 2> uv{};
    glm::vec3 position_m{0};
    TangentFrame frame;
    glm::vec3 tilted{0, 0, 1};
};
inline constexpr float tilt_max_deg = 60;

// Area-weighted, over all lightmapped surfaces but leaves of open doors. Places that nobody can see are left out: those
// inside closed geometry, from where many rays meet backs. The same seed gives the same points.
std::vector<VerifyPoint> choosePoints(const Pack& pack, const RayScene& rays, const std::vector<bool>& door_open,
                                      uint32_t count, uint32_t seed);

// The same places for the reference, own or tilted normal.
std::vector<ReferencePoint> queries(std::span<const VerifyPoint> points, bool tilted);

// Luminance in lux at every point, own or tilted normal, in the pack's state `text`.
Expected<std::vector<double>> packLight(const Pack& pack, std::span<const VerifyPoint> points, bool tilted,
                                        std::string_view text);

// One way to store a texel, and what it costs in accuracy with `sets` light sets and the base blended.
struct FormatError {
    ColorFormat color_format;
    DirectionModel direction_model;
    uint32_t sets = 0;
    double mean = 0, p95 = 0;  // of |E - E_exact| / (E_exact + floor), normals within 60 degrees of the surface's
    size_t values = 0;
};

struct VerifyOptions {
    std::string state;
    uint32_t points = 500;
    uint32_t paths_max = 16384;  // per point
    uint32_t seed = 1;
    bool sets = true;      // also what each light set does
    bool doors = false;    // also what opening each door does (see verify_doors.h)
    bool causes = false;   // also where the error comes from (see dissect.h); closed doors only
    bool formats = false;  // also what each way to store a texel costs here
};

struct SetReport {
    std::string name;
    EffectFigures effect;
    double energy_dropped = 0;  // share that fell below the activity threshold, as the pack states it
};

// What opening a door does to some of the light.
struct DoorReport {
    enum class Light { All, AlwaysOn, Set };
    std::string door;
    Light light = Light::All;  // all of the state; what is always on; one light set alone
    std::string light_set;
    EffectFigures effect;
    // Of all light: what is there with the door open, at the same places, of which most are where it changes most.
    std::optional<EffectFigures> light_there;
};

// One of the places behind the figures.
struct MeasuredPlace {
    const char* kind;  // "surface", "tilted", "grid" or "models"
    glm::vec3 position_m, normal;
    LightPair light;
};

// Of models that stand.
struct ModelFigures {
    ErrorFigures shadowed;              // with what vertices know of their model's shadow on itself
    ErrorFigures plain;                 // the same places without
    std::vector<MeasuredPlace> places;  // shadowed
};

struct VerifyReport {
    ErrorFigures surface, tilted;
    ErrorFigures grid;  // at random places in the open, any normal; no points where the pack has no global grid
    ModelFigures models;
    // The reference's standard error is at most a tenth of the measured error.
    bool converged = false;
    std::map<std::string, double> causes;  // mean error by cause
    std::vector<FormatError> formats;
    std::vector<SetReport> sets;
    std::vector<DoorReport> doors;
    std::vector<VerifyPoint> points;
    std::vector<LightPair> surface_pairs;  // per point
    std::vector<MeasuredPlace> places;     // all that was measured, kind after kind
    double floor_lux = 0;
    uint64_t paths = 0;
};

// `scene` is the level that `pack` was cooked from.
Expected<VerifyReport> verify(const Scene& scene, const Pack& pack, const VerifyOptions& options, Progress& progress);

// What one light set adds, alone, at candidates all over the level (paths go where its light goes).
Expected<EffectFigures> setEffect(const RayScene& rays, const Pack& pack, std::span<const VerifyPoint> points,
                                  uint32_t set, uint32_t seed, Progress& progress,
                                  uint32_t paths_max = VerifyOptions{}.paths_max);

}  // namespace dimmer::cook
