#include "tools/tradeoff_report.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "tools/axis_ticks.hpp"
#include "tools/html_text.hpp"

namespace fovea::tools {
namespace {

std::string number(double v) {
    if (!std::isfinite(v)) return "-";
    return fmt::format("{:.{}f}", v, std::fabs(v) >= 100 ? 0 : std::fabs(v) >= 10 ? 1 : std::fabs(v) >= 1 ? 2 : 3);
}

// A column's name, which may be broken where its words end.
std::string breakable(const std::string& name) {
    std::string out;
    for (const char c : escaped(name)) out += c == '_' || c == '/' ? std::string{c} + "<wbr>" : std::string{c};
    return out;
}

// Readable on white and on near-black.
constexpr const char* kColours[] = {"#2b82c9", "#d9621e", "#3c9d6a", "#9061f2", "#c08a2b", "#d6457f", "#1f9e92", "#7b8794", "#b5533c", "#5b74d6"};
constexpr const char* kFrontier = "Pareto frontier";

struct Axis {
    bool log;
    double low, high;  // in log10 when log
    double from, to;   // pixels
    double operator()(double v) const {
        const double x = log ? std::log10(std::max(v, 1e-12)) : v;
        return from + (x - low) / (high - low) * (to - from);
    }
    [[nodiscard]] std::vector<double> ticks() const {
        return log ? axis_ticks(std::pow(10, low), std::pow(10, high), true) : axis_ticks(low, high, false);
    }
};

// The name of a mark, beside it; further down where another's stands already.
class MarkNames {
public:
    // x, y: the mark's centre, px.
    std::string place(double x, double y, const std::string& name) {
        constexpr double kAside = 6, kCharacter = 6.2, kLine = 9;
        const double left = x + kAside, right = left + kCharacter * static_cast<double>(name.size());
        double base = y - 3;
        const auto meets = [&](const Box& t) { return left < t.right && right > t.left && std::fabs(base - t.base) < kLine; };
        while (std::any_of(taken_.begin(), taken_.end(), meets)) ++base;
        taken_.push_back({left, right, base});
        return fmt::format("<text x='{:.1f}' y='{:.1f}' font-size='10'>{}</text>", left, base, name);
    }

private:
    struct Box {
        double left, right, base;
    };
    std::vector<Box> taken_;
};

Axis axis_for(const TradeoffPlot& plot, bool x, double from, double to) {
    const bool log = x ? plot.log_x : plot.log_y;
    double low = 1e300, high = -1e300;
    for (const auto& c : plot.curves)
        for (const auto& p : c.points) {
            double v = x ? p.first : p.second;
            if (!std::isfinite(v) || (log && !(v > 0))) continue;
            if (log) v = std::log10(v);
            low = std::min(low, v), high = std::max(high, v);
        }
    if (!(low <= high)) low = 0, high = 1;
    if (!log && low > 0 && low < 0.5 * high) low = 0;
    const double pad = high - low > 1e-9 ? 0.06 * (high - low) : 0.5;
    return {log, low == 0 && !log ? 0 : low - pad, high + pad, from, to};
}

// Marks (curves of one point) carry their number in the list beside the plot, so that colour alone tells nothing.
std::string svg(const TradeoffPlot& plot) {
    constexpr double kWidth = 860, kLeft = 70, kRight = 270, kTop = 34, kBottom = 50, kLine = 17;
    const double height = std::max(420.0, kTop + kLine * static_cast<double>(plot.curves.size()) + 16);
    const Axis x = axis_for(plot, true, kLeft, kWidth - kRight), y = axis_for(plot, false, height - kBottom, kTop);
    std::string s;
    auto to = std::back_inserter(s);
    fmt::format_to(to, "<svg viewBox='0 0 {} {}' width='{}' font-family='sans-serif' font-size='12' fill='currentColor'>", kWidth, height, kWidth);
    fmt::format_to(to, "<text x='{}' y='18' font-weight='bold'>{}</text>", kLeft, escaped(plot.title));
    fmt::format_to(to, "<rect x='{}' y='{}' width='{}' height='{}' fill='none' stroke='var(--faint)'/>", kLeft, kTop, kWidth - kLeft - kRight, height - kTop - kBottom);
    for (const double v : x.ticks())
        fmt::format_to(to, "<line x1='{0:.1f}' x2='{0:.1f}' y1='{1}' y2='{2}' stroke='var(--line)'/><text x='{0:.1f}' y='{3}' text-anchor='middle'>{4}</text>", x(v), kTop, height - kBottom, height - kBottom + 16, fmt::format("{:g}", v));
    for (const double v : y.ticks())
        fmt::format_to(to, "<line y1='{0:.1f}' y2='{0:.1f}' x1='{1}' x2='{2}' stroke='var(--line)'/><text x='{3}' y='{4:.1f}' text-anchor='end'>{5}</text>", y(v), kLeft, kWidth - kRight, kLeft - 6, y(v) + 4, fmt::format("{:g}", v));
    fmt::format_to(to, "<text x='{}' y='{}' text-anchor='middle'>{}</text>", (kLeft + kWidth - kRight) / 2, height - 12, escaped(plot.x_name));
    fmt::format_to(to, "<text transform='translate(16 {}) rotate(-90)' text-anchor='middle'>{}</text>", (kTop + height - kBottom) / 2, escaped(plot.y_name));
    MarkNames names;
    std::size_t i = 0;
    for (const auto& c : plot.curves) {
        const bool curve = c.points.size() != 1, frontier = curve && c.name == kFrontier;
        const std::string colour = frontier ? "currentColor" : kColours[i % std::size(kColours)];
        // A colour that comes round again is dotted.
        const char* dashes = frontier ? " stroke-dasharray='5 3'" : i / std::size(kColours) % 2 == 1 ? " stroke-dasharray='2 3'" : "";
        const double line = kTop + kLine * static_cast<double>(i), key = kWidth - kRight + 12;
        if (curve) {
            fmt::format_to(to, "<polyline fill='none' stroke='{}' stroke-width='1.6'{} points='", colour, dashes);
            for (const auto& p : c.points) {
                const double px = x(p.first), py = y(p.second);
                if (std::isfinite(px) && std::isfinite(py)) fmt::format_to(to, "{:.1f},{:.1f} ", px, py);
            }
            s += "'/>";
            if (frontier)   // a ring around each of its marks
                for (const auto& p : c.points) fmt::format_to(to, "<circle cx='{:.1f}' cy='{:.1f}' r='7' fill='none' stroke='currentColor'/>", x(p.first), y(p.second));
            fmt::format_to(to, "<line x1='{}' x2='{}' y1='{}' y2='{}' stroke='{}' stroke-width='2'{}/>", key, key + 22, line + 9, line + 9, colour, dashes);
        } else {
            const double px = x(c.points[0].first), py = y(c.points[0].second);
            if (std::isfinite(px) && std::isfinite(py))
                fmt::format_to(to, "<circle cx='{:.1f}' cy='{:.1f}' r='4' fill='{}'/>{}", px, py, colour, names.place(px, py, std::to_string(i + 1)));
            fmt::format_to(to, "<circle cx='{}' cy='{}' r='4' fill='{}'/>", key + 5, line + 9, colour);
        }
        fmt::format_to(to, "<text x='{}' y='{}'>{}{}</text>", key + (curve ? 28 : 16), line + 13, curve ? "" : fmt::format("{} ", i + 1), escaped(c.name));
        ++i;
    }
    return s + "</svg>\n";
}

}  // namespace

void mark_frontier(TradeoffTable& table) {
    for (TradeoffRow& a : table.rows) {
        a.frontier = std::isfinite(a.error) && std::isfinite(a.cost_ns);
        for (const TradeoffRow& b : table.rows)
            if (b.error <= a.error && b.cost_ns <= a.cost_ns && (b.error < a.error || b.cost_ns < a.cost_ns)) a.frontier = false;
    }
}

const TradeoffRow* best_within(const TradeoffTable& table, double budget_ns) {
    const TradeoffRow* best = nullptr;
    for (const TradeoffRow& r : table.rows)
        if (std::isfinite(r.error) && r.cost_ns <= budget_ns && (!best || r.error < best->error)) best = &r;
    return best;
}

std::string to_text(const TradeoffTable& table) {
    std::string s = table.title + "\n";
    auto to = std::back_inserter(s);
    std::size_t width = 8;
    for (const auto& r : table.rows) width = std::max(width, r.method.size());
    fmt::format_to(to, "  {:<{}} {:>10}", "method", width, table.cost_name);
    const std::size_t shown = std::min(table.columns.size(), table.text_columns);
    for (std::size_t i = 0; i < shown; ++i) fmt::format_to(to, " {:>{}}", table.columns[i], std::max<std::size_t>(8, table.columns[i].size()));
    s += '\n';
    for (const auto& r : table.rows) {
        fmt::format_to(to, "{} {:<{}} {:>10}", r.frontier ? '*' : ' ', r.method, width, number(r.cost_ns / table.cost_unit_ns));
        for (std::size_t i = 0; i < shown; ++i)
            fmt::format_to(to, " {:>{}}", number(r.values[i]), std::max<std::size_t>(8, table.columns[i].size()));
        s += '\n';
    }
    if (!table.note.empty()) s += "  " + table.note + "\n";
    return s;
}

std::string to_csv(const TradeoffTable& table) {
    std::string s = "table,method,cost_ns,frontier";
    for (const auto& c : table.columns) s += ',' + c;
    s += '\n';
    for (const auto& r : table.rows) {
        s += fmt::format("\"{}\",\"{}\",{:.1f},{:d}", table.title, r.method, r.cost_ns, r.frontier);
        for (const double v : r.values) s += std::isfinite(v) ? fmt::format(",{:.6g}", v) : ",";
        s += '\n';
    }
    return s;
}

std::string to_json(const std::vector<TradeoffTable>& tables) {
    auto all = nlohmann::json::array();
    const auto value = [](double v) { return std::isfinite(v) ? nlohmann::json(v) : nlohmann::json(nullptr); };
    for (const auto& t : tables) {
        auto rows = nlohmann::json::array();
        for (const auto& r : t.rows) {
            nlohmann::json row = {{"method", r.method}, {"cost_ns", value(r.cost_ns)}, {"error", value(r.error)}, {"frontier", r.frontier}};
            for (std::size_t i = 0; i < t.columns.size(); ++i) row[t.columns[i]] = value(r.values[i]);
            if (!r.toml.empty()) row["toml"] = r.toml;
            rows.push_back(std::move(row));
        }
        all.push_back({{"title", t.title}, {"note", t.note}, {"rows", std::move(rows)}});
    }
    return all.dump(2) + "\n";
}

TradeoffPlot plot_of(const TradeoffTable& table) {
    TradeoffPlot plot{table.title, table.cost_name, table.error_name, true, false, {}};
    TradeoffCurve frontier{kFrontier, {}};
    for (const auto& r : table.rows) {
        const double cost = r.cost_ns / table.cost_unit_ns;
        plot.curves.push_back({r.method, {{cost, r.error}}});
        if (r.frontier) frontier.points.push_back({cost, r.error});
    }
    std::sort(frontier.points.begin(), frontier.points.end());
    if (frontier.points.size() > 1) plot.curves.push_back(std::move(frontier));
    return plot;
}

std::string page_head(const std::string& title) {
    return "<!doctype html><html lang='en'><meta charset='utf-8'><title>" + escaped(title) +
                    "</title><style>:root{color-scheme:light dark;--ink:#1c1f23;--paper:#fff;--line:#e6e6e6;--faint:#999;--mark:#e6f3e6}"
                    "@media(prefers-color-scheme:dark){:root{--ink:#e3e6ea;--paper:#15181c;--line:#30353c;--faint:#777;--mark:#1e3527}}"
                    "body{font-family:sans-serif;margin:2em;max-width:78em;color:var(--ink);background:var(--paper)}h1{font-size:24px}svg{max-width:100%;height:auto;display:block;margin:1em 0}"
                    // A table wider than the window scrolls by itself, under the column of names.
                    ".wide{overflow-x:auto;margin:1em 0}table{border-collapse:collapse;font-size:14px;font-variant-numeric:tabular-nums}"
                    "td,th{padding:2px 8px;text-align:right;border-bottom:1px solid var(--line);vertical-align:bottom}"
                    "td:first-child,th:first-child{text-align:left;white-space:nowrap;position:sticky;left:0;background:var(--paper)}"
                    "tr.frontier,tr.frontier td:first-child{background:var(--mark)}"
                    "figure{display:inline-block;margin:6px 10px 6px 0}figcaption{font-size:12px}img{image-rendering:pixelated}</style><h1>" + escaped(title) + "</h1>\n";
}

std::string to_html(const std::string& title, const std::vector<TradeoffTable>& tables, const std::vector<TradeoffPlot>& plots) {
    std::string s = page_head(title);
    for (const auto& p : plots) s += svg(p);
    for (const auto& t : tables) {
        s += "<h2>" + escaped(t.title) + "</h2><p>" + escaped(t.note) + " Green: on the Pareto frontier.</p><div class='wide'><table><tr><th>method<th>" + escaped(t.cost_name);
        for (const auto& c : t.columns) s += "<th>" + breakable(c);
        for (const auto& r : t.rows) {
            s += fmt::format("<tr{}><td>{}<td>{}", r.frontier ? " class='frontier'" : "", escaped(r.method), number(r.cost_ns / t.cost_unit_ns));
            for (const double v : r.values) s += "<td>" + number(v);
        }
        s += "</table></div>\n";
        for (const auto& r : t.rows) {
            if (!r.frontier || r.pictures.empty()) continue;
            s += "<figure>";
            std::string captions;
            for (const auto& p : r.pictures) {
                s += fmt::format("<img width='192' alt='{}: {}' src='{}'> ", escaped(r.method), escaped(p.caption), p.data_uri);
                captions += (captions.empty() ? "" : ", ") + p.caption;
            }
            s += "<figcaption>" + escaped(r.method) + " (" + escaped(captions) + ")</figcaption></figure>\n";
        }
    }
    return s + "</html>\n";
}

}  // namespace fovea::tools
