// The C interface to light sets whose records come and go.
#include <c/handles.h>

#include <fmt/format.h>

using namespace dimmer;
using namespace dimmer::c;

namespace dimmer::c {
namespace {

static_assert(static_cast<int>(RecordsState::Loaded) == DIMMER_RECORDS_LOADED &&
              static_cast<int>(RecordsState::Loading) == DIMMER_RECORDS_LOADING &&
              static_cast<int>(RecordsState::Dropped) == DIMMER_RECORDS_DROPPED);

// Where the runtime's own call has no error to give.
bool isLightSet(const LightState& lights, uint32_t element) {
    const auto elements = lights.pack().elements();
    if (element < elements.size() && elements[element].kind == ElementKind::LightSet) return true;
    report({ErrorCode::InvalidArgument,
            fmt::format("element {} is no light set of this pack; dimmer_pack_find_light_set() gives their numbers",
                        element)});
    return false;
}

}  // namespace
}  // namespace dimmer::c

dimmer_result dimmer_lights_drop_records(dimmer_lights* lights, uint32_t light_set) {
    if (!given(lights)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        auto* runtime = runtimeAs<Runtime>(lights);
        return runtime ? finish(runtime->dropRecords(LightSet{light_set})) : DIMMER_UNSUPPORTED;
    });
}

dimmer_result dimmer_lights_load_records(dimmer_lights* lights, uint32_t light_set) {
    if (!given(lights)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        auto* runtime = runtimeAs<Runtime>(lights);
        return runtime ? finish(runtime->loadRecords(LightSet{light_set})) : DIMMER_UNSUPPORTED;
    });
}

dimmer_result dimmer_lights_get_records_state(const dimmer_lights* lights, uint32_t light_set,
                                              dimmer_records_state* state) {
    if (!given(lights, state)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto* runtime = runtimeAs<Runtime>(lights);
        if (!runtime) return DIMMER_UNSUPPORTED;
        if (!isLightSet(*runtime, light_set)) return DIMMER_INVALID_ARGUMENT;
        *state = static_cast<dimmer_records_state>(runtime->recordsState(LightSet{light_set}));
        return DIMMER_OK;
    });
}

dimmer_result dimmer_lights_get_record_bytes(const dimmer_lights* lights, uint32_t light_set, uint64_t* set_bytes,
                                             uint64_t* free_bytes) {
    if (!given(lights, set_bytes, free_bytes)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        const auto* runtime = runtimeAs<Runtime>(lights);
        if (!runtime) return DIMMER_UNSUPPORTED;
        if (!isLightSet(*runtime, light_set)) return DIMMER_INVALID_ARGUMENT;
        *set_bytes = runtime->recordBytes(LightSet{light_set});
        *free_bytes = runtime->freeRecordBytes();
        return DIMMER_OK;
    });
}

dimmer_result dimmer_lights_continue_loading(dimmer_lights* lights, uint64_t bytes_max, uint64_t* done_bytes,
                                             uint64_t* total_bytes) {
    if (!given(lights)) return DIMMER_INVALID_ARGUMENT;
    return guarded([&] {
        auto* runtime = runtimeAs<Runtime>(lights);
        if (!runtime) return DIMMER_UNSUPPORTED;
        const auto progress = runtime->continueLoading(bytes_max);
        if (!progress) return report(progress.error());
        if (done_bytes) *done_bytes = progress->done_bytes;
        if (total_bytes) *total_bytes = progress->total_bytes;
        return DIMMER_OK;
    });
}
