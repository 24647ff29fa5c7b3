// GLSL ES source text cut into tokens, with the place of each, so that a rewrite can splice and leave the rest as it was.
//
// Source: The OpenGL ES Shading Language 3.20, chapter 3 (characters, line continuation, preprocessor, comments,
// tokens); line continuation exists from #version 300 es on.
// Input: the program's text as the driver gets it (the strings of glShaderSource joined). Output: words (identifiers and
// keywords), numbers, symbols (one character each: `>>=` is three, which is enough to find and replace), and preprocessor lines as one
// token each, whose own tokens are in `parts`. Comments and white space are no tokens.
// Threads: pure. Errors: none; text that is no GLSL gives tokens that mean nothing.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace fovea::layer {

struct Token {
    enum class Kind { word, number, symbol, directive };
    Kind kind = Kind::symbol;
    std::size_t begin = 0, end = 0;  // in the source, half-open
    std::string text;                // without line continuations and comments; of a directive: its name ("version")
    std::vector<Token> parts;        // of a directive: the tokens after its name
    [[nodiscard]] bool is(std::string_view t) const noexcept { return kind != Kind::directive && text == t; }
    [[nodiscard]] bool is_directive(std::string_view name) const noexcept { return kind == Kind::directive && text == name; }
};

[[nodiscard]] std::vector<Token> tokenize(std::string_view source);

// Whether the word occurs, in code or in a preprocessor line (a macro may bring it into the code).
[[nodiscard]] bool mentions(const std::vector<Token>& tokens, std::string_view word) noexcept;

// Whether the source reads the pixel's place in the window: gl_FragCoord, but not its depth (.z and .w) alone.
[[nodiscard]] bool reads_window_position(const std::vector<Token>& tokens) noexcept;

// What #version says: 100 where there is none.
[[nodiscard]] int glsl_version(const std::vector<Token>& tokens) noexcept;

}  // namespace fovea::layer
