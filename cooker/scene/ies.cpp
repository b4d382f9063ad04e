#include <scene/ies.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

namespace dimmer::cook {
namespace {

constexpr float deg_per_rad = 180 / std::numbers::pi_v<float>;
// Directions on the rim of the measured range count as inside: what the angle's own rounding costs.
constexpr float rim_deg = 1e-3f;
// Far more than any goniophotometer gives (0.1 degrees all around); a bound for what a hostile file can ask for.
constexpr int angles_max = 4000;

enum class Standard { Lm1986, Lm1991, Lm1995, Lm2002, Lm2019 };

bool isSpace(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\f' || c == '\v';
}

std::string_view trimmed(std::string_view s) {
    while (!s.empty() && isSpace(s.front())) s.remove_prefix(1);
    while (!s.empty() && isSpace(s.back())) s.remove_suffix(1);
    return s;
}

// Lines, then numbers. The first failure sticks: what is read after it is 0, and the caller asks once.
class Reader {
   public:
    Reader(std::string_view text, const std::string& file) : rest_(text), file_(file) {}

    bool atEnd() const { return rest_.empty(); }
    int line() const { return line_; }
    bool ok() const { return !error_; }
    const Error& error() const { return *error_; }

    void refuse(int line, std::string_view what) {
        if (!error_) error_ = Error{ErrorCode::BadInput, fmt::format("{}:{}: {}", file_, line, what)};
    }

    std::string_view nextLine() {
        const size_t end = rest_.find('\n');
        const std::string_view line = rest_.substr(0, end);
        rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
        ++line_;
        return trimmed(line);
    }

    // The next number, separated from others by blanks, line ends or a comma.
    double number(std::string_view what, double least, double most) {
        const std::string_view token = nextToken();
        if (!ok()) return 0;
        double value = 0;
        const char* begin = token.data() + (token.starts_with('+') ? 1 : 0);
        const char* end = token.data() + token.size();
        const auto [stop, problem] = std::from_chars(begin, end, value);
        if (token.empty())
            refuse(token_line_, fmt::format("the file ends where {} is due. Get the whole file.", what));
        else if (problem != std::errc() || stop != end || !std::isfinite(value))
            refuse(token_line_, fmt::format("'{:.20}' is not a number; {} is due here. Correct it.", token, what));
        else if (!(value >= least && value <= most))
            refuse(token_line_,
                   fmt::format("{} is {}; it must be within {} and {}. Correct it.", what, value, least, most));
        return ok() ? value : 0;
    }

    int count(std::string_view what, int least, int most) {
        const double value = number(what, least, most);
        if (ok() && value != std::floor(value))
            refuse(token_line_, fmt::format("{} is {}; it must be a whole number. Correct it.", what, value));
        return ok() ? static_cast<int>(value) : 0;
    }

    // But for the end-of-file mark of old systems, and a keyword, as some programs write [EOF]. Numbers that are left
    // mean that a count is wrong.
    void expectEnd(std::string_view what) {
        const std::string_view token = nextToken();
        if (!token.empty() && token != "\x1a" && !token.starts_with('['))
            refuse(token_line_,
                   fmt::format("'{:.20}' follows {}. Correct the numbers of angles, or remove it.", token, what));
    }

    // The line of the last number read.
    int numberLine() const { return token_line_; }

   private:
    std::string_view nextToken() {
        const auto separates = [](char c) { return isSpace(c) || c == ','; };
        while (!rest_.empty() && separates(rest_.front())) {
            line_ += rest_.front() == '\n';
            rest_.remove_prefix(1);
        }
        if (!rest_.empty()) token_line_ = line_ + 1;
        const auto end = std::ranges::find_if(rest_, separates);
        const std::string_view token = rest_.substr(0, static_cast<size_t>(end - rest_.begin()));
        rest_.remove_prefix(token.size());
        return token;
    }

    std::string_view rest_;
    const std::string& file_;
    int line_ = 0;  // lines left behind
    int token_line_ = 1;
    std::optional<Error> error_;
};

constexpr double any_number = 1e30;  // large enough for every quantity, small enough for a float

// One horizontal angle of the unfolded distribution and the file's column that it repeats.
struct Column {
    float horizontal_deg;
    size_t source;
};

class Parser {
   public:
    Parser(std::string_view text, const std::string& file) : in_(text, file), file_(file) {}

    Expected<LightProfileFile> run() {
        for (const auto step : {&Parser::header, &Parser::tilt, &Parser::lamp, &Parser::angles, &Parser::candela}) {
            (this->*step)();
            if (!in_.ok()) return std::unexpected(in_.error());
        }
        return std::move(out_);
    }

   private:
    void note(std::string_view text) { out_.notes.push_back(fmt::format("{}:{}: {}", file_, in_.line(), text)); }

    void header() {
        struct Known {
            std::string_view line;
            Standard standard;
        };
        constexpr std::array<Known, 4> known = {{{"IESNA91", Standard::Lm1991},
                                                 {"IESNA:LM-63-1995", Standard::Lm1995},
                                                 {"IESNA:LM-63-2002", Standard::Lm2002},
                                                 {"IES:LM-63-2019", Standard::Lm2019}}};
        tilt_ = in_.nextLine();
        constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
        if (tilt_.starts_with(byte_order_mark)) tilt_.remove_prefix(byte_order_mark.size());
        if (const auto* const it = std::ranges::find(known, tilt_, &Known::line); it != known.end())
            standard_ = it->standard;
        else if (tilt_.starts_with("IES"))
            in_.refuse(1,
                       "an unknown LM-63 version. Known: none (1986), IESNA91, IESNA:LM-63-1995, IESNA:LM-63-2002, "
                       "IES:LM-63-2019.");
        // Labels and keywords are for people.
        while (!tilt_.starts_with("TILT=") && !in_.atEnd()) tilt_ = in_.nextLine();
        if (!tilt_.starts_with("TILT="))
            in_.refuse(in_.line(), "has no line 'TILT=...', so it is not an IES profile. Export it as IES LM-63.");
    }

    void tilt() {
        const std::string_view kind = trimmed(tilt_.substr(std::string_view("TILT=").size()));
        if (kind == "NONE") return;
        if (kind.empty()) return in_.refuse(in_.line(), "TILT says nothing. Write TILT=NONE.");
        note("the lamp's output by tilt is not applied.");
        if (kind != "INCLUDE") return;
        in_.count("the lamp-to-luminaire geometry", 1, 3);
        const int pairs = in_.count("the number of tilt angles", 1, angles_max);
        for (int i = 0; i < pairs && in_.ok(); ++i) in_.number("a tilt angle", 0, 180);
        for (int i = 0; i < pairs && in_.ok(); ++i) in_.number("a tilt factor", 0, any_number);
    }

    void lamp() {
        in_.number("the number of lamps", 0, any_number);
        in_.number("the lumens per lamp", -any_number, any_number);  // -1: absolute photometry
        factor_ = in_.number("the candela multiplier", 0, any_number);
        verticals_ = in_.count("the number of vertical angles", 2, angles_max);
        horizontals_ = in_.count("the number of horizontal angles", 1, angles_max);
        const int type = in_.count("the photometric type", 1, 3);
        if (in_.ok() && type != 1)
            in_.refuse(in_.numberLine(), fmt::format("is type {} photometry; only type C (1) is supported. Convert it.",
                                                     type == 2 ? "B (2)" : "A (3)"));
        in_.count("the units type", 1, 2);
        for (const char* side : {"the width", "the length", "the height"}) in_.number(side, -any_number, any_number);
        factor_ *= in_.number("the ballast factor", 0, any_number);
        // Up to 1991 a factor of the candela; then left for future use, and from 2019 on a code.
        const double second = in_.number("the ballast-lamp photometric factor", -any_number, any_number);
        if (standard_ <= Standard::Lm1991) {
            factor_ *= second;
            if (second < 0)
                in_.refuse(in_.numberLine(), "the ballast-lamp photometric factor is negative. Correct it.");
        }
        in_.number("the input watts", -any_number, any_number);
    }

    std::vector<float> ascending(std::string_view what, int count, double most) {
        std::vector<float> angles;
        for (int i = 0; i < count && in_.ok(); ++i) {
            angles.push_back(static_cast<float>(in_.number(what, 0, most)));
            if (i > 0 && in_.ok() && !(angles[angles.size() - 2] < angles.back()))
                in_.refuse(in_.numberLine(), fmt::format("{} does not exceed the one before. Sort the angles.", what));
        }
        return angles;
    }

    void angles() {
        out_.profile.vertical_deg = ascending("a vertical angle", verticals_, 180);
        const std::vector<float> horizontal = ascending("a horizontal angle", horizontals_, 360);
        if (!in_.ok()) return;
        unfold(horizontal);
        if (columns_.empty())
            in_.refuse(in_.numberLine(),
                       fmt::format("horizontal angles from {} to {} are none of LM-63's: 0 alone, 0 to "
                                   "90, 0 to 180, 0 to 360, or 90 to 270.",
                                   horizontal.front(), horizontal.back()));
    }

    // LM-63: the last horizontal angle tells the symmetry.
    void unfold(const std::vector<float>& h) {
        const float first = h.front(), last = h.back();
        const bool none = first == 0 && last > 180, quadrant = first == 0 && last == 90;
        const bool lateral = first == 0 && last == 180, frontal = first == 90 && last == 270;
        if (!(none || quadrant || lateral || frontal || (h.size() == 1 && first == 0))) return;
        for (size_t i = 0; i < h.size(); ++i) {
            columns_.push_back({h[i], i});
            if (quadrant) columns_.push_back({180 - h[i], i});
            if (quadrant) columns_.push_back({180 + h[i], i});
            if (quadrant || lateral) columns_.push_back({360 - h[i], i});
            if (frontal) columns_.push_back({h[i] <= 180 ? 180 - h[i] : 540 - h[i], i});
        }
        std::ranges::stable_sort(columns_, {}, &Column::horizontal_deg);
        const auto repeated = std::ranges::unique(columns_, {}, &Column::horizontal_deg);
        columns_.erase(repeated.begin(), repeated.end());
        // Around the circle: no direction is outside.
        const Column before = columns_.back(), after = columns_.front();
        if (before.horizontal_deg < 360) columns_.push_back({after.horizontal_deg + 360, after.source});
        if (after.horizontal_deg > 0) columns_.insert(columns_.begin(), {before.horizontal_deg - 360, before.source});
    }

    void candela() {
        const size_t wanted = static_cast<size_t>(verticals_) * static_cast<size_t>(horizontals_);
        std::vector<double> values;
        while (values.size() < wanted && in_.ok()) values.push_back(in_.number("a candela value", 0, any_number));
        if (in_.ok()) in_.expectEnd("the last candela value");
        if (!in_.ok()) return;
        const double peak = *std::ranges::max_element(values);
        LightProfile& p = out_.profile;
        p.peak_cd = static_cast<float>(peak * factor_);
        if (!(p.peak_cd > 0) || !std::isfinite(p.peak_cd))
            return in_.refuse(in_.numberLine(),
                              fmt::format("the largest intensity is {} cd. Correct the values or their "
                                          "multiplier.",
                                          peak * factor_));
        for (const Column& c : columns_) {
            p.horizontal_deg.push_back(c.horizontal_deg);
            const auto* const column = &values[c.source * static_cast<size_t>(verticals_)];
            for (int v = 0; v < verticals_; ++v) p.share.push_back(static_cast<float>(column[v] / peak));
        }
    }

    Reader in_;
    const std::string& file_;
    Standard standard_ = Standard::Lm1986;
    std::string_view tilt_;
    double factor_ = 1;
    int verticals_ = 0, horizontals_ = 0;
    std::vector<Column> columns_;
    LightProfileFile out_;
};

// Where `angle` lies among ascending angles: the interval's first index, and how far into it.
struct Place {
    size_t index;
    float part;
};
Place locate(const std::vector<float>& angles, float angle) {
    const auto above = std::upper_bound(angles.begin() + 1, angles.end() - 1, angle);
    const auto index = static_cast<size_t>(above - angles.begin()) - 1;
    const float low = angles[index], high = angles[index + 1];
    return {index, std::clamp((angle - low) / (high - low), 0.0f, 1.0f)};
}

constexpr std::array<float, 7> beam_shares = {0.5f, 0.2f, 0.1f, 0.05f, 0.02f, 0.01f, 0};
constexpr float beam_cos_min = std::numbers::sqrt2_v<float> / 2;
constexpr int beam_columns = 32;  // all around, beside the file's own

glm::vec3 directionOf(float vertical_deg, float horizontal_deg) {
    const float v = vertical_deg / deg_per_rad, h = horizontal_deg / deg_per_rad;
    return {std::sin(v) * std::cos(h), std::sin(v) * std::sin(h), -std::cos(v)};
}

// Where what is brighter than half of the peak goes to in the mean.
glm::vec3 axisOf(const LightProfile& p) {
    const std::vector<float>& v = p.vertical_deg;
    glm::vec3 sum(0), brightest(0, 0, -1);
    float most = 0;
    for (size_t i = 0; i < v.size(); ++i) {
        const float width_deg = v[std::min(i + 1, v.size() - 1)] - v[i == 0 ? 0 : i - 1];
        for (int k = 0; k < beam_columns; ++k) {
            const glm::vec3 direction = directionOf(v[i], 360.0f / beam_columns * static_cast<float>(k));
            const float share = p.shareTowards(direction);
            if (share > most) most = share, brightest = direction;
            if (share > beam_shares[0]) sum += direction * (share * width_deg * std::sin(v[i] / deg_per_rad));
        }
    }
    return glm::length(sum) > 0 ? glm::normalize(sum) : brightest;
}

// Cosines of the cones about the axis that hold all that is brighter than each of beam_shares.
std::array<float, beam_shares.size()> coneCosines(const LightProfile& p) {
    std::vector<float> columns = p.horizontal_deg;
    for (int k = 0; k <= beam_columns; ++k) columns.push_back(360.0f / beam_columns * static_cast<float>(k));
    std::ranges::sort(columns);
    const std::vector<float>& v = p.vertical_deg;
    const size_t rows = v.size();
    std::vector<float> shares;
    for (const float h : columns)
        for (const float angle : v) shares.push_back(p.shareTowards(directionOf(angle, h)));
    std::array<float, beam_shares.size()> cosines;
    cosines.fill(1);
    for (size_t c = 0; c < columns.size(); ++c)
        for (size_t i = 0; i < rows; ++i) {
            float share = 0;  // between it and its neighbours it may be brighter than it is itself
            for (size_t d = c == 0 ? 0 : c - 1; d <= std::min(c + 1, columns.size() - 1); ++d)
                for (size_t k = i == 0 ? 0 : i - 1; k <= std::min(i + 1, rows - 1); ++k)
                    share = std::max(share, shares[d * rows + k]);
            const float cosine = glm::dot(directionOf(v[i], columns[c]), p.beam_axis);
            for (size_t k = 0; k < cosines.size(); ++k)
                if (share > beam_shares[k]) cosines[k] = std::min(cosines[k], cosine);
        }
    return cosines;
}

void findBeam(LightProfile& p) {
    p.beam_axis = axisOf(p);
    for (const float cosine : coneCosines(p)) {
        const float wider = std::cos(std::acos(std::min(cosine, 1.0f)) + 2 * rim_deg / deg_per_rad);
        if (wider < beam_cos_min) break;
        if (p.beam_cos.empty() || wider < p.beam_cos.back()) p.beam_cos.push_back(wider);
    }
}

}  // namespace

float LightProfile::shareTowards(glm::vec3 direction) const {
    // Not acos, which loses the angle near the axis.
    const float vertical = std::atan2(glm::length(glm::vec2(direction)), -direction.z) * deg_per_rad;
    if (vertical < vertical_deg.front() - rim_deg || vertical > vertical_deg.back() + rim_deg) return 0;
    float horizontal = std::atan2(direction.y, direction.x) * deg_per_rad;
    if (horizontal < 0) horizontal += 360;
    const Place v = locate(vertical_deg, vertical), h = locate(horizontal_deg, horizontal);
    const float* const column = &share[h.index * vertical_deg.size() + v.index];
    const float* const next = column + vertical_deg.size();
    return glm::mix(glm::mix(column[0], column[1], v.part), glm::mix(next[0], next[1], v.part), h.part);
}

Expected<LightProfileFile> parseLightProfile(std::string_view text, const std::string& file) {
    auto parsed = Parser(text, file).run();
    if (parsed) findBeam(parsed->profile);
    return parsed;
}

}  // namespace dimmer::cook
