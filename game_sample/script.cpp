#include "script.h"

#include <dimmer/cpu_runtime.h>
#include <dimmer/probe_grid.h>
#include <fmt/format.h>
#include <gpu/vk_result.h>
#include <update/state_text.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/gtc/constants.hpp>

namespace dimmer::sample {
namespace {

constexpr std::string_view space = " \t\r";  // \r: of lines that end as on Windows

std::string_view trim(std::string_view text) {
    const size_t first = text.find_first_not_of(space);
    return first == std::string_view::npos ? std::string_view()
                                           : text.substr(first, text.find_last_not_of(space) - first + 1);
}

// The words of one line, taken from the left. A word in double quotes may hold spaces.
class Words {
   public:
    explicit Words(std::string_view line) : rest_(trim(line)) {}

    bool empty() const { return rest_.empty(); }
    std::string_view rest() const { return rest_; }

    // Empty when there are no more.
    std::string_view next() {
        const bool quoted = rest_.starts_with('"');
        const size_t begin = quoted ? 1 : 0;
        const size_t end = std::min(rest_.find_first_of(quoted ? "\"" : space, begin), rest_.size());
        const std::string_view word = rest_.substr(begin, end - begin);
        rest_ = trim(rest_.substr(std::min(end + begin, rest_.size())));
        return word;
    }

    bool accept(std::string_view word) {
        Words ahead = *this;
        if (ahead.next() != word) return false;
        *this = ahead;
        return true;
    }

   private:
    std::string_view rest_;
};

template <class Number>
std::optional<Number> toNumber(std::string_view word) {
    Number value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
    return value;
}

// A comment begins at a word's beginning, outside quotes: names may hold a '#'.
std::string_view withoutComment(std::string_view text) {
    bool quoted = false, between_words = true;
    for (size_t i = 0; i < text.size(); ++i) {
        if (text[i] == '"' && (quoted || between_words)) quoted = !quoted;
        if (text[i] == '#' && between_words && !quoted) return text.substr(0, i);
        between_words = text[i] == ' ' || text[i] == '\t';
    }
    return text;
}

class Parser {
   public:
    Parser(const Pack& pack, std::string_view file) : pack_(pack), file_(file), rehearsal_(pack) {
        script_.camera = defaultCamera(pack);
    }

    Expected<void> line(std::string_view text) {
        ++line_;
        Words words(withoutComment(text));
        if (words.empty()) return {};
        const std::string_view command = words.next();
        if (auto done = this->command(command, words); !done) return done;
        if (!words.empty())
            return fail(ErrorCode::BadInput, fmt::format("\"{}\" is left over after {}", words.rest(), command));
        return {};
    }

    std::string where(uint32_t line) const { return fmt::format("{}:{}: ", file_, line); }
    std::string where() const { return where(line_); }

    Script finish() {
        std::stable_sort(script_.steps.begin(), script_.steps.end(),
                         [](const Step& a, const Step& b) { return a.frame < b.frame; });
        if (!frames_given_)
            script_.frames = std::min(frame_count_max, last_frame_ + static_cast<uint32_t>(std::ceil(script_.fps)));
        for (const Step& step : script_.steps)
            if (step.frame >= script_.frames)
                script_.warnings.push_back(where(step.line) +
                                           fmt::format("\"{}\" is not played: frame {} is past the last of {} frames.",
                                                       step.text, step.frame, script_.frames));
        return std::move(script_);
    }

   private:
    Expected<void> command(std::string_view name, Words& words) {
        if (name == "at") return step(words);
        if (name == "size") {
            if (auto done = count(words, 1, image_side_max, script_.width); !done) return done;
            return count(words, 1, image_side_max, script_.height);
        }
        if (name == "frames") {
            frames_given_ = true;
            return count(words, 1, frame_count_max, script_.frames);
        }
        if (name == "fps") return number(words, 1, 1000, script_.fps);
        if (name == "adapt") return number(words, 0, 1000, script_.adaptation_s);
        if (name == "camera") return view(words, script_.camera);
        if (name == "sky") {
            for (int channel = 0; channel < 3; ++channel)
                if (auto done = number(words, 0, 1e6f, script_.sky_cd_m2[channel]); !done) return done;
            return {};
        }
        if (name == "ball") return ball(words);
        if (name == "probes") {
            DIMMER_TRY(needGrid("probes"));
            return number(words, 0.001f, 100, script_.probe_radius_m);
        }
        return fail(
            ErrorCode::BadInput,
            fmt::format("unknown command \"{}\"; there are size, frames, fps, adapt, sky, camera, ball, probes and at",
                        name));
    }

    Expected<void> needGrid(std::string_view what) const {
        if (GridSampler(pack_, {}).empty())
            return fail(
                ErrorCode::BadInput,
                fmt::format("{} need a global light grid, and the pack has none: cook it with --set grids.global=on",
                            what));
        return {};
    }

    Expected<void> ball(Words& words) {
        DIMMER_TRY(needGrid("balls"));
        Ball ball;
        DIMMER_TRY(number(words, 0.001f, 100, ball.radius_m));
        DIMMER_TRY(place(words, ball.from_m));
        if (!words.accept("to")) return fail(ErrorCode::BadInput, "a ball is RADIUS X Y Z to X Y Z over FRAMES");
        DIMMER_TRY(place(words, ball.to_m));
        DIMMER_TRY(frameCount(words, "over", ball.frames));
        script_.balls.push_back(ball);
        return {};
    }

    Expected<void> step(Words& words) {
        Step step;
        step.line = line_;
        if (auto done = count(words, 0, frame_count_max, step.frame); !done) return done;
        step.text = words.rest();
        last_frame_ = std::max(last_frame_, step.frame);
        const std::string_view action = words.next();
        Expected<void> done;
        if (action == "set")
            done = set(words, step.action);
        else if (action == "fade")
            done = fade(words, step.action);
        else if (action == "flicker")
            done = flicker(words, step.action);
        else if (action == "camera")
            done = view(words, step.action.emplace<CameraCut>().view);
        else if (action == "move")
            done = move(words, step.action);
        else
            done = fail(ErrorCode::BadInput,
                        fmt::format("unknown action \"{}\"; there are set, fade, flicker, camera and move", action));
        if (!done) return done;
        last_frame_ = std::max(last_frame_, step.frame + duration(step));
        script_.steps.push_back(std::move(step));
        return {};
    }

    static uint32_t duration(const Step& step) {
        if (const auto* fade = std::get_if<Fade>(&step.action)) return fade->frames;
        if (const auto* flicker = std::get_if<Flicker>(&step.action)) return flicker->frames;
        if (const auto* move = std::get_if<CameraMove>(&step.action)) return move->frames;
        return 0;
    }

    using Action = decltype(Step::action);

    Expected<void> set(Words& words, Action& action) {
        auto& set = action.emplace<SetState>();
        std::string_view state = words.rest();  // the whole rest: names in a state may hold spaces
        words = Words({});
        if (state.size() > 1 && state.find('"', 1) == state.size() - 1 && state.front() == '"')
            state = trim(state.substr(1, state.size() - 2));
        if (state.empty())
            return fail(ErrorCode::BadInput,
                        "set says no state; an example: set hall=0.5,door:front=1 (in quotes where a name begins with "
                        "#)");
        set.state = state;
        return rehearsal_.apply(set.state);
    }

    Expected<void> fade(Words& words, Action& action) {
        auto& fade = action.emplace<Fade>();
        fade.element = words.next();
        for (Weight* end : {&fade.from, &fade.to}) {
            const std::string assignment = fmt::format("{}={}", fade.element, words.next());
            const auto parsed = parseState(assignment);
            if (!parsed) return std::unexpected(parsed.error());
            if (parsed->size() != 1 || parsed->front().target == StateAssignment::Target::AllSets)
                return fail(ErrorCode::BadInput, "a fade takes one light set or one door");
            if (auto done = rehearsal_.apply(assignment); !done) return done;
            *end = parsed->front().value;
        }
        return frameCount(words, "over", fade.frames);
    }

    Expected<void> flicker(Words& words, Action& action) {
        auto& flicker = action.emplace<Flicker>();
        flicker.set = words.next();
        if (const auto set = rehearsal_.lightSet(flicker.set); !set) return std::unexpected(set.error());
        if (auto done = number(words, 0, 1, flicker.low); !done) return done;
        if (auto done = number(words, flicker.low, 1, flicker.high); !done) return done;
        if (auto done = frameCount(words, "for", flicker.frames); !done) return done;
        if (!words.accept("seed")) return {};
        return count(words, 0, UINT32_MAX, flicker.seed);
    }

    Expected<void> move(Words& words, Action& action) {
        auto& move = action.emplace<CameraMove>();
        if (auto done = view(words, move.view); !done) return done;
        return frameCount(words, "over", move.frames);
    }

    Expected<void> view(Words& words, CameraPose& view) {
        Words ahead = words;
        if (!toNumber<float>(ahead.next())) {
            const auto camera = findCamera(pack_, words.next());
            if (!camera) return std::unexpected(camera.error());
            view = *camera;
            return {};
        }
        glm::vec3 target{};
        if (auto done = place(words, view.position_m); !done) return done;
        if (!words.accept("look")) return fail(ErrorCode::BadInput, "a view is X Y Z look X Y Z: \"look\" is missing");
        if (auto done = place(words, target); !done) return done;
        const glm::vec3 towards = target - view.position_m;
        if (!(glm::length(towards) > 1e-3f))
            return fail(ErrorCode::BadInput, "the view looks at the place where it stands");
        view.forward = glm::normalize(towards);
        float fov_degrees = 60;
        if (words.accept("fov"))
            if (auto done = number(words, 5, 170, fov_degrees); !done) return done;
        view.vertical_fov_rad = glm::radians(fov_degrees);
        return {};
    }

    Expected<void> place(Words& words, glm::vec3& place_m) {
        for (int axis = 0; axis < 3; ++axis)
            if (auto done = number(words, -1e6f, 1e6f, place_m[axis]); !done) return done;
        return {};
    }

    Expected<void> frameCount(Words& words, std::string_view keyword, uint32_t& frames) {
        if (!words.accept(keyword)) return fail(ErrorCode::BadInput, fmt::format("\"{} FRAMES\" is missing", keyword));
        return count(words, 1, frame_count_max, frames);
    }

    Expected<void> count(Words& words, uint32_t low, uint32_t high, uint32_t& value) {
        const std::string_view word = words.next();
        const auto parsed = toNumber<uint32_t>(word);
        if (!parsed || *parsed < low || *parsed > high)
            return fail(ErrorCode::BadInput,
                        fmt::format("\"{}\" is not a whole number within {}..{}", word, low, high));
        value = *parsed;
        return {};
    }

    Expected<void> number(Words& words, float low, float high, float& value) {
        const std::string_view word = words.next();
        const auto parsed = toNumber<float>(word);
        if (!parsed || !(*parsed >= low && *parsed <= high))
            return fail(ErrorCode::BadInput, fmt::format("\"{}\" is not a number within {}..{}", word, low, high));
        value = *parsed;
        return {};
    }

    const Pack& pack_;
    std::string_view file_;
    uint32_t line_ = 0;
    CpuRuntime rehearsal_;  // takes every state once, so that what the runtime would refuse is refused now
    Script script_;
    bool frames_given_ = false;
    uint32_t last_frame_ = 0;
};

}  // namespace

Expected<Script> parseScript(std::string_view text, std::string_view file, const Pack& pack) {
    Parser parser(pack, file);
    if (constexpr std::string_view byte_order_mark = "\xef\xbb\xbf"; text.starts_with(byte_order_mark))
        text.remove_prefix(byte_order_mark.size());
    while (!text.empty()) {
        const size_t end = std::min(text.find('\n'), text.size());
        if (auto done = parser.line(text.substr(0, end)); !done)
            return fail(ErrorCode::BadInput, parser.where() + done.error().message);
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return parser.finish();
}

}  // namespace dimmer::sample
