// What one draw call gets as push constants: shared by C++ (level_renderer.cpp, sphere_renderer.cpp,
// model_renderer.cpp) and GLSL.
#ifndef DIMMER_SAMPLE_DRAW_CONSTANTS_GLSL
#define DIMMER_SAMPLE_DRAW_CONSTANTS_GLSL

#ifdef __cplusplus
#include <cstdint>
#include <glm/glm.hpp>
namespace dimmer::sample {
using glm::mat4;
using glm::vec3;
using uint = uint32_t;
#endif

struct DrawConstants {
    mat4 clip_from_world;
    vec3 reflectance;     // Lambert, linear Rec.709
    float page;           // of the lightmap
    vec3 emission_cd_m2;  // times the weight of its light set
    float exposure;       // Pack::exposure()
    uint direction_model;  // Pack::directionModel()
};

// For all spheres.
struct SphereConstants {
    mat4 clip_from_world;
    float exposure;
    uint color_format;  // Pack::colorFormat()
};

// For all models.
struct ModelConstants {
    mat4 clip_from_world;
    float exposure;
    uint color_format;     // Pack::colorFormat()
    uint self_visibility;  // 0: without the models' shadows on themselves
};

#ifdef __cplusplus
static_assert(sizeof(DrawConstants) == 100);  // every device takes 128
}  // namespace dimmer::sample
#endif

#endif
