// SR Research EyeLink ASC (edf2asc), gaze or href coordinates, one or both eyes, with the parser's events as labels.
//
// Source: EyeLink user manual, "ASC file format"; checked on FDBeye's 250 Hz binocular recordings.
// Time: milliseconds of the tracker's clock; at 2000 Hz each stamp comes twice and the second means half a ms later.
// Gaze: pixels, x right, y DOWN, of a screen given by GAZE_COORDS; RES of the END line is the block's mean resolution
// in pixels per degree, so the eye is RES * 180 / pi pixels before the screen's centre. Href: 15000 units before it.
// Missing is ".". The pupil has no unit that could be turned into millimetres and is left out.
// Labels: EFIX, ESACC and EBLINK of either eye, blink before saccade before fixation. The tracker wraps each blink into
// a saccade that is none (manual, "Blinks"): it counts as blink.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

#include "replay/import/conventions.hpp"
#include "replay/import/importer.hpp"
#include "replay/import/text_table.hpp"

namespace fovea::replay {
namespace {

constexpr double kHrefDistance = 15000;

struct RawSample {
    std::int64_t t_ns = 0;
    double xy[2][2] = {{kUnknown, kUnknown}, {kUnknown, kUnknown}};  // left, right
    Label label = Label::none;
};

struct Event {
    std::int64_t from_ns, to_ns;
    Label label;
};

class AscReader {
public:
    explicit AscReader(const ImportInput& input) : input_(input) {}

    Result<Recording> read() {
        std::string_view rest = input_.content;
        while (!rest.empty() && !error_) {
            const auto end = rest.find('\n');
            unterminated_ = end == std::string_view::npos;
            text_ = rest.substr(0, end);
            rest = unterminated_ ? std::string_view{} : rest.substr(end + 1);
            ++line_;
            split();
            if (!tokens_.empty()) read_line();
        }
        if (!error_ && in_block_)
            set_error(0, "the recording block has no END line", "the file is torn: copy it again from its origin");
        if (error_) return std::unexpected(*error_);
        recording_.info.nominal_rate_hz = rate_hz_ > 0 ? rate_hz_ : measured_rate_hz(recording_);
        return std::move(recording_);
    }

private:
    void split() {
        tokens_.clear();
        for (std::size_t i = 0; i < text_.size();) {
            const auto first = text_.find_first_not_of(" \t\r", i);
            if (first == std::string_view::npos) return;
            const auto last = std::min(text_.find_first_of(" \t\r", first), text_.size());
            tokens_.push_back(text_.substr(first, last - first));
            i = last;
        }
    }

    void set_error(std::size_t token, std::string what, std::string way_out) {
        if (error_) return;
        const auto column = token < tokens_.size() ? tokens_[token].data() - text_.data() + 1 : 1;
        error_ = Error{std::move(what), input_.path.string() + ":" + std::to_string(line_) + ":" + std::to_string(column),
                       std::move(way_out)};
    }

    double number(std::size_t token) {
        if (token >= tokens_.size()) {
            set_error(token, unterminated_ ? "the file ends in the middle of a line" : "the line is too short",
                      "the file is torn or damaged: copy it again");
            return kUnknown;
        }
        if (tokens_[token] == ".") return kUnknown;
        double value = 0;
        const auto [end, ec] = std::from_chars(tokens_[token].data(), tokens_[token].data() + tokens_[token].size(), value);
        if (ec == std::errc{} && end == tokens_[token].data() + tokens_[token].size()) return value;
        set_error(token, "'" + std::string(tokens_[token].substr(0, 30)) + "' is not a number", "mend or delete the line");
        return kUnknown;
    }

    std::int64_t time(std::size_t token) {
        const auto ns = token < tokens_.size() ? decimal_to_ns(tokens_[token], -3) : std::nullopt;
        if (!ns) set_error(token, "a time is missing", "mend or delete the line");
        return ns.value_or(0);
    }

    [[nodiscard]] bool has(std::string_view token) const {
        return std::find(tokens_.begin(), tokens_.end(), token) != tokens_.end();
    }

    void read_line() {
        const std::string_view kind = tokens_[0];
        if (kind == "MSG") {
            read_message();
        } else if (kind == "START") {
            if (in_block_) return set_error(0, "a block starts within a block", "the file is damaged: copy it again");
            in_block_ = true;
            left_ = has("LEFT");
            right_ = has("RIGHT");
        } else if (kind == "SAMPLES") {
            left_ = has("LEFT");
            right_ = has("RIGHT");
            href_ = has("HREF");
            if (!href_ && !has("GAZE"))
                return set_error(1, "the samples are raw pupil positions, not gaze",
                                 "convert the EDF again with gaze or href samples");
            for (std::size_t i = 0; i + 1 < tokens_.size(); ++i)
                if (tokens_[i] == "RATE") rate_hz_ = number(i + 1);
        } else if (kind == "EFIX" || kind == "ESACC" || kind == "EBLINK") {
            const Label label = kind == "EFIX" ? Label::fixation : kind == "ESACC" ? Label::saccade : Label::blink;
            const std::int64_t from = time(2), to = time(3);
            events_.push_back({from, to, label});
        } else if (in_block_ && kind == "END") {
            end_block();
        } else if (in_block_ && kind[0] >= '0' && kind[0] <= '9') {
            read_sample();
        }
    }

    void read_message() {
        for (std::size_t i = 2; i + 4 < tokens_.size(); ++i)
            if (tokens_[i] == "GAZE_COORDS" || (tokens_[i] == "DISPLAY_COORDS" && !gaze_coords_)) {
                const double left = number(i + 1), top = number(i + 2), right = number(i + 3), bottom = number(i + 4);
                gaze_coords_ = tokens_[i] == "GAZE_COORDS";
                centre_x_ = (left + right + 1) / 2;  // inclusive pixel indices
                centre_y_ = (top + bottom + 1) / 2;
                return;
            }
    }

    void read_sample() {
        RawSample s;
        s.t_ns = time(0);
        if (!block_.empty() && rate_hz_ == 2000 && s.t_ns == block_.back().t_ns) s.t_ns += 500'000;
        std::size_t token = 1;
        for (const auto& [present, eye] : {std::pair{left_, 0}, {right_, 1}}) {
            if (!present) continue;
            const double x = number(token), y = number(token + 1), pupil = number(token + 2);
            token += 3;
            if (pupil > 0) s.xy[eye][0] = x, s.xy[eye][1] = y;
        }
        if (unterminated_) set_error(0, "the file ends in the middle of a line", "copy the file again");
        if (!left_ && !right_) set_error(0, "samples before a START or SAMPLES line", "the file is damaged: copy it again");
        block_.push_back(s);
    }

    void apply_labels() {
        // A saccade that holds a blink is part of the blink.
        for (const Event& blink : events_)
            if (blink.label == Label::blink)
                for (Event& e : events_)
                    if (e.label == Label::saccade && e.from_ns <= blink.from_ns && e.to_ns >= blink.to_ns)
                        e.label = Label::blink;
        std::stable_sort(events_.begin(), events_.end(),
                         [](const Event& a, const Event& b) { return rank(a.label) < rank(b.label); });
        for (const Event& e : events_) {
            auto i = std::lower_bound(block_.begin(), block_.end(), e.from_ns,
                                      [](const RawSample& s, std::int64_t t) { return s.t_ns < t; });
            for (; i != block_.end() && i->t_ns <= e.to_ns; ++i) i->label = e.label;
        }
        recording_.info.has_labels |= !events_.empty();
    }
    static int rank(Label label) { return label == Label::blink ? 2 : label == Label::saccade ? 1 : 0; }

    void end_block() {
        double distance_x = kHrefDistance, distance_y = kHrefDistance;
        if (!href_) {
            for (std::size_t i = 0; i + 2 < tokens_.size(); ++i)
                if (tokens_[i] == "RES") distance_x = number(i + 1) / kRadPerDeg, distance_y = number(i + 2) / kRadPerDeg;
            if (!has("RES") || !(distance_x > 0) || !(distance_y > 0))
                return set_error(0, "the END line gives no RES (pixels per degree)", "convert the EDF again with resolution data");
            if (!(distance_x < 1e6 && distance_y < 1e6 && distance_x > 57 && distance_y > 57))
                return set_error(0, "a resolution of 1 to 10000 pixels per degree is expected", "convert the EDF again");
            if (std::isnan(centre_x_) || std::isnan(centre_y_))
                return set_error(0, "no GAZE_COORDS or DISPLAY_COORDS message came before the samples",
                                 "the screen's centre must be known: add the line 'MSG 0 DISPLAY_COORDS 0 0 W-1 H-1'");
        }
        apply_labels();
        for (const RawSample& raw : block_) {
            RecordedSample r;
            GazeSample& s = r.sample;
            s.id = recording_.samples.size() + 1;
            s.device_time.ns = raw.t_ns;
            s.exposed = s.received = instant_from_ns(raw.t_ns);
            for (const Eye eye : {Eye::left, Eye::right}) {
                const auto& [x, y] = raw.xy[eye == Eye::left ? 0 : 1];
                if (std::isnan(x) || std::isnan(y)) continue;
                set_gaze(s.eye(eye), href_ ? from_screen(x / distance_x, y / distance_y, 1)
                                           : from_screen((x - centre_x_) / distance_x, (y - centre_y_) / distance_y, 1));
            }
            combine_eyes(s);
            r.label = raw.label;
            recording_.samples.push_back(r);
        }
        block_.clear();
        events_.clear();
        in_block_ = false;
    }

    const ImportInput& input_;
    Recording recording_{{"eyelink_asc", "SR Research EyeLink", "", "", 0, false, false}, {}};
    std::optional<Error> error_;
    std::string_view text_;
    std::vector<std::string_view> tokens_;
    std::size_t line_ = 0;
    bool unterminated_ = false, in_block_ = false, left_ = false, right_ = false, href_ = false, gaze_coords_ = false;
    double rate_hz_ = 0, centre_x_ = kUnknown, centre_y_ = kUnknown;
    std::vector<RawSample> block_;
    std::vector<Event> events_;
};

}  // namespace

bool recognise_eyelink_asc(std::string_view prefix) {
    if (prefix.starts_with("** ") && (prefix.find("EDF_FILE") != prefix.npos || prefix.find("EYELINK") != prefix.npos))
        return true;
    return prefix.find("\nSTART\t") != prefix.npos && prefix.find("\nSAMPLES\t") != prefix.npos;
}

Result<Recording> read_eyelink_asc(const ImportInput& input) { return AscReader(input).read(); }

}  // namespace fovea::replay
