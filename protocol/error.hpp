// Errors that a user can act on: what failed, where, and the way out.
//
// Ordinary absence is std::optional; a run-time failure is Result<T>; a bug is FOVEA_REQUIRE.
#pragma once

#include <expected>
#include <string>

namespace fovea {

struct Error {
    std::string what;     // what is wrong, e.g. "unknown key 'filter.min_cutof'"
    std::string where;    // file:line:column, device node or socket path; may be empty
    std::string way_out;  // what the user can do, e.g. "legal keys: ..."; may be empty

    // One line: "where: what (way_out)".
    [[nodiscard]] std::string message() const;
};

template <class T>
using Result = std::expected<T, Error>;

[[nodiscard]] std::unexpected<Error> fail(std::string what, std::string where = {}, std::string way_out = {});
// The same with the text of errno `code` appended to `what`.
[[nodiscard]] std::unexpected<Error> fail_errno(std::string what, int code, std::string where = {},
                                                std::string way_out = {});

// Prints file, line and condition to stderr and aborts, in every build. For bugs, never for input.
[[noreturn]] void contract_violation(const char* condition, const char* file, int line) noexcept;

}  // namespace fovea

#define FOVEA_REQUIRE(condition) \
    ((condition) ? static_cast<void>(0) : ::fovea::contract_violation(#condition, __FILE__, __LINE__))
