#include <pipeline/remedy.h>

#include <pipeline/human_bytes.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <set>

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

// Whether `a` changes settings that `b` changes too, fewer of them, and is no worse.
bool dominates(const Remedy& a, const Remedy& b) {
    const auto in_b = [&](const Change& c) {
        return std::ranges::find(b.changes, c.key, &Change::key) != b.changes.end();
    };
    return a.changes.size() < b.changes.size() && std::ranges::all_of(a.changes, in_b) && a.fits >= b.fits &&
           a.saves >= b.saves && a.error <= b.error && a.grid_error <= b.grid_error && a.energy <= b.energy &&
           a.moves_light <= b.moves_light;
}

// Thresholds of single sets are of the same kind as that of all.
std::set<std::string_view> kindOf(const Remedy& remedy) {
    std::set<std::string_view> kind;
    for (const Change& c : remedy.changes)
        kind.insert(c.key.starts_with("records.threshold") ? "records.threshold" : std::string_view(c.key));
    return kind;
}

}  // namespace

std::vector<Remedy> withoutDominated(std::vector<Remedy> found) {
    const std::vector<Remedy> all = found;
    std::erase_if(found, [&](const Remedy& b) {
        return std::ranges::any_of(all, [&](const Remedy& a) { return dominates(a, b); });
    });
    return found;
}

std::vector<Remedy> bestOfEachKind(const std::vector<Remedy>& found) {
    std::vector<Remedy> best;
    for (const Remedy& remedy : found) {
        const auto same = std::ranges::find(best, kindOf(remedy), kindOf);
        if (same == best.end())
            best.push_back(remedy);
        else if (remedy.saves > same->saves)
            *same = remedy;
    }
    return best;
}

std::string Remedy::options() const {
    std::vector<std::string> parts;
    for (const Change& c : changes) parts.push_back("--set " + shellWord(fmt::format("{}={}", c.key, c.to)));
    return fmt::format("{}", fmt::join(parts, " "));
}

std::string Remedy::modelsText() const {
    return grid_error ? fmt::format(", adds {:.2f} % to the light of models", 100 * *grid_error)
                      : ", coarsens the light of models by what is not predicted";
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
                       moves_light ? modelsText() : "", note, all ? "" : "\n    in full: " + options());
}

}  // namespace dimmer::cook
