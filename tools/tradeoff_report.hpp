// What a tradeoff found, as a table, CSV, JSON and a self-contained HTML page with plots.
//
// Threads: plain data and pure functions.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace fovea::tools {

struct TradeoffPicture {
    std::string caption, data_uri;
};
struct TradeoffRow {
    std::string method;
    double cost_ns = 0;            // per sample, measured in this run; NaN: not a matter of cost
    double error = 0;              // what the frontier is about; NaN: nothing was judged
    std::vector<double> values;    // one per TradeoffTable::columns; NaN prints as "-"
    bool frontier = false;         // no other row is both cheaper and better
    std::string toml;              // the setting as the daemon's config says it
    std::vector<TradeoffPicture> pictures{};   // what it looks like; only the page shows them, of the frontier's rows
};

struct TradeoffTable {
    std::string title, note;       // one line each
    std::string cost_name = "ns/sample", error_name;  // the axes
    double cost_unit_ns = 1;                          // of cost_name; CSV and JSON say nanoseconds
    std::vector<std::string> columns;
    std::vector<TradeoffRow> rows;
    std::size_t text_columns = SIZE_MAX;              // so many from the left are printed as text; CSV, JSON and page have all
};

struct TradeoffCurve {
    std::string name;
    std::vector<std::pair<double, double>> points;
};
struct TradeoffPlot {
    std::string title, x_name, y_name;
    bool log_x = false, log_y = false;
    std::vector<TradeoffCurve> curves;  // of one point: a labelled mark
};

void mark_frontier(TradeoffTable& table);
// The row with the least error among those whose cost is at most `budget_ns`; null if there is none.
[[nodiscard]] const TradeoffRow* best_within(const TradeoffTable& table, double budget_ns);

[[nodiscard]] std::string to_text(const TradeoffTable& table);
[[nodiscard]] std::string to_csv(const TradeoffTable& table);
[[nodiscard]] std::string to_json(const std::vector<TradeoffTable>& tables);
// How each tradeoff's page begins: to the end of its heading. Readable on a dark and on a light screen; a table goes into a
// <div class='wide'>, a row of the frontier is of the class "frontier".
[[nodiscard]] std::string page_head(const std::string& title);
// A whole page; it needs nothing from elsewhere.
[[nodiscard]] std::string to_html(const std::string& title, const std::vector<TradeoffTable>& tables,
                                  const std::vector<TradeoffPlot>& plots);
// Cost against error, the frontier joined.
[[nodiscard]] TradeoffPlot plot_of(const TradeoffTable& table);

}  // namespace fovea::tools
