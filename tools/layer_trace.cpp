#include "tools/layer_trace.hpp"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "render/gl/png.hpp"
#include "tools/html_text.hpp"

namespace fovea::tools {
namespace {

using nlohmann::json;

// Levels from full density to a quarter and below; Okabe and Ito's palette.
constexpr const char* kLevelColor[] = {"#0072B2", "#56B4E9", "#F0E442", "#E69F00"};

std::string file_bytes(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

// A picture of the layer as <img>; empty when it cannot be read.
std::string image(const std::filesystem::path& folder, const json& p) {
    const int width = p.value("width", 0), height = p.value("height", 0);
    const std::string rgba = file_bytes(folder / p.value("picture", ""));
    if (width < 1 || height < 1 || rgba.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4) return {};
    std::vector<std::uint8_t> rgb;
    rgb.reserve(rgba.size() / 4 * 3);
    for (int y = height - 1; y >= 0; --y)
        for (int x = 0; x < width; ++x)
            for (std::size_t c = 0; c < 3; ++c)
                rgb.push_back(static_cast<std::uint8_t>(rgba[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) * 4 + c]));
    const std::filesystem::path png = folder / "picture.png";
    if (!gl::write_png(png, {width, height, rgb})) return {};
    return fmt::format("<figure><img src='data:image/png;base64,{}' alt='{}'><figcaption>{}</figcaption></figure>", base64(file_bytes(png)),
                       p.value("which", ""), p.value("which", "") == "before" ? "before: full density" : "after: as it was drawn");
}

// The plan: bins by level, focal points as crosses.
std::string plan_svg(const json& s) {
    const double width = s.value("width", 1), height = s.value("height", 1), bin = s.value("bin_px", 1);
    std::string svg = fmt::format("<figure><svg viewBox='0 0 {0} {1}' role='img' shape-rendering='crispEdges'>", width, height);
    double row = 0;
    for (const json& text : s["levels"]) {
        const auto levels = text.get<std::string>();
        for (std::size_t i = 0; i < levels.size();) {
            std::size_t j = i;
            while (j < levels.size() && levels[j] == levels[i]) ++j;
            const auto color = kLevelColor[std::min<std::size_t>(static_cast<std::size_t>(levels[i] - '0'), 3)];
            svg += fmt::format("<rect x='{}' y='{}' width='{}' height='{}' fill='{}'/>", static_cast<double>(i) * bin,
                               height - (row + 1) * bin, static_cast<double>(j - i) * bin, bin, color);
            i = j;
        }
        ++row;
    }
    for (const json& p : s["points"]) {
        if (!p[0].is_number() || !p[1].is_number()) continue;
        const double x = (p[0].get<double>() + 1) / 2 * width, y = (1 - p[1].get<double>()) / 2 * height, r = width / 40;
        svg += fmt::format("<path d='M{} {}h{}M{} {}v{}' stroke='#fff' stroke-width='{}'/>", x - r, y, 2 * r, x, y - r, 2 * r, width / 200);
    }
    return svg + "</svg><figcaption>the plan: dark blue full density, light blue half, yellow a quarter along each axis; cross: focal point</figcaption></figure>";
}

// The names are those of the counters and of the rules; the words say what they mean.
std::string why_full(const std::string& name) {
    static const std::map<std::string, const char*> kWords = {
        {"gl_frag_coord", "a fragment shader reads the place of its pixel in the window"},
        {"texel_fetch", "a fragment shader addresses texels by number"},
        {"no_source", "a program came as a binary, and nobody knows what it does"},
        {"points", "points have a size in pixels"},
        {"lines", "lines have a width in pixels"},
        {"blended_2d", "blended without depth test, as text is"},
        {"textured_2d", "a picture, not a scene"},
        {"full_screen_pass", "post-processing of a picture that was drawn before"},
        {"no_clear", "the frame did not begin with a clear"},
        {"keeps_depth", "it needs depth or stencil of before"},
        {"side_effects", "shaders that write memory, an occlusion query, or a geometry shader"},
        {"clears_only", "nothing was drawn yet"},
        {"does_not_pay", "a trial found that levels take longer"},
        {"full_density", "its focal points ask for it everywhere"},
        {"cannot_match", "a format, a size or the memory that levels cannot have"}};
    const auto found = kWords.find(name);
    return (found == kWords.end() ? "" : std::string(found->second) + " ") + "(<code>" + escaped(name) + "</code>)";
}

std::string submission_html(const std::filesystem::path& folder, const json& s, const std::vector<json>& pictures) {
    const int number = s.value("submission", 0);
    std::string target = s.value("framebuffer", 0) == 0 ? "the window" : fmt::format("framebuffer {}", s.value("framebuffer", 0));
    if (s.value("view", 0) > 0) target += fmt::format(", view {}", s.value("view", 0));
    const std::string title = fmt::format("Submission {}: {}, {} × {}, by {}", number, target, s.value("width", 0), s.value("height", 0), escaped(s.value("cause", "")));
    if (!s.contains("levels")) return fmt::format("<p><b>{}</b>. At full density: {}.</p>", title, why_full(s.value("full_density", "")));
    std::string html = "<h3>" + title + "</h3>";
    std::uint64_t drawn = 0;
    for (const json& t : s["texels"]) drawn += t.get<std::uint64_t>();
    const double full = s.value("width", 1) * 1.0 * s.value("height", 1);
    std::string texels;
    for (const json& t : s["texels"]) texels += fmt::format("{}{}", texels.empty() ? "" : " + ", t.get<std::uint64_t>());
    html += fmt::format("<p>{:.1f} % of the pixels ({} of {:.0f}: full, half, a quarter, with their guard rings). Minimum density {}. Points (x, y, gain x, gain y, area): <code>{}</code>{}</p><div class='row'>",
                        100 * static_cast<double>(drawn) / full, texels, full, s["min_density"].dump(), escaped(s["points"].dump()),
                        s.value("live", false) ? ", from a live fovead" : "");
    html += plan_svg(s);
    for (const char* which : {"before", "after"})
        for (const json& p : pictures)
            if (p.value("of", 0) == number && p.value("which", "") == which) html += image(folder, p);
    return html + "</div>";
}

constexpr const char* kHead = R"(<!doctype html><html lang='en'><meta charset='utf-8'><title>Fovea: layer trace</title><style>
body{font:15px/1.45 system-ui,sans-serif;max-width:1400px;margin:2em auto;padding:0 1em;color:#111;background:#fff}
h1{font-size:1.5em}h2{margin-top:2em;border-bottom:1px solid #ccc}h3{font-size:1.05em}code{background:#f2f2f2;padding:0 .2em}
.row{display:grid;grid-template-columns:repeat(3,minmax(0,1fr));gap:12px}figure{margin:0}figure img,figure svg{width:100%;height:auto;display:block}figure img{background:#000}
figcaption{color:#444;font-size:.9em}table{border-collapse:collapse}td,th{padding:.15em .7em;text-align:left;border-bottom:1px solid #ddd;vertical-align:top}
</style>)";

}  // namespace

Result<std::string> layer_trace_page(const std::string& folder, const std::string& command) {
    const std::filesystem::path where = folder;
    std::ifstream in(where / "trace.jsonl");
    std::map<int, std::vector<json>> calls, submissions;  // by frame
    std::vector<json> pictures;
    std::string text;
    while (std::getline(in, text)) {
        json line = json::parse(text, nullptr, false);
        if (line.is_discarded()) continue;  // cut off by a signal
        const int frame = line.value("frame", 0);
        if (line.contains("call")) calls[frame].push_back(std::move(line));
        else if (line.contains("submission")) submissions[frame].push_back(std::move(line));
        else if (line.contains("picture")) pictures.push_back(std::move(line));
    }
    if (calls.empty() && submissions.empty())
        return fail("nothing was traced", command, "the program made no OpenGL ES 3.1 context, or never foveates: --auto does it for the program");
    std::string html = std::string(kHead) + "<h1>What the layer did: <code>" + escaped(command) + "</code></h1>";
    const auto table = [&html](const std::vector<json>& list) {
        constexpr std::size_t kMost = 40;
        html += "<table><tr><th>call<th>arguments</tr>";
        for (std::size_t i = 0; i < std::min(list.size(), kMost); ++i)
            html += "<tr><td><code>" + escaped(list[i].value("call", "")) + "</code><td>" + escaped(list[i]["arguments"].dump()) + "</tr>";
        html += "</table>";
        if (list.size() > kMost) html += fmt::format("<p>… and {} more.</p>", list.size() - kMost);
    };
    const int last = submissions.empty() ? 0 : submissions.rbegin()->first;
    for (int frame = 1; frame <= std::max(last, calls.empty() ? 0 : calls.begin()->first); ++frame) {
        if (!calls.contains(frame) && !submissions.contains(frame)) continue;
        html += fmt::format("<h2>Frame {}</h2>", frame);
        if (calls.contains(frame)) table(calls[frame]);
        for (const json& s : submissions[frame]) html += submission_html(where, s, pictures);
    }
    return html + "</html>\n";
}

}  // namespace fovea::tools
