#include <cache/key.h>

#include <code_stamp.h>

#include <fmt/format.h>

namespace dimmer::cook {

std::string Key::hex() const {
    return fmt::format("{:016x}{:016x}", high, low);
}

KeyBuilder::KeyBuilder() : state_(XXH3_createState()) {
    XXH3_128bits_reset(state_.get());
}

KeyBuilder::KeyBuilder(std::string_view kind) : KeyBuilder() {
    add(codeStamp()).add(kind);
}

KeyBuilder KeyBuilder::ofAnyCode(std::string_view kind) {
    KeyBuilder key;
    key.add(kind);
    return key;
}

KeyBuilder& KeyBuilder::add(std::string_view text) {
    add(uint64_t{text.size()});
    return addBytes(text.data(), text.size());
}

KeyBuilder& KeyBuilder::addBytes(const void* data, size_t bytes) {
    XXH3_128bits_update(state_.get(), data, bytes);
    return *this;
}

Key KeyBuilder::finish() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(state_.get());
    return {hash.high64, hash.low64};
}

std::string_view codeStamp() {
    return code_stamp;
}

}  // namespace dimmer::cook
