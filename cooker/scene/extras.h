// The `dimmer_*` keys: where they are looked for, and their types.
#pragma once

#include <scene/import_context.h>

#include <array>
#include <cfloat>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace dimmer::cook {

// The extras that speak for one node, in order of precedence: its own, then its mesh's, light's and materials'.
class Extras {
   public:
    explicit Extras(const ImportContext& context) : context_(&context) {}

    void add(const tinygltf::Value& values, std::string owner);

    bool has(std::string_view key) const { return find(key) != nullptr; }
    // Who states the key: "mesh 'crate'". The key must be there.
    const std::string& ownerOf(std::string_view key) const { return find(key)->owner; }

    // Empty when no one states the key; an error naming owner and key when it has another type. Numbers are finite.
    Expected<std::optional<std::string>> text(std::string_view key) const;
    Expected<std::optional<double>> number(std::string_view key) const;
    Expected<std::optional<double>> positive(std::string_view key, double at_most = DBL_MAX) const;
    Expected<std::optional<std::vector<double>>> numbers(std::string_view key, size_t count) const;
    // true, false, 1 or 0; absent is false.
    Expected<bool> flag(std::string_view key) const;
    // A text that is one of `choices`; returns its index.
    Expected<std::optional<size_t>> choice(std::string_view key, const std::vector<std::string_view>& choices) const;
    // Null when no one states the key.
    const tinygltf::Value* raw(std::string_view key) const;

   private:
    struct Source {
        const tinygltf::Value* values;
        std::string owner;
    };
    const Source* find(std::string_view key) const;
    std::unexpected<Error> wrongType(std::string_view key, std::string_view wanted) const;

    const ImportContext* context_;
    std::vector<Source> sources_;
};

// Of `dimmer_bake`, in the order of BakeMode.
inline constexpr std::array<std::string_view, 3> bake_modes = {"indirect", "full", "none"};

enum class ExtrasPlace { Node, Scene, File };

// Warns of `dimmer_*` keys that do not exist, or not in this place, with the nearest one that does.
void warnUnknownKeys(ImportContext& context, const tinygltf::Value& extras, ExtrasPlace place,
                     const std::string& owner);

// The name of a light set or door, as a game and `--state` can write it.
Expected<void> checkElementName(const ImportContext& context, const std::string& name, std::string_view key,
                                const std::string& owner);

}  // namespace dimmer::cook
