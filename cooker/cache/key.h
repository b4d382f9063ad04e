// Names of cache entries: hashes of exactly what an entry depends on.
#pragma once

#include <xxhash.h>

#include <compare>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace dimmer::cook {

// 128 bits of XXH3: entries are never compared with what they were made from, so keys must not meet by chance.
struct Key {
    uint64_t high = 0, low = 0;
    auto operator<=>(const Key&) const = default;
    std::string hex() const;  // 32 digits
};

// Order matters: every part is hashed with its length where it has one.
class KeyBuilder {
   public:
    explicit KeyBuilder(std::string_view kind);  // for results of this code
    static KeyBuilder ofAnyCode(std::string_view kind);

    // Numbers, enums and structures of them without padding.
    template <class T>
    requires std::has_unique_object_representations_v<T> KeyBuilder& add(const T& value) {
        return addBytes(&value, sizeof(T));
    }
    // 0 and -0 are different light to nobody, but they are different bytes.
    KeyBuilder& add(float value) { return addBytes(&value, sizeof(value)); }
    KeyBuilder& add(std::string_view text);
    KeyBuilder& add(const Key& key) { return addBytes(&key, sizeof(key)); }
    // Arrays of what holds nothing but numbers.
    template <class T>
    KeyBuilder& addArray(std::span<const T> values) {
        static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % 4 == 0 && alignof(T) <= 4);
        add(uint64_t{values.size()});
        return addBytes(values.data(), values.size_bytes());
    }
    template <class T>
    KeyBuilder& addOptional(const std::optional<T>& value) {
        add(uint32_t{value.has_value()});
        return value ? add(*value) : *this;
    }
    Key finish() const;

   private:
    KeyBuilder();
    KeyBuilder& addBytes(const void* data, size_t bytes);

    struct Free {
        void operator()(XXH3_state_t* state) const { XXH3_freeState(state); }
    };
    std::unique_ptr<XXH3_state_t, Free> state_;
};

// Hash of the cooker's sources: a cache never outlives the code that filled it.
std::string_view codeStamp();

}  // namespace dimmer::cook
