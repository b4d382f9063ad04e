/* Dimmer for C: a pack, and its light blended on the CPU or by Vulkan compute. The same library, `dimmer_runtime`, as
 * the C++ headers beside this one, which say more about cost and synchronisation; docs/integrate.md has an example.
 *
 * Every function that can fail returns a dimmer_result; on anything but DIMMER_OK nothing was changed, output arguments
 * included, and dimmer_error_message() says in a sentence what is wrong and how to mend it. A null pointer where one is
 * needed is DIMMER_INVALID_ARGUMENT. Texts are UTF-8 and end in 0. Units: metres, +Y up; lux; linear Rec.709 colour.
 *
 * Threads: a dimmer_pack may be used by any number of threads; a dimmer_lights by one at a time.
 *
 * Define DIMMER_NO_VULKAN before including it where there are no Vulkan headers. */
#ifndef DIMMER_DIMMER_H
#define DIMMER_DIMMER_H

#include <dimmer/version.h>

#include <stddef.h>
#include <stdint.h>

#ifndef DIMMER_NO_VULKAN
#include <vulkan/vulkan.h>
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef enum dimmer_result {
    DIMMER_OK = 0,
    DIMMER_INVALID_ARGUMENT = 1, /* the caller's value is out of its range */
    DIMMER_NOT_FOUND = 2,        /* no light set or door of that name, or nothing of that number to give */
    DIMMER_BAD_INPUT = 3,        /* a file's content cannot be used */
    DIMMER_UNSUPPORTED = 4,      /* the device or this build lacks something that is needed */
    DIMMER_OUT_OF_MEMORY = 5,    /* host or device memory */
    DIMMER_DEVICE_LOST = 6,      /* destroy the lights and create them anew on a new device */
    DIMMER_IO = 7,               /* a file could not be read */
    DIMMER_INTERNAL = 8          /* a broken promise of ours; please report it */
} dimmer_result;

/* What the last call of this thread that failed had to say; empty before the first. Valid until this thread's next
 * failing call. Never null. */
const char* dimmer_error_message(void);

/* No element: a mesh without a door, an emission without a light set. */
#define DIMMER_NONE UINT32_MAX

/* ---- Pack: a cooked level, read and validated. Never changes once it is open. ---- */

typedef struct dimmer_pack dimmer_pack;

/* Reads and validates a whole file. */
dimmer_result dimmer_pack_open(const char* path, dimmer_pack** pack);
/* The same from memory, which is not needed afterwards; `name` stands for the file in messages. */
dimmer_result dimmer_pack_from_memory(const void* bytes, size_t byte_count, const char* name, dimmer_pack** pack);
/* Null is allowed. Lights made from the pack stay usable; texts and arrays that the pack gave out do not. */
void dimmer_pack_close(dimmer_pack* pack);

typedef enum dimmer_color_format {
    DIMMER_R11G11B10F = 0, /* VK_FORMAT_B10G11R11_UFLOAT_PACK32 */
    DIMMER_E5B9G9R9 = 1    /* VK_FORMAT_E5B9G9R9_UFLOAT_PACK32 */
} dimmer_color_format;

typedef enum dimmer_direction_model { DIMMER_AHD = 0, DIMMER_LINEAR = 1 } dimmer_direction_model;

typedef struct dimmer_pack_info {
    uint32_t page_count, page_width, page_height; /* of the lightmap, in texels */
    dimmer_color_format color_format;             /* of the irradiance pages; direction is A2B10G10R10_UNORM_PACK32 */
    dimmer_direction_model direction_model;       /* as sample.glsl wants it */
    float exposure;                               /* stored light = lux * exposure; a power of two */
    uint32_t element_count, mesh_count, viewpoint_count, model_count, model_mesh_count;
} dimmer_pack_info;

dimmer_result dimmer_pack_get_info(const dimmer_pack* pack, dimmer_pack_info* info);

typedef enum dimmer_element_kind { DIMMER_LIGHT_SET = 0, DIMMER_DOOR = 1 } dimmer_element_kind;

/* A thing that the game controls. */
typedef struct dimmer_element {
    const char* name; /* unique among its kind; lives as long as the pack */
    dimmer_element_kind kind;
    float max_weight; /* the largest weight that a light set accepts; 1 for doors */
} dimmer_element;

/* `index`: 0 .. element_count - 1, light sets first. It is the handle that lights take. */
dimmer_result dimmer_pack_get_element(const dimmer_pack* pack, uint32_t index, dimmer_element* element);
/* Light sets and doors have separate names. The message of DIMMER_NOT_FOUND names the nearest. */
dimmer_result dimmer_pack_find_light_set(const dimmer_pack* pack, const char* name, uint32_t* element);
dimmer_result dimmer_pack_find_door(const dimmer_pack* pack, const char* name, uint32_t* element);

typedef struct dimmer_vertex {
    float position_m[3];  /* world space */
    float normal[3];      /* unit, world space */
    float lightmap_uv[2]; /* 0..1 over the page */
} dimmer_vertex;

/* A mesh of the level; single-sided triangles, counter-clockwise seen from their front. */
typedef struct dimmer_mesh {
    const char* node; /* the glTF node's name; pointers live as long as the pack */
    const dimmer_vertex* vertices;
    const uint32_t* indices; /* 3 per triangle */
    uint32_t vertex_count, index_count;
    uint32_t page;
    uint32_t door;           /* the element whose leaf this is, or DIMMER_NONE */
    float reflectance[3];    /* Lambert */
    float emission_cd_m2[3]; /* radiance of an emissive material */
    uint32_t emission_set;   /* the element that dims the emission, or DIMMER_NONE */
} dimmer_mesh;

dimmer_result dimmer_pack_get_mesh(const dimmer_pack* pack, uint32_t index, dimmer_mesh* mesh);

/* A place to look from: a glTF camera, or the node "player_start". */
typedef struct dimmer_viewpoint {
    const char* name;
    float position_m[3];
    float forward[3]; /* unit */
    float vertical_fov_rad;
} dimmer_viewpoint;

dimmer_result dimmer_pack_get_viewpoint(const dimmer_pack* pack, uint32_t index, dimmer_viewpoint* viewpoint);

/* Where a model's probes are, and how to find them: what grid.glsl's dimmer_model_irradiance takes. */
typedef struct dimmer_model_slot {
    uint32_t first_probe;
    uint32_t counts[3];          /* along each axis; x fastest, then y */
    float grid_from_world[3][4]; /* to 0 .. counts - 1 along each axis */
} dimmer_model_slot;

/* A thing of the level that light grids light. */
typedef struct dimmer_placed_model {
    const char* node;                /* pointers live as long as the pack */
    uint32_t first_mesh, mesh_count; /* model meshes; none: a place for things that move */
    int moves;                       /* 0: it stands, and `slot` says where its probes are; else add it to the lights */
    dimmer_model_slot slot;
    float world_from_model[12]; /* rows of a rigid 3 x 4 matrix, metres, the translation last */
    float min_m[3], max_m[3];   /* its box, model space; zeros where it has no meshes */
} dimmer_placed_model;

dimmer_result dimmer_pack_get_model(const dimmer_pack* pack, uint32_t index, dimmer_placed_model* model);

/* 20 bytes that a vertex buffer takes as they are; model_mesh.h has the formulas. */
typedef struct dimmer_model_vertex {
    uint16_t position[3]; /* UNORM, over the mesh's box */
    int16_t normal[2];    /* SNORM, octahedral */
    int8_t transfer[9];   /* SNORM, in units of the bands' bounds: self-visibility */
    uint8_t spare;
} dimmer_model_vertex;

typedef struct dimmer_model_mesh {
    const dimmer_model_vertex* vertices;
    const uint32_t* indices; /* 3 per triangle */
    uint32_t vertex_count, index_count;
    float min_m[3], max_m[3]; /* of its positions, model space */
    float reflectance[3];
    float emission_cd_m2[3];
    uint32_t emission_set; /* the element that dims the emission, or DIMMER_NONE */
} dimmer_model_mesh;

dimmer_result dimmer_pack_get_model_mesh(const dimmer_pack* pack, uint32_t index, dimmer_model_mesh* mesh);

/* ---- Lights: the weights of a level's light sets and doors, and the pages blended from them. ---- */

typedef struct dimmer_lights dimmer_lights;

/* Room for more probes of models that move is refused: these are half a gigabyte. */
#define DIMMER_MOVING_PROBES_MAX (1u << 24)

/* On the CPU, with `thread_count` threads (1 to 1024, the caller's included) and room for `moving_probes_max` probes of
 * models that move (at most DIMMER_MOVING_PROBES_MAX): some 60 bytes each, 32 of which are touched at once, and each
 * model takes a multiple of 8. Keeps what it needs of the pack alive. */
dimmer_result dimmer_lights_create_cpu(const dimmer_pack* pack, uint32_t thread_count, uint32_t moving_probes_max,
                                       dimmer_lights** lights);
/* Null is allowed. Waits for what dimmer_lights_submit() and dimmer_lights_continue_loading() sent, and for nothing
 * else: of the caller's submissions those must have completed that have a recorded update in them, read images, probes
 * or the grid's tables, or wait for the lights' semaphore. */
void dimmer_lights_destroy(dimmer_lights* lights);

/* Changes cost nanoseconds and take effect with the next update. At the start every light set is at 1 (or its maximum,
 * where that is smaller) and every door is closed. A weight is 0 .. max_weight, per channel where it has three;
 * `open` is 0 (closed) .. 1 (open); a fade that adds up its steps clamps them, as 1.0000001 is refused and changes
 * nothing. An element that is no light set, or no door, is DIMMER_INVALID_ARGUMENT. */
dimmer_result dimmer_lights_set_weight(dimmer_lights* lights, uint32_t light_set, float weight);
dimmer_result dimmer_lights_set_weight_rgb(dimmer_lights* lights, uint32_t light_set, float r, float g, float b);
dimmer_result dimmer_lights_set_door(dimmer_lights* lights, uint32_t door, float open);
/* From how far a door stands open to `open`, for the two common kinds: see door.h. NaN where an argument is, which
 * dimmer_lights_set_door() refuses. */
float dimmer_hinged_door_weight(float angle_rad, float angle_max_rad);
float dimmer_sliding_door_weight(float travel_m, float width_m);
/* Many at once, as text: "all=0,hall=0.5,alarm=1/0.2/0.2,door:front=1". */
dimmer_result dimmer_lights_apply(dimmer_lights* lights, const char* state);
/* What an update may leave for later: at most so many texels are written (0: all; the most visible come first), and
 * what is less than so many steps of the format from what was last written waits (0: nothing does). {0, 0} brings the
 * exact state with the next update. Probes and models are not limited. */
dimmer_result dimmer_lights_set_limits(dimmer_lights* lights, uint32_t receivers_max, float tolerance_quanta);
/* As set last: of a door, `open` in all three. */
dimmer_result dimmer_lights_get_weight(const dimmer_lights* lights, uint32_t element, float rgb[3]);

/* What an update did. Any pointer to one below may be null. */
typedef struct dimmer_update_stats {
    uint32_t contributions_changed, clusters, batches, dispatches;
    uint64_t receivers; /* texels and probes written */
    uint64_t bytes_read, bytes_written;
    double host_us;
    double gpu_us;             /* by timestamps, from dimmer_lights_wait(); else 0 */
    uint32_t clusters_put_off; /* by dimmer_lights_set_limits()'s tolerance_quanta */
    /* Left for later updates by its receivers_max, at most, of the state that is being written: with two sets of pages
       a newer one may follow. Pages hold the last weights once an update has no dispatch and none is waiting. */
    uint64_t receivers_waiting;
    uint64_t probes_resampled; /* of models that move */
} dimmer_update_stats;

/* Blends what changed, on the CPU and before it returns. DIMMER_UNSUPPORTED for lights on Vulkan. */
dimmer_result dimmer_lights_update(dimmer_lights* lights, dimmer_update_stats* stats);

/* The pages as they are, page after page, rows from the top, page_count * page_height * page_width texels each: copied,
 * from a Vulkan device too (there it waits for the device: for tools). `texel_count`: the room in each array. */
dimmer_result dimmer_lights_read_pages(dimmer_lights* lights, uint32_t* irradiance, uint32_t* direction,
                                       size_t texel_count);
/* Lights on the CPU alone: the pages themselves, for as long as the lights live; updates change them in place. */
dimmer_result dimmer_lights_get_pages(const dimmer_lights* lights, const uint32_t** irradiance,
                                      const uint32_t** direction, size_t* texel_count);

/* Irradiance in lux, bilinear, of pages as above. `uv`: 0..1 over the page; `normal_tangent`: the unit normal in the
 * texel's tangent frame, {0, 0, 1} for the surface's own. Numbers that are not finite are refused. Any thread, while
 * nothing writes these pages. */
dimmer_result dimmer_sample_lightmap(const dimmer_pack* pack, const uint32_t* irradiance, const uint32_t* direction,
                                     size_t texel_count, uint32_t page, const float uv[2],
                                     const float normal_tangent[3], float lux[3]);

/* ---- Light grids: things that move, and points in the air. ---- */

/* A lattice of probes inside of a box in the model's space, 5 cm in the world off its faces (a tenth of its side at
   most); 1 to 64 probes along each axis, a single one in the middle. */
typedef struct dimmer_model_grid {
    float min_m[3], max_m[3];
    uint32_t counts[3];
} dimmer_model_grid;

/* Handles of models that the same lights removed are refused, not mistaken for later ones; other lights, or lights
 * created anew, take a handle for what they numbered so themselves. */
typedef struct dimmer_model {
    uint32_t index, generation;
} dimmer_model;

/* The next update takes the model's probes from the level's global grid, and again whenever it moved or the light
 * around it changed. `world_from_model`: as of dimmer_placed_model. DIMMER_UNSUPPORTED where the pack has no global
 * grid, DIMMER_OUT_OF_MEMORY where no free range of moving_probes_max is long enough for its probes, in
 * multiples of 8. */
dimmer_result dimmer_lights_add_model(dimmer_lights* lights, const dimmer_model_grid* grid,
                                      const float world_from_model[12], dimmer_model* model);
dimmer_result dimmer_lights_move_model(dimmer_lights* lights, dimmer_model model, const float world_from_model[12]);
dimmer_result dimmer_lights_remove_model(dimmer_lights* lights, dimmer_model model);
/* For shading; changes with the transform alone. */
dimmer_result dimmer_lights_get_model_slot(const dimmer_lights* lights, dimmer_model model, dimmer_model_slot* slot);

/* Lights on the CPU alone: the blended probes, 7 words each, those of models behind the pack's, for as long as the
 * lights live; updates change them in place. */
dimmer_result dimmer_lights_get_probes(const dimmer_lights* lights, const uint32_t** probes, size_t* word_count);

/* Light at a point of the air, from probes as above: irradiance in lux on a surface with this unit normal, or radiance
 * in cd/m2, 9 coefficients of real spherical harmonics (probe_grid.h), r g b each. `hint` may be null; with the last
 * query's answer in it (DIMMER_NONE at first, one per thread) a query nearby is faster. Outside of the level: the light
 * of the grid's nearest point; without a global grid: black. Numbers that are not finite are refused, here and below: a
 * point that is none would have the light of some corner. Any thread, while nothing updates the probes. */
dimmer_result dimmer_sample_air(const dimmer_pack* pack, const uint32_t* probes, size_t word_count,
                                const float point_m[3], const float normal[3], uint32_t* hint, float lux[3]);
dimmer_result dimmer_sample_radiance(const dimmer_pack* pack, const uint32_t* probes, size_t word_count,
                                     const float point_m[3], uint32_t* hint, float radiance[27]);
/* The same on a model, that moves or stands, from its own probes. */
dimmer_result dimmer_sample_model(const dimmer_pack* pack, const uint32_t* probes, size_t word_count,
                                  const dimmer_model_slot* slot, const float point_m[3], const float normal[3],
                                  float lux[3]);

#ifndef DIMMER_NO_VULKAN

/* The caller's device: Vulkan 1.2, of the instance too, with timelineSemaphore, and a queue with compute. It must
 * outlive the lights. */
typedef struct dimmer_vulkan {
    VkInstance instance;
    VkPhysicalDevice physical_device;
    VkDevice device;
    VkQueue queue;
    uint32_t queue_family; /* the queue's, and that of the command buffers given to dimmer_lights_record() */
    VkQueue compute_queue; /* optional: where dimmer_lights_submit() runs; VK_NULL_HANDLE: on `queue` */
    uint32_t compute_queue_family;
    /* What Dimmer asks for Vulkan's functions, once, in create. NULL: the system's loader (libvulkan.so.1,
     * vulkan-1.dll), which create opens then, and nothing before. An engine whose instance is another loader's gives
     * that one's. The functions are the process's: all lights that live at one time need the same ones. */
    PFN_vkGetInstanceProcAddr get_instance_proc_addr;
    VkPipelineCache pipeline_cache; /* optional: create makes its pipelines with it */
    /* Optional, both or neither: called around each single use of a queue, which is short and never within another one.
     * For games with threads that submit to the same queues meanwhile, as frames go on while a level is created. */
    void (*lock_queue)(void* user, VkQueue queue);
    void (*unlock_queue)(void* user, VkQueue queue);
    void* lock_user; /* the first argument of both */
} dimmer_vulkan;

typedef enum dimmer_buffering {
    DIMMER_IN_PLACE = 0,        /* updates write the pages and probes that frames read, between barriers of their own */
    DIMMER_DOUBLE_BUFFERED = 1, /* two sets of pages and of probes that take turns; twice the memory for both */
    DIMMER_BUFFERING_MIN_ENUM = -0x7fffffff, /* these two are none: any int is a value, and refused */
    DIMMER_BUFFERING_MAX_ENUM = 0x7fffffff
} dimmer_buffering;

/* All 0 is the default. */
typedef struct dimmer_vulkan_options {
    dimmer_buffering buffering;
    uint32_t moving_probes_max; /* room for so many probes of models that move; at most DIMMER_MOVING_PROBES_MAX */
    uint32_t frames_in_flight;  /* updates that may be on their way at a time, 1 to 8; 0 is 1 */
    /* Device memory for texels' records, in bytes; 0: room for all. Less needs start_without_records: then light sets
     * are loaded and dropped as the game moves on. */
    uint64_t records_bytes_max;
    int start_without_records; /* not 0: every light set is held at 0 until dimmer_lights_load_records() brings it */
    int without_timestamps;    /* not 0: dimmer_update_stats::gpu_us stays 0 */
} dimmer_vulkan_options;

/* `options`: may be null. DIMMER_INVALID_ARGUMENT: a null handle (only compute_queue and pipeline_cache may be), a
 * queue family that the device does not have, or one without compute; options out of their range.
 * DIMMER_OUT_OF_MEMORY: of the device's or the host's, or records_bytes_max is too little. DIMMER_UNSUPPORTED: a
 * device below Vulkan 1.2, or one without a format or limit that the pack needs; a loader without a function of
 * Vulkan 1.2, or another one than lights have that live. */
dimmer_result dimmer_lights_create_vulkan(const dimmer_pack* pack, const dimmer_vulkan* vulkan,
                                          const dimmer_vulkan_options* options, dimmer_lights** lights);

/* The functions below are DIMMER_UNSUPPORTED for lights on the CPU. */

/* Records the update into the caller's command buffer, outside a render pass, with the barriers that let fragment and
 * compute shaders sample afterwards. The command buffer must be of `queue_family`, and be submitted to `queue`, once,
 * recordings in the order of their calls and before any later dimmer_lights_submit(). Its compute pipeline, compute
 * descriptor sets and push constants are others afterwards. Nothing changed: nothing is recorded (0 dispatches). A call
 * that records overwrites what the commands of `frames_in_flight` updates ago read: their submission must have
 * completed, as the fence of so many frames ago says; where dimmer_lights_submit() made it, the call blocks until then,
 * and where that has a queue of its own, until all that it sent is done. */
dimmer_result dimmer_lights_record(dimmer_lights* lights, VkCommandBuffer commands, dimmer_update_stats* stats);
/* What the last call that found work recorded will never run (a frame was given up): the next update does its work.
 * Calls that found nothing to do may have come since. DIMMER_NOT_FOUND where dimmer_lights_submit() found work since,
 * or it was taken back already. Of several recordings only the last can be taken back; dimmer_lights_invalidate() makes
 * up for others. */
dimmer_result dimmer_lights_discard_recorded(dimmer_lights* lights);
/* Nobody knows which updates ran: the next ones write all that any could have written. */
dimmer_result dimmer_lights_invalidate(dimmer_lights* lights);

/* The same with a command buffer of its own. Returns at once, but with work while `frames_in_flight` earlier ones are
 * under way; the lights' semaphore tells when it is done. It does not wait for what was recorded, of which the same
 * must have completed as before dimmer_lights_record(), and all where it has a queue of its own. */
dimmer_result dimmer_lights_submit(dimmer_lights* lights, dimmer_update_stats* stats);
/* The same, once `semaphore` (null: nothing) has `value`: with a queue of its own an update must wait for the frames
 * that read what it writes, pages or probes: in place what dimmer_lights_get_images() and
 * dimmer_lights_get_probe_buffers() name, with DIMMER_DOUBLE_BUFFERED the other sets than those that they name before
 * the call. Timeline semaphores only: where nothing changed, nothing is submitted and nothing waits, and a binary
 * semaphore would stay signalled. A value that nobody ever signals blocks dimmer_lights_wait(), the next update with
 * work and dimmer_lights_destroy() for ever. */
dimmer_result dimmer_lights_submit_after(dimmer_lights* lights, VkSemaphore semaphore, uint64_t value,
                                         dimmer_update_stats* stats);
/* Blocks until what was submitted is done, and gives the last update's figures, its time on the GPU included. */
dimmer_result dimmer_lights_wait(dimmer_lights* lights, dimmer_update_stats* stats);
/* A timeline semaphore, and the value that the last submission signals; 0 before the first. */
dimmer_result dimmer_lights_get_semaphore(const dimmer_lights* lights, VkSemaphore* semaphore, uint64_t* value);

/* 2D arrays, one layer per page, in SHADER_READ_ONLY_OPTIMAL between updates: who brings them to another layout brings
 * them back before the next. */
typedef struct dimmer_images {
    VkImage irradiance;
    VkImageView irradiance_view;
    VkImage direction;
    VkImageView direction_view;
    VkSampler sampler; /* bilinear, clamp to edge */
    uint32_t width, height, layers;
} dimmer_images;

/* Storage buffers for grid.glsl: the probes that go with the last update, models' behind the pack's, and the global
 * grid's tables; VK_NULL_HANDLE where there are none. With DIMMER_DOUBLE_BUFFERED, ask after each update. */
dimmer_result dimmer_lights_get_probe_buffers(const dimmer_lights* lights, VkBuffer* probes, VkBuffer* grid_table);

/* What to sample after the last update; with DIMMER_DOUBLE_BUFFERED, ask after each, even after one of 0 dispatches:
 * where the other set of pages held the state already, it is shown without a recording. */
dimmer_result dimmer_lights_get_images(const dimmer_lights* lights, dimmer_images* images);

/* With DIMMER_DOUBLE_BUFFERED pages and probes have two sets each, 0 and 1, that never change: descriptors are written
 * once for each. dimmer_lights_get_sets() tells after each update which to bind; the two numbers need not be the same.
 * The next update writes the other sets. In place there is set 0. DIMMER_NOT_FOUND for other numbers. */
dimmer_result dimmer_lights_get_sets(const dimmer_lights* lights, uint32_t* page_set, uint32_t* probe_set);
dimmer_result dimmer_lights_get_images_of_set(const dimmer_lights* lights, uint32_t page_set, dimmer_images* images);
dimmer_result dimmer_lights_get_probes_of_set(const dimmer_lights* lights, uint32_t probe_set, VkBuffer* probes);

/* Texels' records of a light set on the device. One whose records are not loaded is at 0 and refuses other weights. */
typedef enum dimmer_records_state {
    DIMMER_RECORDS_LOADED = 0,
    DIMMER_RECORDS_LOADING = 1,
    DIMMER_RECORDS_DROPPED = 2
} dimmer_records_state;

/* Off from now on, with the next update, and its memory is free for other sets. What was recorded before must have been
 * submitted, and have completed where dimmer_lights_submit() has a queue of its own; or it never runs
 * (dimmer_lights_discard_recorded()). */
dimmer_result dimmer_lights_drop_records(dimmer_lights* lights, uint32_t light_set);
/* Begins to bring them (back); dimmer_lights_continue_loading() does it, and then the set takes any weight.
 * DIMMER_OUT_OF_MEMORY: no free range of records_bytes_max is long enough; nothing was changed. */
dimmer_result dimmer_lights_load_records(dimmer_lights* lights, uint32_t light_set);
dimmer_result dimmer_lights_get_records_state(const dimmer_lights* lights, uint32_t light_set,
                                              dimmer_records_state* state);
/* Of the memory for records: what a light set's take, and what no set's do. */
dimmer_result dimmer_lights_get_record_bytes(const dimmer_lights* lights, uint32_t light_set, uint64_t* set_bytes,
                                             uint64_t* free_bytes);
/* Once a frame: copies a piece of about so many bytes, 4 MiB at most (and for 0), and never waits. Of all that was
 * asked for since nothing was loading, `done_bytes` of `total_bytes` are there; either may be null. Equal: all is
 * loaded. */
dimmer_result dimmer_lights_continue_loading(dimmer_lights* lights, uint64_t bytes_max, uint64_t* done_bytes,
                                             uint64_t* total_bytes);

#endif

#ifdef __cplusplus
}
#endif

#endif
