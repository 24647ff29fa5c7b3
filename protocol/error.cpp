#include "protocol/error.hpp"

#include <cstdio>
#include <cstdlib>
#include <system_error>

namespace fovea {

std::string Error::message() const {
    std::string text;
    if (!where.empty()) text += where + ": ";
    text += what;
    if (!way_out.empty()) text += " (" + way_out + ")";
    return text;
}

std::unexpected<Error> fail(std::string what, std::string where, std::string way_out) {
    return std::unexpected(Error{std::move(what), std::move(where), std::move(way_out)});
}

std::unexpected<Error> fail_errno(std::string what, int code, std::string where, std::string way_out) {
    return fail(what + ": " + std::generic_category().message(code), std::move(where), std::move(way_out));
}

void contract_violation(const char* condition, const char* file, int line) noexcept {
    std::fprintf(stderr, "%s:%d: contract violated: %s\n", file, line, condition);
    std::abort();
}

}  // namespace fovea
