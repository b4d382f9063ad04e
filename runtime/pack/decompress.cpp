#include <pack/decompress.h>

#include <zstd.h>

#include <algorithm>
#include <memory>

namespace dimmer {
namespace {

// The writer's level stays at 22; a frame may not make the decoder reserve more than this.
constexpr int window_log_max = 23;
constexpr uint64_t first_step_bytes = 1 << 16;

}  // namespace

struct Decompressor::State {
    std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context{ZSTD_createDCtx(), &ZSTD_freeDCtx};
};

Decompressor::Decompressor() : state_(std::make_unique<State>()) {
    if (!state_->context) throw std::bad_alloc();
    ZSTD_DCtx_setParameter(state_->context.get(), ZSTD_d_windowLogMax, window_log_max);
}
Decompressor::~Decompressor() = default;

std::optional<std::vector<std::byte>> Decompressor::run(std::span<const std::byte> stored, uint64_t real_bytes) {
    if (ZSTD_getFrameContentSize(stored.data(), stored.size()) != real_bytes) return std::nullopt;
    // What a damaged frame left behind.
    ZSTD_DCtx_reset(state_->context.get(), ZSTD_reset_session_only);

    std::vector<std::byte> out;
    ZSTD_inBuffer in{stored.data(), stored.size(), 0};
    size_t done = 0, hint = 1;
    while (hint != 0) {
        if (done == out.size() && done < real_bytes)
            out.resize(std::min(real_bytes, std::max<uint64_t>({first_step_bytes, 2 * done, 4 * stored.size()})));
        ZSTD_outBuffer free{out.data() + done, out.size() - done, 0};
        const size_t read_before = in.pos;
        hint = ZSTD_decompressStream(state_->context.get(), &free, &in);
        if (ZSTD_isError(hint)) return std::nullopt;
        if (free.pos == 0 && in.pos == read_before && hint != 0) return std::nullopt;  // cut short
        done += free.pos;
    }
    if (done != real_bytes || in.pos != in.size) return std::nullopt;
    return out;
}

}  // namespace dimmer
