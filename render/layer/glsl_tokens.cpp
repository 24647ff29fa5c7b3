#include "render/layer/glsl_tokens.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>

namespace fovea::layer {
namespace {

bool starts_word(char c) { return std::isalpha(static_cast<unsigned char>(c)) || c == '_'; }
bool in_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

// Reads characters with line continuations taken out, and knows where each one was.
class Reader {
public:
    Reader(std::string_view source, bool continuations) : source_(source), continuations_(continuations) { skip_continuations(); }
    [[nodiscard]] bool done() const { return at_ >= source_.size(); }
    [[nodiscard]] char now() const { return done() ? '\0' : source_[at_]; }
    [[nodiscard]] char next() const {
        Reader ahead = *this;
        ahead.step();
        return ahead.now();
    }
    void step() {
        if (done()) return;
        end_ = ++at_;
        skip_continuations();
    }
    [[nodiscard]] std::size_t at() const { return at_; }
    [[nodiscard]] std::size_t end() const { return end_; }  // behind the last character that was stepped over

private:
    void skip_continuations() {
        while (continuations_ && at_ + 1 < source_.size() && source_[at_] == '\\') {
            if (source_[at_ + 1] == '\n')
                at_ += 2;
            else if (source_[at_ + 1] == '\r')
                at_ += at_ + 2 < source_.size() && source_[at_ + 2] == '\n' ? 3 : 2;
            else
                return;
        }
    }
    std::string_view source_;
    bool continuations_;
    std::size_t at_ = 0, end_ = 0;
};

bool is_newline(char c) { return c == '\n' || c == '\r'; }

// Stands at a comment: steps over it. A line comment ends before its newline.
bool skip_comment(Reader& r) {
    if (r.now() != '/') return false;
    if (r.next() == '/') {
        while (!r.done() && !is_newline(r.now())) r.step();
        return true;
    }
    if (r.next() != '*') return false;
    r.step();
    r.step();
    while (!r.done() && !(r.now() == '*' && r.next() == '/')) r.step();
    r.step();
    r.step();
    return true;
}

Token take(Reader& r) {
    Token token;
    token.begin = r.at();
    const char first = r.now();
    const auto add = [&] {
        token.text += r.now();
        r.step();
    };
    if (starts_word(first)) {
        token.kind = Token::Kind::word;
        while (in_word(r.now())) add();
    } else if (std::isdigit(static_cast<unsigned char>(first)) || (first == '.' && std::isdigit(static_cast<unsigned char>(r.next())))) {
        token.kind = Token::Kind::number;
        char last = '\0';
        while (in_word(r.now()) || r.now() == '.' || ((r.now() == '+' || r.now() == '-') && (last == 'e' || last == 'E'))) {
            last = r.now();
            add();
            if (token.text.size() > 1 && (token.text[1] == 'x' || token.text[1] == 'X')) last = '\0';  // e is a digit there
        }
    } else {
        add();
    }
    token.end = r.end();
    return token;
}

Token take_directive(Reader& r) {
    Token line;
    line.kind = Token::Kind::directive;
    line.begin = r.at();
    r.step();
    line.end = r.end();
    bool named = false;
    while (!r.done() && !is_newline(r.now())) {
        if (skip_comment(r)) continue;
        if (std::isspace(static_cast<unsigned char>(r.now()))) {
            r.step();
            continue;
        }
        Token part = take(r);
        line.end = part.end;
        if (!named) {
            line.text = part.text;
            named = true;
        } else {
            line.parts.push_back(std::move(part));
        }
    }
    return line;
}

std::vector<Token> tokenize_as(std::string_view source, bool continuations) {
    std::vector<Token> tokens;
    Reader r(source, continuations);
    bool line_start = true;
    while (!r.done()) {
        const char c = r.now();
        if (is_newline(c)) line_start = true;
        if (std::isspace(static_cast<unsigned char>(c))) {
            r.step();
        } else if (skip_comment(r)) {
            continue;  // a comment before # leaves it first on its line
        } else if (c == '#' && line_start) {
            tokens.push_back(take_directive(r));
        } else {
            tokens.push_back(take(r));
            line_start = false;
        }
    }
    return tokens;
}

}  // namespace

bool reads_window_position(const std::vector<Token>& tokens) noexcept {
    for (std::size_t i = 0; i < tokens.size(); ++i) {
        if (tokens[i].kind == Token::Kind::directive && reads_window_position(tokens[i].parts)) return true;
        if (!tokens[i].is("gl_FragCoord")) continue;
        const bool selects = i + 2 < tokens.size() && tokens[i + 1].is(".") && tokens[i + 2].kind == Token::Kind::word;
        if (!selects || tokens[i + 2].text.find_first_not_of("zwpqba") != std::string::npos) return true;
    }
    return false;
}

int glsl_version(const std::vector<Token>& tokens) noexcept {
    for (const Token& t : tokens)
        if (t.is_directive("version") && !t.parts.empty()) {
            int version = 0;
            const std::string& text = t.parts[0].text;
            std::from_chars(text.data(), text.data() + text.size(), version);
            return version;
        }
    return 100;
}

std::vector<Token> tokenize(std::string_view source) {
    std::vector<Token> tokens = tokenize_as(source, true);
    // #version stands first, so that it reads the same both ways.
    if (glsl_version(tokens) < 300 && source.find('\\') != std::string_view::npos) tokens = tokenize_as(source, false);
    return tokens;
}

bool mentions(const std::vector<Token>& tokens, std::string_view word) noexcept {
    return std::any_of(tokens.begin(), tokens.end(), [word](const Token& t) {
        return t.is(word) || (t.kind == Token::Kind::directive && mentions(t.parts, word));
    });
}

}  // namespace fovea::layer
