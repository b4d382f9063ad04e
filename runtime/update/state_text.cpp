#include <update/state_text.h>

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

namespace dimmer {
namespace {

std::string_view trim(std::string_view text) {
    constexpr std::string_view space = " \t\r\n";
    const size_t first = text.find_first_not_of(space);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(space) - first + 1);
}

std::optional<float> parseNumber(std::string_view text) {
    text = trim(text);
    if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
    // By doubles: the end of a fade that is no float any more is 0 (what is no double either is refused).
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    if (std::abs(value) > static_cast<double>(std::numeric_limits<float>::max()) && !std::isinf(value))
        return std::nullopt;
    return static_cast<float>(value);
}

// A scalar or r/g/b.
std::optional<Weight> parseWeight(std::string_view text) {
    const size_t slash = text.find('/');
    if (slash == std::string_view::npos) {
        const auto scalar = parseNumber(text);
        return scalar ? std::optional(Weight(*scalar)) : std::nullopt;
    }
    const size_t second = text.find('/', slash + 1);
    if (second == std::string_view::npos) return std::nullopt;
    const auto r = parseNumber(text.substr(0, slash));
    const auto g = parseNumber(text.substr(slash + 1, second - slash - 1));
    const auto b = parseNumber(text.substr(second + 1));
    if (!r || !g || !b) return std::nullopt;
    return Weight(*r, *g, *b);
}

Expected<StateAssignment> parseAssignment(std::string_view item) {
    constexpr std::string_view door_prefix = "door:";
    // The last '=' so that a name may hold one.
    const size_t equals = item.rfind('=');
    const std::string_view name = trim(item.substr(0, std::min(equals, item.size())));
    if (equals == std::string_view::npos || name.empty())
        return fail(ErrorCode::InvalidArgument,
                    fmt::format("State item \"{}\" is not NAME=VALUE; an example: hall=0.5,door:front=1.", item));
    const std::string_view value = item.substr(equals + 1);
    const auto weight = parseWeight(value);
    if (!weight)
        return fail(ErrorCode::InvalidArgument,
                    fmt::format("State item \"{}\": \"{}\" is neither a number nor r/g/b.", item, trim(value)));
    if (name.starts_with(door_prefix)) {
        if (value.find('/') != std::string_view::npos)
            return fail(ErrorCode::InvalidArgument,
                        fmt::format("State item \"{}\": a door takes one number, how open it is, 0..1.", item));
        return StateAssignment{StateAssignment::Target::Door, trim(name.substr(door_prefix.size())), *weight};
    }
    return StateAssignment{name == "all" ? StateAssignment::Target::AllSets : StateAssignment::Target::Set, name,
                           *weight};
}

char lowerCase(char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

}  // namespace

// One row at a time.
size_t editDistance(std::string_view a, std::string_view b) {
    std::vector<size_t> row(b.size() + 1);
    for (size_t j = 0; j < row.size(); ++j) row[j] = j;
    for (size_t i = 0; i < a.size(); ++i) {
        size_t diagonal = row[0];
        row[0] = i + 1;
        for (size_t j = 0; j < b.size(); ++j) {
            const size_t substituted = diagonal + (lowerCase(a[i]) == lowerCase(b[j]) ? 0 : 1);
            diagonal = row[j + 1];
            row[j + 1] = std::min({substituted, row[j] + 1, row[j + 1] + 1});
        }
    }
    return row.back();
}

Expected<std::vector<StateAssignment>> parseState(std::string_view text) {
    std::vector<StateAssignment> assignments;
    if (trim(text).empty()) return assignments;
    for (size_t begin = 0; begin <= text.size();) {
        const size_t end = std::min(text.find(',', begin), text.size());
        const std::string_view item = trim(text.substr(begin, end - begin));
        if (item.empty())
            return fail(
                ErrorCode::InvalidArgument,
                fmt::format("State \"{}\": an item is empty, not NAME=VALUE; an example: hall=0.5,door:front=1.",
                            text));
        auto assignment = parseAssignment(item);
        if (!assignment) return std::unexpected(std::move(assignment.error()));
        assignments.push_back(*assignment);
        begin = end + 1;
    }
    return assignments;
}

std::string_view nearestName(std::string_view name, const std::vector<std::string_view>& names) {
    // A third of the letters wrong, two at least, is still a slip of the finger.
    size_t best = std::max<size_t>(2, name.size() / 3) + 1;
    std::string_view nearest;
    for (std::string_view candidate : names) {
        // No fewer edits than letters that one has more.
        if (name.size() + best <= candidate.size() || candidate.size() + best <= name.size()) continue;
        const size_t distance = editDistance(name, candidate);
        if (distance >= best) continue;
        best = distance;
        nearest = candidate;
    }
    return nearest;
}

}  // namespace dimmer
