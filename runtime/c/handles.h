// What the C interface's handles point to, and how errors and exceptions become results.
#pragma once

#include <dimmer/cpu_runtime.h>
#include <dimmer/dimmer.h>
#include <dimmer/runtime.h>

#include <cmath>
#include <exception>
#include <initializer_list>
#include <new>
#include <span>
#include <variant>

struct dimmer_pack {
    dimmer::Pack pack;
};

struct dimmer_lights {
    std::variant<dimmer::CpuRuntime, dimmer::Runtime> runtime;

    dimmer::LightState& state() {
        return std::visit([](auto& r) -> dimmer::LightState& { return r; }, runtime);
    }
    const dimmer::LightState& state() const {
        return std::visit([](const auto& r) -> const dimmer::LightState& { return r; }, runtime);
    }
};

namespace dimmer::c {

// Keeps the message for dimmer_error_message().
dimmer_result report(ErrorCode code, const char* message) noexcept;
inline dimmer_result report(const Error& error) noexcept {
    return report(error.code, error.message.c_str());
}

// `call` returns a dimmer_result. No exception gets to C.
template <class Call>
dimmer_result guarded(Call&& call) noexcept {
    try {
        return call();
    } catch (const std::bad_alloc&) {
        return report(ErrorCode::OutOfMemory, "there is not enough memory");
    } catch (const std::exception& problem) {
        return report(ErrorCode::Internal, problem.what());
    }
}

// Whether none of the pointers is null; reports it otherwise.
template <class... Pointers>
bool given(const Pointers*... pointers) noexcept {
    if ((... && (pointers != nullptr))) return true;
    report(ErrorCode::InvalidArgument, "a null pointer was passed where an object or a place for a result is needed");
    return false;
}

// Whether all numbers are finite; reports it otherwise.
inline bool finite(std::initializer_list<std::span<const float>> all) noexcept {
    for (const std::span<const float> some : all)
        for (const float v : some)
            if (!std::isfinite(v)) {
                report(ErrorCode::InvalidArgument, "a place or normal is not a finite number");
                return false;
            }
    return true;
}

// The runtime behind the lights, or null, and reported, where it is the other one.
template <class Wanted, class Lights>
auto* runtimeAs(Lights* lights) {
    auto* runtime = std::get_if<Wanted>(&lights->runtime);
    if (!runtime)
        report(ErrorCode::Unsupported, std::is_same_v<Wanted, CpuRuntime>
                                           ? "these lights are blended by Vulkan, not on the CPU"
                                           : "these lights are blended on the CPU, not by Vulkan");
    return runtime;
}

// Reports that the pack has no `what` of that number.
dimmer_result noSuch(const char* what, uint32_t index, size_t count);

// The result of an Expected<void>.
inline dimmer_result finish(const Expected<void>& done) noexcept {
    return done ? DIMMER_OK : report(done.error());
}

// The same with statistics, for which `out` may be null.
dimmer_result finish(const Expected<UpdateStats>& done, dimmer_update_stats* out) noexcept;

}  // namespace dimmer::c
