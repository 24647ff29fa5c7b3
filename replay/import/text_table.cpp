#include "replay/import/text_table.hpp"

#include <charconv>
#include <cmath>
#include <limits>

namespace fovea::replay {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::string_view unquoted(std::string_view text) noexcept {
    text = trimmed(text);
    if (text.size() >= 2 && text.front() == '"' && text.back() == '"') text = text.substr(1, text.size() - 2);
    return text;
}

bool is_missing(std::string_view text) noexcept {
    return text.empty() || text == "." || text == "NA" || text == "NaN" || text == "nan" || text == "-nan";
}

// Text for a message: printable, short.
std::string shown(std::string_view text) {
    std::string out = "'";
    for (const char c : text.substr(0, 40)) out += (c >= 0x20 && c < 0x7f) ? c : '?';
    return out + (text.size() > 40 ? "...'" : "'");
}

}  // namespace

std::string_view trimmed(std::string_view text) noexcept {
    constexpr std::string_view blanks = " \t\r\n";
    const auto first = text.find_first_not_of(blanks);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::string_view first_line(std::string_view text) noexcept {
    text = text.substr(0, text.find('\n'));
    if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
    return text;
}

bool has_cell(std::string_view line, char delimiter, std::string_view name) noexcept {
    while (true) {
        const auto end = line.find(delimiter);
        if (unquoted(line.substr(0, end)) == name) return true;
        if (end == std::string_view::npos) return false;
        line.remove_prefix(end + 1);
    }
}

std::optional<std::int64_t> decimal_to_ns(std::string_view text, int exponent) {
    const std::string_view whole_text = text;
    bool negative = false;
    if (!text.empty() && (text.front() == '-' || text.front() == '+')) {
        negative = text.front() == '-';
        text.remove_prefix(1);
    }
    // Digits d with the decimal point p places from the right stand for d * 10^(exponent - p + 9) nanoseconds.
    unsigned __int128 digits = 0;
    int scale = exponent + 9;
    bool any = false, point = false, rounded_up = false, dropping = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '.' && !point) {
            point = true;
        } else if (c >= '0' && c <= '9') {
            any = true;
            if (point && scale == 0) {
                if (!dropping) rounded_up = c >= '5';
                dropping = true;
                continue;
            }
            if (digits > (unsigned __int128){1} << 100) return std::nullopt;
            digits = digits * 10 + static_cast<unsigned>(c - '0');
            if (point) --scale;
        } else if (any && (c == 'e' || c == 'E')) {
            double value = 0;  // no tracker prints its times this way; a spreadsheet does
            const auto [end, ec] = std::from_chars(whole_text.data(), whole_text.data() + whole_text.size(), value);
            if (ec != std::errc{} || end != whole_text.data() + whole_text.size()) return std::nullopt;
            value *= std::pow(10.0, exponent + 9);
            if (!(std::abs(value) < static_cast<double>(kMaxTime_ns))) return std::nullopt;
            return static_cast<std::int64_t>(std::llround(value));
        } else {
            return std::nullopt;
        }
    }
    if (!any) return std::nullopt;
    for (; scale > 0; --scale) {
        digits *= 10;
        if (digits > (unsigned __int128){1} << 100) return std::nullopt;
    }
    if (rounded_up) ++digits;
    if (digits > static_cast<unsigned __int128>(kMaxTime_ns)) return std::nullopt;
    const auto value = static_cast<std::int64_t>(digits);
    return negative ? -value : value;
}

TextTable::TextTable(std::filesystem::path path, std::string_view content, char delimiter, std::size_t line)
    : path_(std::move(path)), content_(content), delimiter_(delimiter), line_(line), next_line_(line) {}

bool TextTable::take_line() {
    if (offset_ >= content_.size()) return false;
    const auto end = content_.find('\n', offset_);
    unterminated_ = end == std::string_view::npos;
    text_ = content_.substr(offset_, unterminated_ ? std::string_view::npos : end - offset_);
    offset_ = unterminated_ ? content_.size() : end + 1;
    line_ = next_line_++;
    if (!text_.empty() && text_.back() == '\r') text_.remove_suffix(1);
    return true;
}

void TextTable::split() {
    cells_.clear();
    std::size_t begin = 0;
    while (true) {
        std::size_t end = begin;
        if (begin < text_.size() && text_[begin] == '"') {  // a quoted cell may hold the delimiter
            end = text_.find('"', begin + 1);
            if (end == std::string_view::npos) end = begin;
        }
        end = text_.find(delimiter_, end);
        cells_.push_back(text_.substr(begin, end == std::string_view::npos ? end : end - begin));
        if (end == std::string_view::npos) return;
        begin = end + 1;
    }
}

bool TextTable::read_header() {
    if (failed() || !take_line()) {
        fail_line("there is no header line", "the file is empty or torn: copy it again from its origin");
        return false;
    }
    if (text_.starts_with("\xef\xbb\xbf")) text_.remove_prefix(3);
    split();
    names_.clear();
    for (const auto cell : cells_) names_.emplace_back(unquoted(cell));
    return true;
}

std::optional<std::size_t> TextTable::find(std::string_view name) const {
    for (std::size_t i = 0; i < names_.size(); ++i)
        if (names_[i] == name) return i;
    return std::nullopt;
}

std::size_t TextTable::need(std::string_view name) {
    if (const auto i = find(name)) return *i;
    std::string list;
    for (const auto& n : names_) {
        if (list.size() > 200) {
            list += " ...";
            break;
        }
        list += (list.empty() ? "" : ", ") + shown(n);
    }
    fail_line("column '" + std::string(name) + "' is missing", "the header has " + list);
    return 0;
}

bool TextTable::next_row() {
    while (!failed() && take_line()) {
        if (trimmed(text_).empty()) continue;
        split();
        if (cells_.size() == names_.size() + 1 && trimmed(cells_.back()).empty()) cells_.pop_back();
        if (cells_.size() == names_.size()) return true;
        const std::string counts =
            std::to_string(cells_.size()) + " cells where the header has " + std::to_string(names_.size());
        if (unterminated_)
            fail_line("the file ends in the middle of a line (" + counts + ")",
                      "copy the file again, or delete its last line");
        else
            fail_line(counts, "mend the line or delete it");
        return false;
    }
    return false;
}

std::string_view TextTable::cell(std::size_t column) const {
    return column < cells_.size() ? unquoted(cells_[column]) : std::string_view{};
}
std::string_view TextTable::cell(std::optional<std::size_t> column) const {
    return column ? cell(*column) : std::string_view{};
}

double TextTable::number(std::size_t column) {
    const std::string_view text = cell(column);
    if (is_missing(text)) return kNaN;
    double value = 0;
    const auto [end, ec] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (ec == std::errc{} && end == text.data() + text.size()) return value;
    if (const auto comma = text.find(','); comma != std::string_view::npos && delimiter_ != ',') {
        std::string with_point(text);  // an export made where people write 0,5
        with_point[comma] = '.';
        const char* const last = with_point.data() + with_point.size();
        if (const auto r = std::from_chars(with_point.data(), last, value); r.ec == std::errc{} && r.ptr == last)
            return value;
    }
    fail_at(column,
            shown(text) + (ec == std::errc::result_out_of_range ? " is beyond the range of a double"
                                                                : " is not a number"),
            "mend the cell, or leave it empty if the value is unknown");
    return kNaN;
}

double TextTable::number(std::optional<std::size_t> column) { return column ? number(*column) : kNaN; }

double TextTable::need_number(std::size_t column) {
    const double value = number(column);
    if (!failed() && !std::isfinite(value))
        fail_at(column, shown(cell(column)) + " is not a finite number", "every line needs a value here");
    return value;
}

std::int64_t TextTable::need_integer(std::size_t column) {
    const std::string_view text = cell(column);
    std::int64_t value = 0;
    const auto [end, ec] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (ec == std::errc{} && end == text.data() + text.size()) return value;
    fail_at(column,
            shown(text) + (ec == std::errc::result_out_of_range ? " does not fit into 64 bits" : " is not an integer"),
            "every line needs an integer here");
    return 0;
}

bool TextTable::need_flag(std::size_t column) {
    const std::string_view text = cell(column);
    if (text == "1" || text == "true" || text == "True") return true;
    if (text == "0" || text == "false" || text == "False") return false;
    fail_at(column, shown(text) + " is neither 0 nor 1", "write 1 for yes, 0 for no");
    return false;
}

std::int64_t TextTable::need_time_ns(std::size_t column, int exponent) {
    if (const auto ns = decimal_to_ns(cell(column), exponent)) return *ns;
    fail_at(column, shown(cell(column)) + " is not a time (or lies outside +-146 years)", "mend or delete the line");
    return 0;
}

std::string TextTable::describe(std::size_t column) const {
    const char* begin = column < cells_.size() ? cells_[column].data() : text_.data();
    const auto character = static_cast<std::size_t>(begin - text_.data()) + 1;
    return path_.string() + ":" + std::to_string(line_) + ":" + std::to_string(character);
}

void TextTable::fail_at(std::size_t column, std::string what, std::string way_out) {
    if (failed()) return;
    if (column < names_.size()) what = "column '" + names_[column] + "': " + what;
    error_ = Error{std::move(what), describe(column), std::move(way_out)};
}

void TextTable::fail_line(std::string what, std::string way_out) {
    if (failed()) return;
    error_ = Error{std::move(what), path_.string() + ":" + std::to_string(line_) + ":1", std::move(way_out)};
}

}  // namespace fovea::replay
