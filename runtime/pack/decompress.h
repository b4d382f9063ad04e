// Decompression that never gets ahead of its input.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace dimmer {

// Of many frames, one after another: making zstd's state anew for each costs as much as decoding a small one.
class Decompressor {
   public:
    Decompressor();
    ~Decompressor();
    // Decodes one zstd frame of exactly `real_bytes`. Memory grows with what has really been decoded, so a frame that
    // only claims to be large costs little. Empty when the frame is damaged or of another size.
    std::optional<std::vector<std::byte>> run(std::span<const std::byte> stored, uint64_t real_bytes);

   private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace dimmer
