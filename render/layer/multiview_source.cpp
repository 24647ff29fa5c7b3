#include "render/layer/multiview_source.hpp"

#include <algorithm>
#include <charconv>
#include <vector>

#include "render/layer/glsl_tokens.hpp"

namespace fovea::layer {
namespace {

struct Edit {
    std::size_t begin, end;
    std::string text;
};

bool is_extension_name(const Token& t) { return t.is("GL_OVR_multiview") || t.is("GL_OVR_multiview2"); }

std::string own_macro(const Token& t) { return "fovea" + t.text.substr(2); }  // GL_ names are reserved

// A number, or an object-like macro that stands for one.
std::optional<int> integer(const std::vector<Token>& tokens, const Token& value, int depth = 0) {
    if (value.kind == Token::Kind::number) {
        const bool hex = value.text.size() > 2 && (value.text[1] == 'x' || value.text[1] == 'X');
        const bool octal = !hex && value.text.size() > 1 && value.text[0] == '0';
        const char* from = value.text.data() + (hex ? 2 : 0);
        const char* to = value.text.data() + value.text.size();
        int n = 0;
        const auto [end, error] = std::from_chars(from, to, n, hex ? 16 : octal ? 8 : 10);
        const bool whole = end == to || (end + 1 == to && (*end == 'u' || *end == 'U'));
        return error == std::errc{} && whole ? std::optional(n) : std::nullopt;
    }
    constexpr int kDeepest = 8;  // macros of macros; more is a circle
    if (value.kind != Token::Kind::word || depth == kDeepest) return std::nullopt;
    std::optional<int> found;
    for (const Token& t : tokens)
        if (t.end <= value.begin || depth > 0)
            if (t.is_directive("define") && t.parts.size() == 2 && t.parts[0].text == value.text)
                found = integer(tokens, t.parts[1], depth + 1);
    return found;
}

class Rewrite {
public:
    Rewrite(std::string_view source, std::vector<Token> tokens) : source_(source), tokens_(std::move(tokens)) {}

    MultiviewSource run() {
        for (std::size_t i = 0; i < tokens_.size(); ++i) {
            const Token& t = tokens_[i];
            if (t.kind == Token::Kind::directive)
                directive(t);
            else if (t.is("gl_ViewID_OVR"))
                edits_.push_back({t.begin, t.end, kViewUniform}), uses_view_ = true;
            else if (is_extension_name(t))
                edits_.push_back({t.begin, t.end, own_macro(t)});
            else if (t.is("layout") && enabled_)
                i = layout(i);
        }
        insert_head();
        std::stable_sort(edits_.begin(), edits_.end(), [](const Edit& a, const Edit& b) {
            return a.begin != b.begin ? a.begin < b.begin : a.end < b.end;  // insertions before replacements
        });
        MultiviewSource result;
        result.num_views = views_;
        std::size_t at = 0;
        for (const Edit& e : edits_) {
            result.text.append(source_.substr(at, e.begin - at)).append(e.text);
            at = e.end;
        }
        result.text.append(source_.substr(at));
        return result;
    }

private:
    void directive(const Token& t) {
        const bool opens = t.text == "if" || t.text == "ifdef" || t.text == "ifndef";
        if (opens) ++depth_;
        if (t.is_directive("endif")) --depth_;
        if (t.is_directive("version")) head_ = t.end;
        if (t.is_directive("extension")) {
            head_ = std::string_view::npos;  // after the block that this stands in
            if (!t.parts.empty() && is_extension_name(t.parts[0])) {
                const bool off = std::any_of(t.parts.begin(), t.parts.end(), [](const Token& p) { return p.is("disable"); });
                enabled_ = !off;
                edits_.push_back({t.begin, t.end, ""});
            }
        } else {
            for (const Token& p : t.parts) {
                if (is_extension_name(p)) edits_.push_back({p.begin, p.end, own_macro(p)});
                if (p.is("gl_ViewID_OVR")) edits_.push_back({p.begin, p.end, kViewUniform}), uses_view_ = true;
            }
        }
        if (head_ == std::string_view::npos && depth_ == 0) head_ = t.end;
    }

    // tokens_[i] is `layout`. Returns the last token that was dealt with.
    std::size_t layout(std::size_t i) {
        if (i + 1 >= tokens_.size() || !tokens_[i + 1].is("(")) return i;
        std::size_t close = i + 2, views = 0, qualifiers = 1;
        while (close < tokens_.size() && !tokens_[close].is(")")) {
            if (tokens_[close].is("num_views")) views = close;
            if (tokens_[close].is(",")) ++qualifiers;
            ++close;
        }
        if (views == 0 || close + 2 >= tokens_.size() || views + 2 >= close || !tokens_[views + 1].is("=")) return i;
        if (!tokens_[close + 1].is("in") || !tokens_[close + 2].is(";")) return i;
        const auto n = integer(tokens_, tokens_[views + 2]);
        if (!n || *n < 1 || *n > kMaxViews)
            error_ = "num_views is no number from 1 to GL_MAX_VIEWS_OVR";
        else if (views_ != 0 && views_ != *n)
            error_ = "num_views is declared with different values";
        else
            views_ = *n;
        if (qualifiers == 1)
            remove(tokens_[i].begin, tokens_[close + 2].end);
        else if (tokens_[views + 3].is(","))
            remove(tokens_[views].begin, tokens_[views + 3].end);
        else
            remove(tokens_[views - 1].begin, tokens_[views + 2].end);
        return close;
    }

    // Line breaks stay.
    void remove(std::size_t begin, std::size_t end) {
        std::string lines;
        for (const char c : source_.substr(begin, end - begin))
            if (c == '\n') lines += c;
        edits_.push_back({begin, end, lines.empty() ? " " : lines});
    }

    void insert_head() {
        if (head_ == std::string_view::npos) head_ = source_.size();
        std::size_t line_end = source_.find('\n', head_);  // a comment may follow the directive
        const bool last = line_end == std::string_view::npos;
        if (last) line_end = source_.size();
        // The macros come before any line that may ask for them, and so before the extensions.
        const auto version = std::find_if(tokens_.begin(), tokens_.end(), [](const Token& t) { return t.is_directive("version"); });
        const std::size_t first = source_.find('\n', version->end);
        if (first != std::string_view::npos)
            add_lines(first + 1, "#define fovea_OVR_multiview 1\n#define fovea_OVR_multiview2 1\n");
        std::string text;
        if (!error_.empty()) text += "#error " + error_ + "\n";
        if (uses_view_) text += std::string("uniform mediump uint ") + kViewUniform + ";\n";
        if (!text.empty()) add_lines(last ? line_end : line_end + 1, (last ? "\n" : "") + text);
    }
    void add_lines(std::size_t at, const std::string& text) {
        const auto line = 1 + std::count(source_.begin(), source_.begin() + static_cast<std::ptrdiff_t>(at), '\n');
        edits_.push_back({at, at, text + "#line " + std::to_string(line) + "\n"});
    }

    std::string_view source_;
    std::vector<Token> tokens_;
    std::vector<Edit> edits_;
    std::size_t head_ = 0;  // behind the last block with an #extension; npos: inside it
    int depth_ = 0, views_ = 0;
    bool enabled_ = false, uses_view_ = false;
    std::string error_;
};

}  // namespace

std::optional<MultiviewSource> rewrite_multiview(std::string_view source) {
    if (source.find("OVR") == std::string_view::npos) return std::nullopt;  // with a continuation inside the word: no program does
    std::vector<Token> tokens = tokenize(source);
    if (glsl_version(tokens) < 300) return std::nullopt;
    const bool concerned = mentions(tokens, "GL_OVR_multiview") || mentions(tokens, "GL_OVR_multiview2");
    if (!concerned) return std::nullopt;
    return Rewrite(source, std::move(tokens)).run();
}

}  // namespace fovea::layer
