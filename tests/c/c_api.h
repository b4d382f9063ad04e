/* What the C part of the tests of dimmer.h does for the C++ part. */
#ifndef DIMMER_TESTS_C_API_H
#define DIMMER_TESTS_C_API_H

#include <dimmer/dimmer.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Each returns 0, or the line on which an expectation failed, with a message in `problem`. */
extern char problem[512];

/* Everything that the pack holds. `pack`: tests/pack/sample_pack.h, in a file. */
int look_into_pack(const char* path);
/* Whatever is wrong with the arguments. */
int misuse(const char* path);
/* set0 at 0.5, set1 at 2/0.25/0, door0 half open, on the CPU; the pages into arrays of `texel_count`. */
int blend_on_cpu(const char* path, uint32_t* irradiance, uint32_t* direction, size_t texel_count);
/* A model of 2 x 2 x 2 probes in a metre's box at (4, 1, 6), then at (8, 1, 6), in a pack with a global grid: light on
 * its middle, upwards; then that of the air there. */
int light_a_model(const char* path, float before_lux[3], float after_lux[3], float air_lux[3]);
/* The same state on a Vulkan device, first by submit, then, with all sets off between, by record. */
int blend_on_vulkan(const char* path, const dimmer_vulkan* vulkan, uint32_t* irradiance, uint32_t* direction,
                    size_t texel_count);
/* The buffers of probes, of a pack with a global grid that has dynamic light, by turns after each update. */
int probe_buffers_take_turns(const char* path, const dimmer_vulkan* vulkan);
/* In a runtime that starts without records: set0's and set1's are loaded, set1's dropped again; then the state of
 * "set0=0.5" alone is blended. */
int records_come_and_go(const char* path, const dimmer_vulkan* vulkan, uint32_t* irradiance, uint32_t* direction,
                        size_t texel_count);
/* The example of docs/integrate.md. */
int shade_player(const char* path, float lux[3]);

#ifdef __cplusplus
}
#endif

#endif
