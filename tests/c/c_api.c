/* Uses dimmer.h as an engine written in C does. */
#include "c_api.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

char problem[512];

/* Ends the function on a failed expectation, with its line. */
#define EXPECT(condition)                                                                              \
    do {                                                                                               \
        if (!(condition)) {                                                                            \
            snprintf(problem, sizeof(problem), "line %d: %s (last message: %s)", __LINE__, #condition, \
                     dimmer_error_message());                                                          \
            return __LINE__;                                                                           \
        }                                                                                              \
    } while (0)
#define EXPECT_OK(call) EXPECT((call) == DIMMER_OK)
/* The call fails as it should, and says why. */
#define EXPECT_FAILURE(result, fragment, call)                    \
    do {                                                          \
        EXPECT((call) == (result));                               \
        EXPECT(strstr(dimmer_error_message(), fragment) != NULL); \
    } while (0)

int look_into_pack(const char* path) {
    dimmer_pack* pack = NULL;
    dimmer_pack_info info;
    dimmer_element element;
    dimmer_mesh mesh;
    dimmer_viewpoint viewpoint;
    dimmer_placed_model model;
    dimmer_model_mesh model_mesh;
    uint32_t index = 77;
    EXPECT_OK(dimmer_pack_open(path, &pack));
    EXPECT_OK(dimmer_pack_get_info(pack, &info));
    EXPECT(info.page_count == 2 && info.page_width == 32 && info.page_height == 32);
    EXPECT(info.exposure == 1.0f / 64);
    EXPECT(info.color_format == DIMMER_R11G11B10F && info.direction_model == DIMMER_AHD);
    EXPECT(info.element_count == 6 && info.mesh_count == 2 && info.viewpoint_count == 2);
    EXPECT(info.model_count == 2 && info.model_mesh_count == 2);
    EXPECT_OK(dimmer_pack_get_model(pack, 1, &model));
    EXPECT(model.world_from_model[3] == 4 && model.world_from_model[11] == 6 && model.world_from_model[2] == 1);
    EXPECT_FAILURE(DIMMER_NOT_FOUND, "no model 2", dimmer_pack_get_model(pack, 2, &model));
    EXPECT_OK(dimmer_pack_get_model_mesh(pack, 0, &model_mesh));
    EXPECT(model_mesh.index_count % 3 == 0 && model_mesh.indices[0] < model_mesh.vertex_count);
    EXPECT_FAILURE(DIMMER_NOT_FOUND, "no model mesh 2", dimmer_pack_get_model_mesh(pack, 2, &model_mesh));

    EXPECT_OK(dimmer_pack_get_element(pack, 0, &element));
    EXPECT(strcmp(element.name, "set0") == 0 && element.kind == DIMMER_LIGHT_SET && element.max_weight == 2);
    EXPECT_OK(dimmer_pack_get_element(pack, 5, &element));
    EXPECT(strcmp(element.name, "door1") == 0 && element.kind == DIMMER_DOOR && element.max_weight == 1);
    EXPECT_FAILURE(DIMMER_NOT_FOUND, "has 6", dimmer_pack_get_element(pack, 6, &element));
    EXPECT(strcmp(element.name, "door1") == 0);
    EXPECT_OK(dimmer_pack_find_light_set(pack, "set3", &index));
    EXPECT(index == 3);
    EXPECT_OK(dimmer_pack_find_door(pack, "door0", &index));
    EXPECT(index == 4);
    EXPECT_FAILURE(DIMMER_NOT_FOUND, "Did you mean \"set", dimmer_pack_find_light_set(pack, "sett0", &index));
    EXPECT_FAILURE(DIMMER_NOT_FOUND, "no door", dimmer_pack_find_door(pack, "set0", &index));
    EXPECT(index == 4);

    EXPECT_OK(dimmer_pack_get_mesh(pack, 0, &mesh));
    EXPECT(strcmp(mesh.node, "floor") == 0 && mesh.page == 0);
    EXPECT(mesh.door == DIMMER_NONE && mesh.emission_set == DIMMER_NONE);
    EXPECT(mesh.vertex_count == 4 && mesh.index_count == 6 && mesh.indices[5] == 3);
    EXPECT(mesh.vertices[2].position_m[0] == 1 && mesh.vertices[2].position_m[2] == 1);
    EXPECT(mesh.vertices[2].normal[1] == 1 && mesh.vertices[2].lightmap_uv[0] == 0.1f + 0.5f);
    EXPECT(mesh.reflectance[1] == 0.25f);
    EXPECT_OK(dimmer_pack_get_mesh(pack, 1, &mesh));
    EXPECT(mesh.door == 4 && mesh.emission_set == 2 && mesh.emission_cd_m2[2] == 30);
    EXPECT_FAILURE(DIMMER_NOT_FOUND, "no mesh 2", dimmer_pack_get_mesh(pack, 2, &mesh));
    EXPECT_OK(dimmer_pack_get_viewpoint(pack, 1, &viewpoint));
    EXPECT(strcmp(viewpoint.name, "camera") == 0 && viewpoint.position_m[2] == 6 && viewpoint.forward[0] == 1);
    EXPECT(viewpoint.vertical_fov_rad == 0.7f);
    EXPECT_FAILURE(DIMMER_NOT_FOUND, "viewpoint 2", dimmer_pack_get_viewpoint(pack, 2, &viewpoint));
    dimmer_pack_close(pack);
    return 0;
}

int misuse(const char* path) {
    dimmer_pack* pack = NULL;
    dimmer_lights* lights = NULL;
    dimmer_pack_info info;
    dimmer_update_stats stats;
    uint32_t texel[1];
    float rgb[3] = {9, 9, 9};
    const float uv[2] = {0.5f, 0.5f}, normal[3] = {0, 0, 1}, nowhere[3] = {0, NAN, 0};
    dimmer_model_slot slot;
    char bytes[256];
    memset(&slot, 0, sizeof(slot));
    memset(bytes, 'x', sizeof(bytes));

    EXPECT_FAILURE(DIMMER_IO, "no/such.dimmer", dimmer_pack_open("no/such.dimmer", &pack));
    EXPECT_FAILURE(DIMMER_BAD_INPUT, "mem: this is not a Dimmer pack",
                   dimmer_pack_from_memory(bytes, sizeof(bytes), "mem", &pack));
    EXPECT(pack == NULL);
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "null", dimmer_pack_open(NULL, &pack));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "null", dimmer_pack_open(path, NULL));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "null", dimmer_pack_get_info(NULL, &info));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "null", dimmer_lights_set_weight(NULL, 0, 1));

    EXPECT_OK(dimmer_pack_open(path, &pack));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "1 to 1024 threads", dimmer_lights_create_cpu(pack, 0, 0, &lights));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "1 to 1024 threads",
                   dimmer_lights_create_cpu(pack, UINT32_MAX, 0, &lights));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "moving_probes_max is 16777217",
                   dimmer_lights_create_cpu(pack, 1, DIMMER_MOVING_PROBES_MAX + 1, &lights));
    EXPECT(lights == NULL);
    EXPECT_OK(dimmer_lights_create_cpu(pack, 2, 0, &lights));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "\"set0\"", dimmer_lights_set_weight(lights, 0, 2.5f));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "\"set0\"", dimmer_lights_set_weight(lights, 0, NAN));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "set0", dimmer_lights_set_weight_rgb(lights, 0, 1, -1, 1));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "no light set", dimmer_lights_set_weight(lights, 4, 1));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "no door", dimmer_lights_set_door(lights, 0, 1));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "\"door0\"", dimmer_lights_set_door(lights, 4, 1.5f));
    EXPECT_FAILURE(DIMMER_NOT_FOUND, "sett", dimmer_lights_apply(lights, "set0=0.5,sett=1"));
    EXPECT_FAILURE(DIMMER_NOT_FOUND, "no element 6", dimmer_lights_get_weight(lights, 6, rgb));
    EXPECT(rgb[0] == 9);
    EXPECT_OK(dimmer_lights_get_weight(lights, 0, rgb));
    EXPECT(rgb[0] == 1 && rgb[1] == 1 && rgb[2] == 1);
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "2048 texels", dimmer_lights_read_pages(lights, texel, texel, 1));
    EXPECT_FAILURE(DIMMER_UNSUPPORTED, "on the CPU", dimmer_lights_submit(lights, &stats));
    EXPECT_FAILURE(DIMMER_UNSUPPORTED, "on the CPU", dimmer_lights_discard_recorded(lights));
    EXPECT_FAILURE(DIMMER_UNSUPPORTED, "on the CPU", dimmer_lights_wait(lights, NULL));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "2048", dimmer_sample_lightmap(pack, texel, texel, 1, 0, uv, normal, rgb));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "finite",
                   dimmer_sample_lightmap(pack, texel, texel, 2048, 0, nowhere, normal, rgb));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "finite", dimmer_sample_air(pack, texel, 1, nowhere, normal, NULL, rgb));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "finite", dimmer_sample_air(pack, texel, 1, normal, nowhere, NULL, rgb));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "finite", dimmer_sample_model(pack, texel, 1, &slot, normal, nowhere, rgb));
    EXPECT_FAILURE(DIMMER_NOT_FOUND, "no page 2", dimmer_sample_lightmap(pack, texel, texel, 2048, 2, uv, normal, rgb));
    dimmer_lights_destroy(lights);
    dimmer_pack_close(pack);
    dimmer_lights_destroy(NULL);
    dimmer_pack_close(NULL);
    return 0;
}

int light_a_model(const char* path, float before_lux[3], float after_lux[3], float air_lux[3]) {
    const dimmer_model_grid grid = {{-0.5f, -0.5f, -0.5f}, {0.5f, 0.5f, 0.5f}, {2, 2, 2}};
    const float here[12] = {1, 0, 0, 4, 0, 1, 0, 1, 0, 0, 1, 6}, there[12] = {1, 0, 0, 8, 0, 1, 0, 1, 0, 0, 1, 6};
    const float flat[12] = {0};
    const float middle[3] = {4, 1, 6}, later[3] = {8, 1, 6}, up[3] = {0, 1, 0};
    dimmer_pack* pack = NULL;
    dimmer_lights* lights = NULL;
    dimmer_model model = {77, 77}, second;
    dimmer_model_slot slot;
    const uint32_t* probes;
    size_t words;
    uint32_t hint = DIMMER_NONE;
    float radiance[27];
    int i;
    EXPECT_OK(dimmer_pack_open(path, &pack));
    EXPECT_OK(dimmer_lights_create_cpu(pack, 1, 8, &lights));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "transform", dimmer_lights_add_model(lights, &grid, flat, &model));
    EXPECT(model.index == 77);
    EXPECT_OK(dimmer_lights_add_model(lights, &grid, here, &model));
    EXPECT_FAILURE(DIMMER_OUT_OF_MEMORY, "probes", dimmer_lights_add_model(lights, &grid, here, &second));
    EXPECT_OK(dimmer_lights_update(lights, NULL));
    EXPECT_OK(dimmer_lights_get_probes(lights, &probes, &words));
    EXPECT_OK(dimmer_lights_get_model_slot(lights, model, &slot));
    EXPECT(slot.counts[0] == 2 && words == 7 * (slot.first_probe + 8));
    EXPECT_OK(dimmer_sample_model(pack, probes, words, &slot, middle, up, before_lux));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "words",
                   dimmer_sample_model(pack, probes, words - 1, &slot, middle, up, air_lux));

    EXPECT_OK(dimmer_lights_move_model(lights, model, there));
    EXPECT_OK(dimmer_lights_update(lights, NULL));
    EXPECT_OK(dimmer_lights_get_model_slot(lights, model, &slot));
    EXPECT_OK(dimmer_sample_model(pack, probes, words, &slot, later, up, after_lux));
    EXPECT_OK(dimmer_sample_air(pack, probes, words, later, up, &hint, air_lux));
    EXPECT(hint != DIMMER_NONE);
    EXPECT_OK(dimmer_sample_radiance(pack, probes, words, later, NULL, radiance));
    /* Light L from everywhere: L_00 = sqrt(4 pi) L, and E = pi L = sqrt(pi) / 2 L_00. */
    EXPECT(fabsf(radiance[0] * 0.886226925f - air_lux[0]) < 1e-4f * air_lux[0]);
    for (i = 3; i < 27; ++i) EXPECT(radiance[i] == 0);
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "words", dimmer_sample_air(pack, probes, 7, later, up, NULL, air_lux));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "null", dimmer_sample_air(pack, probes, words, later, NULL, NULL, air_lux));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "null", dimmer_sample_air(pack, NULL, words, later, up, NULL, air_lux));

    EXPECT_OK(dimmer_lights_remove_model(lights, model));
    EXPECT(dimmer_lights_move_model(lights, model, here) != DIMMER_OK);
    dimmer_lights_destroy(lights);
    dimmer_pack_close(pack);
    return 0;
}

static int set_state(const dimmer_pack* pack, dimmer_lights* lights) {
    uint32_t set0, set1, door0;
    float rgb[3];
    EXPECT(dimmer_sliding_door_weight(0.25f, 0.5f) == 0.5f);
    EXPECT(fabsf(dimmer_hinged_door_weight(1.04719755f, 1.57079633f) - 0.5f) < 1e-6f); /* 1 - cos 60 degrees */
    EXPECT_OK(dimmer_pack_find_light_set(pack, "set0", &set0));
    EXPECT_OK(dimmer_pack_find_light_set(pack, "set1", &set1));
    EXPECT_OK(dimmer_pack_find_door(pack, "door0", &door0));
    EXPECT_OK(dimmer_lights_apply(lights, "set2=1,set3=1,door:door1=0"));
    EXPECT_OK(dimmer_lights_set_weight(lights, set0, 0.5f));
    EXPECT_OK(dimmer_lights_set_weight_rgb(lights, set1, 2, 0.25f, 0));
    EXPECT_OK(dimmer_lights_set_door(lights, door0, 0.5f));
    EXPECT_OK(dimmer_lights_get_weight(lights, set1, rgb));
    EXPECT(rgb[0] == 2 && rgb[1] == 0.25f && rgb[2] == 0);
    EXPECT_OK(dimmer_lights_get_weight(lights, door0, rgb));
    EXPECT(rgb[0] == 0.5f && rgb[2] == 0.5f);
    return 0;
}

int blend_on_cpu(const char* path, uint32_t* irradiance, uint32_t* direction, size_t texel_count) {
    dimmer_pack* pack = NULL;
    dimmer_lights* lights = NULL;
    dimmer_update_stats stats;
    const uint32_t *own_irradiance, *own_direction;
    size_t own_count;
    int failed;
    EXPECT_OK(dimmer_pack_open(path, &pack));
    EXPECT_OK(dimmer_lights_create_cpu(pack, 1, 0, &lights));
    if ((failed = set_state(pack, lights)) != 0) return failed;
    dimmer_pack_close(pack); /* the lights keep what they need */
    EXPECT_OK(dimmer_lights_update(lights, &stats));
    EXPECT(stats.receivers > 0 && stats.bytes_written == 8 * stats.receivers);
    EXPECT_OK(dimmer_lights_update(lights, &stats));
    EXPECT(stats.receivers == 0);
    EXPECT_OK(dimmer_lights_read_pages(lights, irradiance, direction, texel_count));
    EXPECT_OK(dimmer_lights_get_pages(lights, &own_irradiance, &own_direction, &own_count));
    EXPECT(own_count == texel_count);
    EXPECT(memcmp(own_irradiance, irradiance, 4 * own_count) == 0);
    EXPECT(memcmp(own_direction, direction, 4 * own_count) == 0);
    dimmer_lights_destroy(lights);
    return 0;
}

/* Records the update, submits it and waits. */
static int update_by_recording(const dimmer_vulkan* vulkan, dimmer_lights* lights) {
    VkCommandPoolCreateInfo pool_info = {.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                         .queueFamilyIndex = vulkan->queue_family};
    VkCommandBufferAllocateInfo allocate = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
                                            .commandBufferCount = 1};
    VkCommandBufferBeginInfo begin = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    VkSubmitInfo submit = {.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO, .commandBufferCount = 1};
    VkCommandPool pool = VK_NULL_HANDLE;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    dimmer_update_stats stats;
    EXPECT(vkCreateCommandPool(vulkan->device, &pool_info, NULL, &pool) == VK_SUCCESS);
    allocate.commandPool = pool;
    EXPECT(vkAllocateCommandBuffers(vulkan->device, &allocate, &commands) == VK_SUCCESS);
    EXPECT(vkBeginCommandBuffer(commands, &begin) == VK_SUCCESS);
    EXPECT_OK(dimmer_lights_record(lights, commands, &stats));
    EXPECT(stats.dispatches > 0);
    EXPECT(vkEndCommandBuffer(commands) == VK_SUCCESS);
    submit.pCommandBuffers = &commands;
    EXPECT(vkQueueSubmit(vulkan->queue, 1, &submit, VK_NULL_HANDLE) == VK_SUCCESS);
    EXPECT(vkQueueWaitIdle(vulkan->queue) == VK_SUCCESS);
    vkDestroyCommandPool(vulkan->device, pool, NULL);
    return 0;
}

int blend_on_vulkan(const char* path, const dimmer_vulkan* vulkan, uint32_t* irradiance, uint32_t* direction,
                    size_t texel_count) {
    dimmer_pack* pack = NULL;
    dimmer_lights* lights = NULL;
    dimmer_update_stats stats;
    dimmer_images images;
    VkSemaphore semaphore = VK_NULL_HANDLE;
    VkBuffer probes = VK_NULL_HANDLE, grid_table = VK_NULL_HANDLE;
    uint64_t value = 0;
    const uint32_t *own_irradiance, *own_direction;
    size_t own_count;
    int failed;
    const dimmer_vulkan_options unknown = {.buffering = (dimmer_buffering)2},
                                below = {.buffering = (dimmer_buffering)-1}, many = {.frames_in_flight = 9};
    uint32_t* by_submit = malloc(8 * texel_count);
    EXPECT(by_submit != NULL);
    EXPECT_OK(dimmer_pack_open(path, &pack));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "2 is no dimmer_buffering",
                   dimmer_lights_create_vulkan(pack, vulkan, &unknown, &lights));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "-1 is no dimmer_buffering",
                   dimmer_lights_create_vulkan(pack, vulkan, &below, &lights));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "frames_in_flight is 9",
                   dimmer_lights_create_vulkan(pack, vulkan, &many, &lights));
    EXPECT_OK(dimmer_lights_create_vulkan(pack, vulkan, NULL, &lights));
    EXPECT_OK(dimmer_lights_get_probe_buffers(lights, &probes, &grid_table));
    EXPECT(probes == VK_NULL_HANDLE && grid_table == VK_NULL_HANDLE);
    if ((failed = set_state(pack, lights)) != 0) return failed;
    EXPECT_OK(dimmer_lights_submit(lights, NULL));
    EXPECT_OK(dimmer_lights_wait(lights, &stats));
    EXPECT(stats.receivers > 0);
    EXPECT_OK(dimmer_lights_get_semaphore(lights, &semaphore, &value));
    EXPECT(semaphore != VK_NULL_HANDLE && value == 1);
    EXPECT_OK(dimmer_lights_get_images(lights, &images));
    EXPECT(images.width == 32 && images.height == 32 && images.layers == 2);
    EXPECT(images.irradiance_view != VK_NULL_HANDLE && images.direction_view != VK_NULL_HANDLE);
    EXPECT_OK(dimmer_lights_read_pages(lights, by_submit, by_submit + texel_count, texel_count));
    EXPECT_FAILURE(DIMMER_UNSUPPORTED, "by Vulkan", dimmer_lights_update(lights, NULL));
    EXPECT_FAILURE(DIMMER_UNSUPPORTED, "by Vulkan",
                   dimmer_lights_get_pages(lights, &own_irradiance, &own_direction, &own_count));

    EXPECT_OK(dimmer_lights_apply(lights, "all=0"));
    EXPECT_OK(dimmer_lights_submit_after(lights, semaphore, value, NULL));
    EXPECT_OK(dimmer_lights_wait(lights, NULL));
    EXPECT_FAILURE(DIMMER_NOT_FOUND, "no recording", dimmer_lights_discard_recorded(lights));
    if ((failed = set_state(pack, lights)) != 0) return failed;
    if ((failed = update_by_recording(vulkan, lights)) != 0) return failed;
    EXPECT_OK(dimmer_lights_read_pages(lights, irradiance, direction, texel_count));
    EXPECT(memcmp(by_submit, irradiance, 4 * texel_count) == 0);
    EXPECT(memcmp(by_submit + texel_count, direction, 4 * texel_count) == 0);
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "tolerance", dimmer_lights_set_limits(lights, 0, -1));
    EXPECT_OK(dimmer_lights_set_limits(lights, 64, 0));
    EXPECT_OK(dimmer_lights_apply(lights, "all=0.5"));
    EXPECT_OK(dimmer_lights_submit(lights, &stats));
    EXPECT(stats.receivers > 0 && stats.receivers <= 64 && stats.receivers_waiting > 0);
    EXPECT_OK(dimmer_lights_invalidate(lights));
    EXPECT_OK(dimmer_lights_set_limits(lights, 0, 0));
    EXPECT_OK(dimmer_lights_submit(lights, &stats));
    EXPECT(stats.receivers > 64);
    free(by_submit);
    dimmer_lights_destroy(lights);
    dimmer_pack_close(pack);
    return 0;
}

int probe_buffers_take_turns(const char* path, const dimmer_vulkan* vulkan) {
    dimmer_pack* pack = NULL;
    dimmer_lights* lights = NULL;
    VkBuffer probes[3] = {VK_NULL_HANDLE}, tables[3] = {VK_NULL_HANDLE}, of_set = VK_NULL_HANDLE;
    const dimmer_vulkan_options twice = {.buffering = DIMMER_DOUBLE_BUFFERED, .frames_in_flight = 2};
    dimmer_images now, images;
    uint32_t page_set = 9, probe_set = 9;
    int i;
    EXPECT_OK(dimmer_pack_open(path, &pack));
    EXPECT_OK(dimmer_lights_create_vulkan(pack, vulkan, &twice, &lights));
    for (i = 0; i < 3; ++i) {
        EXPECT_OK(dimmer_lights_apply(lights, i % 2 ? "all=0.5" : "all=0.25"));
        EXPECT_OK(dimmer_lights_submit(lights, NULL));
        EXPECT_OK(dimmer_lights_get_probe_buffers(lights, &probes[i], &tables[i]));
        EXPECT_OK(dimmer_lights_wait(lights, NULL));
        EXPECT(probes[i] != VK_NULL_HANDLE && tables[i] != VK_NULL_HANDLE && tables[i] == tables[0]);
    }
    EXPECT(probes[1] != probes[0] && probes[2] == probes[0]);
    EXPECT_OK(dimmer_lights_get_sets(lights, &page_set, &probe_set));
    EXPECT_OK(dimmer_lights_get_probes_of_set(lights, probe_set, &of_set));
    EXPECT(of_set == probes[2]);
    EXPECT_OK(dimmer_lights_get_probes_of_set(lights, probe_set ^ 1, &of_set));
    EXPECT(of_set == probes[1]);
    EXPECT_OK(dimmer_lights_get_images(lights, &now));
    EXPECT_OK(dimmer_lights_get_images_of_set(lights, page_set, &images));
    EXPECT(images.irradiance == now.irradiance && images.sampler != VK_NULL_HANDLE);
    EXPECT_FAILURE(DIMMER_NOT_FOUND, "no set of pages 2", dimmer_lights_get_images_of_set(lights, 2, &images));
    EXPECT_FAILURE(DIMMER_NOT_FOUND, "no set of probes 2", dimmer_lights_get_probes_of_set(lights, 2, &of_set));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "null", dimmer_lights_get_probe_buffers(lights, probes, NULL));
    dimmer_lights_destroy(lights);
    dimmer_pack_close(pack);
    return 0;
}

static int load_all(dimmer_lights* lights) {
    uint64_t before = 0, done = 0, total = 1;
    EXPECT_OK(dimmer_lights_continue_loading(lights, 64, NULL, NULL));
    while (done < total) {
        EXPECT_OK(dimmer_lights_continue_loading(lights, UINT64_MAX, &done, &total));
        EXPECT(done >= before && done <= total);
        before = done;
        EXPECT_OK(dimmer_lights_submit(lights, NULL));
    }
    return 0;
}

int records_come_and_go(const char* path, const dimmer_vulkan* vulkan, uint32_t* irradiance, uint32_t* direction,
                        size_t texel_count) {
    dimmer_pack* pack = NULL;
    dimmer_lights *lights = NULL, *on_cpu = NULL;
    const dimmer_vulkan_options tight = {.records_bytes_max = 16};
    const dimmer_vulkan_options without = {.start_without_records = 1};
    dimmer_records_state state = DIMMER_RECORDS_LOADED;
    uint64_t bytes = 7, free_at_first = 7, free_now = 7;
    int failed;
    EXPECT_OK(dimmer_pack_open(path, &pack));
    EXPECT_FAILURE(DIMMER_OUT_OF_MEMORY, "records_bytes_max",
                   dimmer_lights_create_vulkan(pack, vulkan, &tight, &lights));
    EXPECT_OK(dimmer_lights_create_vulkan(pack, vulkan, &without, &lights));
    EXPECT_OK(dimmer_lights_get_records_state(lights, 0, &state));
    EXPECT(state == DIMMER_RECORDS_DROPPED);
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "not loaded", dimmer_lights_set_weight(lights, 0, 1));
    EXPECT_OK(dimmer_lights_get_record_bytes(lights, 0, &bytes, &free_at_first));
    EXPECT(bytes > 0 && free_at_first >= bytes);

    EXPECT_OK(dimmer_lights_load_records(lights, 0));
    EXPECT_OK(dimmer_lights_load_records(lights, 1));
    EXPECT_OK(dimmer_lights_get_records_state(lights, 1, &state));
    EXPECT(state == DIMMER_RECORDS_LOADING);
    if ((failed = load_all(lights)) != 0) return failed;
    EXPECT_OK(dimmer_lights_get_records_state(lights, 1, &state));
    EXPECT(state == DIMMER_RECORDS_LOADED);
    EXPECT_OK(dimmer_lights_set_weight(lights, 0, 0.5f));
    EXPECT_OK(dimmer_lights_set_weight(lights, 1, 1));
    EXPECT_OK(dimmer_lights_submit(lights, NULL));
    EXPECT_OK(dimmer_lights_drop_records(lights, 1));
    EXPECT_OK(dimmer_lights_submit(lights, NULL));
    EXPECT_OK(dimmer_lights_get_record_bytes(lights, 0, &bytes, &free_now));
    EXPECT(free_now == free_at_first - bytes);
    EXPECT_OK(dimmer_lights_read_pages(lights, irradiance, direction, texel_count));

    /* 4 is a door. */
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "no light set", dimmer_lights_load_records(lights, 4));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "no light set", dimmer_lights_drop_records(lights, 4));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "no light set", dimmer_lights_get_records_state(lights, 4, &state));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "no light set",
                   dimmer_lights_get_record_bytes(lights, UINT32_MAX, &bytes, &free_now));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "null", dimmer_lights_get_records_state(lights, 0, NULL));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "null", dimmer_lights_get_record_bytes(lights, 0, &bytes, NULL));
    EXPECT_FAILURE(DIMMER_INVALID_ARGUMENT, "null", dimmer_lights_continue_loading(NULL, 0, NULL, NULL));
    EXPECT_OK(dimmer_lights_create_cpu(pack, 1, 0, &on_cpu));
    EXPECT_FAILURE(DIMMER_UNSUPPORTED, "on the CPU", dimmer_lights_drop_records(on_cpu, 0));
    EXPECT_FAILURE(DIMMER_UNSUPPORTED, "on the CPU", dimmer_lights_load_records(on_cpu, 0));
    EXPECT_FAILURE(DIMMER_UNSUPPORTED, "on the CPU", dimmer_lights_continue_loading(on_cpu, 0, NULL, NULL));
    dimmer_lights_destroy(on_cpu);
    dimmer_lights_destroy(lights);
    dimmer_pack_close(pack);
    return 0;
}

static int give_up(void) {
    fprintf(stderr, "%s\n", dimmer_error_message());
    return 1;
}

// snippet: c
/* The light at a place of the lightmap, on a server without a GPU. */
int shade_player(const char* path, float lux[3]) {
    dimmer_pack* pack;
    dimmer_lights* lights;
    uint32_t hall;
    const uint32_t *irradiance, *direction;
    size_t texel_count;
    const float uv[2] = {0.25f, 0.5f}, normal_tangent[3] = {0, 0, 1};

    if (dimmer_pack_open(path, &pack) != DIMMER_OK) return give_up(); /* prints dimmer_error_message() */
    if (dimmer_lights_create_cpu(pack, 1, 0, &lights) != DIMMER_OK) return give_up();
    if (dimmer_pack_find_light_set(pack, "hall", &hall) != DIMMER_OK) return give_up();

    dimmer_lights_set_weight_rgb(lights, hall, 1, 0.2f, 0.2f);
    dimmer_lights_update(lights, NULL);
    dimmer_lights_get_pages(lights, &irradiance, &direction, &texel_count);
    dimmer_sample_lightmap(pack, irradiance, direction, texel_count, 0, uv, normal_tangent, lux);

    dimmer_lights_destroy(lights);
    dimmer_pack_close(pack);
    return 0;
}
// end snippet
