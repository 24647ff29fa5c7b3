#include "tools/tradeoff_report.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace fovea::tools {
namespace {

std::string number(double v) {
    if (!std::isfinite(v)) return "-";
    return fmt::format("{:.{}f}", v, std::fabs(v) >= 100 ? 0 : std::fabs(v) >= 10 ? 1 : std::fabs(v) >= 1 ? 2 : 3);
}

std::string escaped(const std::string& s) {
    std::string out;
    for (const char c : s) {
        if (c == '<') out += "&lt;";
        else if (c == '&') out += "&amp;";
        else if (c == '"') out += "&quot;";
        else out += c;
    }
    return out;
}

constexpr const char* kColours[] = {"#1b6ca8", "#c2410c", "#2f855a", "#7c3aed", "#b7791f", "#be185d", "#0f766e", "#4b5563", "#9a3412", "#1e3a8a"};

struct Axis {
    bool log;
    double low, high;  // in log10 when log
    double from, to;   // pixels
    double operator()(double v) const {
        const double x = log ? std::log10(std::max(v, 1e-12)) : v;
        return from + (x - low) / (high - low) * (to - from);
    }
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

std::string svg(const TradeoffPlot& plot) {
    constexpr double kWidth = 760, kHeight = 420, kLeft = 70, kRight = 190, kTop = 34, kBottom = 50;
    const Axis x = axis_for(plot, true, kLeft, kWidth - kRight), y = axis_for(plot, false, kHeight - kBottom, kTop);
    std::string s;
    auto to = std::back_inserter(s);
    fmt::format_to(to, "<svg viewBox='0 0 {} {}' width='{}' font-family='sans-serif' font-size='12'>", kWidth, kHeight, kWidth);
    fmt::format_to(to, "<text x='{}' y='18' font-weight='bold'>{}</text>", kLeft, escaped(plot.title));
    fmt::format_to(to, "<rect x='{}' y='{}' width='{}' height='{}' fill='none' stroke='#999'/>", kLeft, kTop, kWidth - kLeft - kRight, kHeight - kTop - kBottom);
    for (int i = 0; i <= 5; ++i) {
        const double share = i / 5.0;
        const auto value = [&](const Axis& a) { const double v = a.low + share * (a.high - a.low); return a.log ? std::pow(10, v) : v; };
        const double px = x(value(x)), py = y(value(y));
        fmt::format_to(to, "<line x1='{0:.1f}' x2='{0:.1f}' y1='{1}' y2='{2}' stroke='#eee'/><text x='{0:.1f}' y='{3}' text-anchor='middle' fill='#555'>{4}</text>", px, kTop, kHeight - kBottom, kHeight - kBottom + 16, number(value(x)));
        fmt::format_to(to, "<line y1='{0:.1f}' y2='{0:.1f}' x1='{1}' x2='{2}' stroke='#eee'/><text x='{3}' y='{4:.1f}' text-anchor='end' fill='#555'>{5}</text>", py, kLeft, kWidth - kRight, kLeft - 6, py + 4, number(value(y)));
    }
    fmt::format_to(to, "<text x='{}' y='{}' text-anchor='middle'>{}</text>", (kLeft + kWidth - kRight) / 2, kHeight - 12, escaped(plot.x_name));
    fmt::format_to(to, "<text transform='translate(16 {}) rotate(-90)' text-anchor='middle'>{}</text>", (kTop + kHeight - kBottom) / 2, escaped(plot.y_name));
    std::size_t i = 0;
    for (const auto& c : plot.curves) {
        const char* colour = kColours[i % std::size(kColours)];
        if (c.points.size() == 1) {
            const double px = x(c.points[0].first), py = y(c.points[0].second);
            if (std::isfinite(px) && std::isfinite(py))
                fmt::format_to(to, "<circle cx='{:.1f}' cy='{:.1f}' r='4' fill='{}'/>", px, py, colour);
        } else {
            fmt::format_to(to, "<polyline fill='none' stroke='{}' stroke-width='1.6' points='", colour);
            for (const auto& p : c.points) {
                const double px = x(p.first), py = y(p.second);
                if (std::isfinite(px) && std::isfinite(py)) fmt::format_to(to, "{:.1f},{:.1f} ", px, py);
            }
            s += "'/>";
        }
        fmt::format_to(to, "<rect x='{}' y='{}' width='10' height='10' fill='{}'/><text x='{}' y='{}'>{}</text>", kWidth - kRight + 12, kTop + 4 + 17 * static_cast<double>(i), colour, kWidth - kRight + 28, kTop + 13 + 17 * static_cast<double>(i), escaped(c.name));
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
    for (const auto& c : table.columns) fmt::format_to(to, " {:>{}}", c, std::max<std::size_t>(8, c.size()));
    s += '\n';
    for (const auto& r : table.rows) {
        fmt::format_to(to, "{} {:<{}} {:>10}", r.frontier ? '*' : ' ', r.method, width, number(r.cost_ns));
        for (std::size_t i = 0; i < table.columns.size(); ++i)
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
            rows.push_back(std::move(row));
        }
        all.push_back({{"title", t.title}, {"note", t.note}, {"rows", std::move(rows)}});
    }
    return all.dump(2) + "\n";
}

TradeoffPlot plot_of(const TradeoffTable& table) {
    TradeoffPlot plot{table.title, table.cost_name, table.error_name, true, false, {}};
    TradeoffCurve frontier{"Pareto frontier", {}};
    for (const auto& r : table.rows) {
        plot.curves.push_back({r.method, {{r.cost_ns, r.error}}});
        if (r.frontier) frontier.points.push_back({r.cost_ns, r.error});
    }
    std::sort(frontier.points.begin(), frontier.points.end());
    if (frontier.points.size() > 1) plot.curves.push_back(std::move(frontier));
    return plot;
}

std::string to_html(const std::string& title, const std::vector<TradeoffTable>& tables, const std::vector<TradeoffPlot>& plots) {
    std::string s = "<!doctype html><meta charset='utf-8'><title>" + escaped(title) +
                    "</title><style>body{font-family:sans-serif;margin:2em;max-width:70em}table{border-collapse:collapse;"
                    "margin:1em 0}td,th{padding:2px 9px;text-align:right;border-bottom:1px solid #ddd}td:first-child{"
                    "text-align:left}tr.frontier{background:#eef7ee}</style><h1>" + escaped(title) + "</h1>\n";
    for (const auto& p : plots) s += svg(p);
    for (const auto& t : tables) {
        s += "<h2>" + escaped(t.title) + "</h2><p>" + escaped(t.note) + " Green: on the Pareto frontier.</p><table><tr><th>method<th>" + escaped(t.cost_name);
        for (const auto& c : t.columns) s += "<th>" + escaped(c);
        for (const auto& r : t.rows) {
            s += fmt::format("<tr{}><td>{}<td>{}", r.frontier ? " class='frontier'" : "", escaped(r.method), number(r.cost_ns));
            for (const double v : r.values) s += "<td>" + number(v);
        }
        s += "</table>\n";
    }
    return s;
}

}  // namespace fovea::tools
