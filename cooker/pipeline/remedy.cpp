#include <pipeline/remedy.h>

#include <pipeline/human_bytes.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>

namespace dimmer::cook {
namespace {

constexpr size_t changes_named = 4;

// Names of sets may have spaces, and whatever else.
std::string shellWord(const std::string& text) {
    const auto plain = [](unsigned char c) {
        return std::isalnum(c) || std::string_view("_-./=:,+@%").contains(static_cast<char>(c));
    };
    if (std::ranges::all_of(text, plain)) return text;
    std::string quoted = "'";
    for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return quoted + "'";
}

}  // namespace

std::string Remedy::options() const {
    std::vector<std::string> parts;
    for (const Change& c : changes) parts.push_back("--set " + shellWord(fmt::format("{}={}", c.key, c.to)));
    return fmt::format("{}", fmt::join(parts, " "));
}

std::string Remedy::text(std::string_view note) const {
    std::vector<std::string> parts;
    for (const Change& c : changes)
        if (parts.size() < changes_named) parts.push_back(fmt::format("{} {} -> {}", c.key, c.from, c.to));
    const bool all = parts.size() == changes.size();
    return fmt::format("{}{}: saves {}{}{}{}{}{}", fmt::join(parts, ", "),
                       all ? "" : fmt::format(" and {} more", changes.size() - parts.size()), humanBytes(saves),
                       texels ? fmt::format(", adds a mean error of {:.2f} %", 100 * error) : "",
                       energy > 0 ? fmt::format(", drops {:.2f} % of the light of {}", 100 * energy, energy_of) : "",
                       moves_light ? ", coarsens the light of models by what is not predicted" : "", note,
                       all ? "" : "\n    in full: " + options());
}

}  // namespace dimmer::cook
