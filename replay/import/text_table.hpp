// A delimited text file with a header line, read cell by cell with errors that name line and column.
//
// Errors are sticky: the first one is kept, later calls return harmless values, and the importer asks once per row.
// Threads: one at a time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"

namespace fovea::replay {

class TextTable {
public:
    // `content` must outlive the table. `line` is the number of the first line in it (for messages).
    TextTable(std::filesystem::path path, std::string_view content, char delimiter, std::size_t line = 1);

    // Reads the header line. Column names lose surrounding blanks, quotes and a byte order mark.
    bool read_header();
    // The index of a column, or nothing.
    [[nodiscard]] std::optional<std::size_t> find(std::string_view name) const;
    // The same; a missing column is an error.
    std::size_t need(std::string_view name);
    [[nodiscard]] const std::vector<std::string>& names() const noexcept { return names_; }

    // Goes to the next line that is not blank; false at the end or after an error. A line with fewer cells than the
    // header is an error (torn line); so is one with more, a delimiter at the very end aside.
    bool next_row();
    [[nodiscard]] std::size_t line() const noexcept { return line_; }
    // The last line read did not end in a newline.
    [[nodiscard]] bool unterminated() const noexcept { return unterminated_; }

    [[nodiscard]] std::string_view cell(std::size_t column) const;  // trimmed, without quotes
    [[nodiscard]] std::string_view cell(std::optional<std::size_t> column) const;
    // A real number; empty, "nan", "NA" and "." are NaN. Anything else that is not a number is an error. A decimal
    // comma is understood where the delimiter is another character.
    double number(std::size_t column);
    double number(std::optional<std::size_t> column);  // no column: NaN
    // Like number(), but empty or not finite is an error.
    double need_number(std::size_t column);
    std::int64_t need_integer(std::size_t column);
    // "1", "0", "true", "false", "True", "False".
    bool need_flag(std::size_t column);
    // A decimal time in units of 10^exponent seconds, to the nearest nanosecond, exact (no detour over double).
    std::int64_t need_time_ns(std::size_t column, int exponent);

    void fail_at(std::size_t column, std::string what, std::string way_out);
    void fail_line(std::string what, std::string way_out);
    [[nodiscard]] bool failed() const noexcept { return error_.has_value(); }
    [[nodiscard]] std::unexpected<Error> error() const { return std::unexpected(*error_); }

private:
    bool take_line();
    void split();
    [[nodiscard]] std::string describe(std::size_t column) const;

    std::filesystem::path path_;
    std::string_view content_;
    char delimiter_;
    std::size_t offset_ = 0, line_, next_line_;
    bool unterminated_ = false;
    std::string_view text_;
    std::vector<std::string_view> cells_;
    std::vector<std::string> names_;
    std::optional<Error> error_;
};

// A decimal number as an integer multiple of 10^-9 seconds, when its unit is 10^exponent seconds; exact, rounded to
// the nearest. Nothing when it is not a number or lies outside +-2^62 ns (146 years).
[[nodiscard]] std::optional<std::int64_t> decimal_to_ns(std::string_view text, int exponent);

// No time of a recording may reach +-2^62 ns, so that differences never overflow.
inline constexpr std::int64_t kMaxTime_ns = (std::int64_t{1} << 62) - 1;

[[nodiscard]] std::string_view trimmed(std::string_view text) noexcept;
// The first line, without its line end.
[[nodiscard]] std::string_view first_line(std::string_view text) noexcept;
// Is `name` one of the delimited cells of `line` (quotes and blanks around it aside)?
[[nodiscard]] bool has_cell(std::string_view line, char delimiter, std::string_view name) noexcept;

}  // namespace fovea::replay
