#include "drivers/hid/quirks.hpp"

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <limits>
#include <map>

#include <toml++/toml.h>

namespace fovea::drivers::hid {

namespace {

std::string position(const std::string& file, const toml::node& node) {
    return file + ":" + std::to_string(node.source().begin.line) + ":" + std::to_string(node.source().begin.column);
}

struct Reader {
    const std::string& file;

    Result<double> number(const toml::node& node, const char* key, double above, double most) const {
        const auto v = node.value<double>();
        if (!v || !(*v > above) || !(*v <= most))
            return fail(std::string(key) + " must be a number in (" + std::to_string(above) + ", " +
                            std::to_string(most) + "]", position(file, node));
        return *v;
    }
    Result<bool> flag(const toml::node& node, const char* key) const {
        if (const auto* b = node.as_boolean()) return b->get();
        return fail(std::string(key) + " must be true or false", position(file, node));
    }
    Result<std::uint16_t> id(const toml::node& node, const char* key) const {
        const auto* i = node.as_integer();
        if (i == nullptr || i->get() < 0 || i->get() > 0xFFFF)
            return fail(std::string(key) + " must be an integer from 0 to 0xFFFF", position(file, node));
        return static_cast<std::uint16_t>(i->get());
    }
};

Result<DeviceMatch> read_match(const toml::table& table, const Reader& r) {
    DeviceMatch m;
    for (const auto& [key, node] : table) {
        if (key == "vendor" || key == "product") {
            const auto id = r.id(node, key == "vendor" ? "vendor" : "product");
            if (!id) return std::unexpected(id.error());
            (key == "vendor" ? m.vendor : m.product) = *id;
        } else if (key == "name_contains" && node.is_string()) {
            m.name_contains = node.as_string()->get();
        } else {
            return fail("unknown or ill-typed key 'match." + std::string(key.str()) + "'", position(r.file, node),
                        "legal keys: vendor, product, name_contains");
        }
    }
    if (m.vendor == 0 && m.name_contains.empty())
        return fail("[match] needs vendor or name_contains", position(r.file, table));
    return m;
}

Result<Quirks> read_quirks(const toml::table& table, const Reader& r) {
    Quirks q;
    for (const auto& [name, node] : table) {
        const std::string key(name.str());
        Result<void> done;
        const auto number = [&](std::optional<double>& slot, double above, double most) {
            auto v = r.number(node, key.c_str(), above, most);
            if (v) slot = *v;
            else done = std::unexpected(v.error());
        };
        const auto flag = [&](bool& slot) {
            auto v = r.flag(node, key.c_str());
            if (v) slot = *v;
            else done = std::unexpected(v.error());
        };
        if (key == "length_unit_m") number(q.length_unit_m, 0, 1);
        else if (key == "timestamp_unit_s") number(q.timestamp_unit_s, 0.9e-9, 1);
        else if (key == "screen_width_m") number(q.screen_width_m, 0, 20);
        else if (key == "screen_height_m") number(q.screen_height_m, 0, 20);
        else if (key == "sampling_hz") number(q.sampling_hz, 0, 100000);
        else if (key == "flip_x") flag(q.flip_x);
        else if (key == "flip_y") flag(q.flip_y);
        else if (key == "flip_z") flag(q.flip_z);
        else if (key == "ignore_logical_range") flag(q.ignore_logical_range);
        else if (key == "no_features") flag(q.no_features);
        else if (key == "start_report") {
            const auto* list = node.as_array();
            if (list == nullptr || list->empty() || list->size() > 256)
                return fail("start_report must be a list of 1 to 256 bytes", position(r.file, node));
            for (const auto& element : *list) {
                const auto* byte = element.as_integer();
                if (byte == nullptr || byte->get() < 0 || byte->get() > 255)
                    return fail("start_report must hold integers from 0 to 255", position(r.file, element));
                q.start_report.push_back(static_cast<std::uint8_t>(byte->get()));
            }
        } else {
            return fail("unknown key 'quirks." + key + "'", position(r.file, node),
                        "configs/devices/README.md lists the legal keys");
        }
        if (!done) return std::unexpected(done.error());
    }
    return q;
}

Result<DeviceQuirks> read_file(const std::filesystem::path& path) {
    const std::string file = path.string();
    toml::table root;
    try {
        root = toml::parse_file(file);
    } catch (const toml::parse_error& e) {
        return fail(std::string(e.description()), file + ":" + std::to_string(e.source().begin.line) + ":" +
                                                      std::to_string(e.source().begin.column));
    }
    const Reader reader{file};
    DeviceQuirks entry;
    for (const auto& [key, node] : root) {
        const toml::table* table = node.as_table();
        if (table != nullptr && key == "match") {
            auto match = read_match(*table, reader);
            if (!match) return std::unexpected(match.error());
            entry.match = std::move(*match);
        } else if (table != nullptr && key == "quirks") {
            auto quirks = read_quirks(*table, reader);
            if (!quirks) return std::unexpected(quirks.error());
            entry.quirks = std::move(*quirks);
        } else {
            return fail("unknown key '" + std::string(key.str()) + "'", position(file, node),
                        "legal tables: [match], [quirks]");
        }
    }
    if (!root.contains("match")) return fail("the table [match] is missing", file);
    entry.quirks.source = file;
    return entry;
}

}  // namespace

std::vector<std::filesystem::path> quirk_folders() {
    if (const char* folder = std::getenv("FOVEA_DEVICES_DIR"); folder != nullptr && *folder != '\0') return {folder};
    return {"/etc/fovea/devices", "/usr/share/fovea/devices"};
}

Result<std::vector<DeviceQuirks>> load_quirks(const std::vector<std::filesystem::path>& folders) {
    std::vector<DeviceQuirks> all;
    for (const auto& folder : folders) {
        std::error_code error;
        std::vector<std::filesystem::path> files;
        for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
            if (it->path().extension() == ".toml") files.push_back(it->path());
        std::ranges::sort(files);
        for (const auto& file : files) {
            auto entry = read_file(file);
            if (!entry) return std::unexpected(entry.error());
            all.push_back(std::move(*entry));
        }
    }
    return all;
}

Quirks quirks_for(const std::vector<DeviceQuirks>& all, std::uint16_t vendor, std::uint16_t product,
                  const std::string& name) {
    for (const DeviceQuirks& d : all) {
        if (d.match.vendor != 0 && d.match.vendor != vendor) continue;
        if (d.match.product != 0 && d.match.product != product) continue;
        if (!d.match.name_contains.empty() && name.find(d.match.name_contains) == std::string::npos) continue;
        return d.quirks;
    }
    return {};
}

}  // namespace fovea::drivers::hid
