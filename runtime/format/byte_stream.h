// Serialisation of the small tables: little-endian scalars, and strings and arrays with a 32-bit count in front.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace dimmer::format {

static_assert(std::endian::native == std::endian::little, "packs are little-endian and are read in place");

class ByteWriter {
   public:
    template <class T>
    requires std::is_trivially_copyable_v<T>
    void put(const T& value) {
        const auto* p = reinterpret_cast<const std::byte*>(&value);
        bytes_.insert(bytes_.end(), p, p + sizeof(T));
    }
    template <class T>
    void putArray(std::span<const T> values) {
        put(static_cast<uint32_t>(values.size()));
        const auto raw = std::as_bytes(values);
        bytes_.insert(bytes_.end(), raw.begin(), raw.end());
    }
    void putString(const std::string& text) { putArray(std::span<const char>(text)); }
    std::vector<std::byte> take() { return std::move(bytes_); }

   private:
    std::vector<std::byte> bytes_;
};

// Reads what ByteWriter wrote. After a read past the end every further read gives zeros and ok() is false.
class ByteReader {
   public:
    explicit ByteReader(std::span<const std::byte> bytes) : rest_(bytes) {}

    template <class T>
    requires std::is_trivially_copyable_v<T> T get() {
        T value{};
        if (take(sizeof(T))) std::memcpy(&value, taken_.data(), sizeof(T));
        return value;
    }
    template <class T>
    requires std::is_trivially_copyable_v<T> std::vector<T> getArray() {
        const uint64_t count = get<uint32_t>();
        std::vector<T> values;
        if (take(count * sizeof(T)) && count > 0) {
            values.resize(count);
            std::memcpy(values.data(), taken_.data(), taken_.size());
        }
        return values;
    }
    std::string getString() {
        const auto text = getArray<char>();
        return {text.begin(), text.end()};
    }
    // True when `count` items of at least `item_bytes` can still follow: bounds an allocation by the file.
    bool fits(uint64_t count, uint64_t item_bytes) const { return ok_ && count <= rest_.size() / item_bytes; }
    bool ok() const { return ok_; }
    // What was read makes no sense.
    void fail() { ok_ = false; }
    bool atEnd() const { return ok_ && rest_.empty(); }

   private:
    bool take(uint64_t size) {
        ok_ = ok_ && size <= rest_.size();
        if (!ok_) return false;
        taken_ = rest_.first(size);
        rest_ = rest_.subspan(size);
        return true;
    }
    std::span<const std::byte> rest_, taken_;
    bool ok_ = true;
};

}  // namespace dimmer::format
