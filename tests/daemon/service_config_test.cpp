// Every way in which a config can be wrong, and the exact words and places of the answer.
#include <gmock/gmock.h>

#include <fstream>

#include "daemon/service/config.hpp"
#include "daemon/service/config_keys.hpp"

namespace fovea::service {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

const std::vector<drivers::DeviceRow> kDevices = {
    {.driver = "replay", .one_line = "a recording", .create = {}, .keys = {{"path", "\"\"", "the recording"}, {"speed", "1.0", "(0, 1000]"}}},
    {.driver = "synthetic", .one_line = "a made-up eye", .create = {}, .keys = {{"seed", "1", "whole number"}}},
};

Result<Config> parse(std::string_view text) { return parse_config(text, "x.toml", "/folder", kDevices); }

struct Wrong {
    const char* name;
    const char* text;
    const char* where;
    const char* what;
    const char* way_out;
};

class ConfigErrors : public testing::TestWithParam<Wrong> {};

TEST_P(ConfigErrors, NamePlaceAndWayOut) {
    const Result<Config> config = parse(GetParam().text);
    ASSERT_FALSE(config);
    EXPECT_EQ(config.error().where, GetParam().where);
    EXPECT_EQ(config.error().what, GetParam().what);
    EXPECT_THAT(config.error().way_out, HasSubstr(GetParam().way_out));
}

INSTANTIATE_TEST_SUITE_P(
    Each, ConfigErrors,
    testing::Values(
        Wrong{"UnknownKey", "[loss]\nhold_ms = 1.0\nease_mss = 2.0\n", "x.toml:3:1", "unknown key 'ease_mss' in [loss]",
              "did you mean 'ease_ms'? legal keys: hold_ms, ease_ms"},
        Wrong{"ForgottenUnit", "\n[loss]\n  hold = 1.0\n", "x.toml:3:3", "unknown key 'hold' in [loss]", "did you mean 'hold_ms'?"},
        Wrong{"UnknownKeyFarFromAll", "[log]\nfrobnicate = 1\n", "x.toml:2:1", "unknown key 'frobnicate' in [log]", "legal keys: level"},
        Wrong{"UnknownSection", "[filterr]\nname = \"none\"\n", "x.toml:1:2", "unknown section [filterr]", "did you mean 'filter'?"},
        Wrong{"UnknownSubsection", "[filter.one_eura]\nbeta_per_deg = 1.0\n", "x.toml:1:9", "unknown section [filter.one_eura]",
              "did you mean 'filter.one_euro'?"},
        Wrong{"KeyOutsideSections", "level = \"info\"\n", "x.toml:1:1", "'level' stands outside the section that it belongs to", "legal sections"},
        Wrong{"SectionAsValue", "server = 3\n", "x.toml:1:10", "'server' is a section, not a value", "write [server]"},
        Wrong{"WrongTypeText", "[loss]\nhold_ms = \"long\"\n", "x.toml:2:11", "'loss.hold_ms' must be a number", "legal: [0, 10000] ms"},
        Wrong{"WrongTypeFraction", "[server]\nmax_clients = 1.5\n", "x.toml:2:15", "'server.max_clients' must be a whole number", "legal: [1, 256]"},
        Wrong{"WrongTypeList", "[server]\nuids = [1, \"me\"]\n", "x.toml:2:8", "'server.uids' must be a list of whole numbers", "legal: numbers in"},
        Wrong{"WrongTypeFlag", "[server]\nlock_memory = 1\n", "x.toml:2:15", "'server.lock_memory' must be true or false", "true or false"},
        Wrong{"TooLarge", "[loss]\nhold_ms = 10000.5\n", "x.toml:2:11", "'loss.hold_ms' cannot be 10000.5", "legal: [0, 10000] ms"},
        Wrong{"OpenEnd", "[filter.one_euro]\nmin_cutoff_hz = 0\n", "x.toml:2:17", "'filter.one_euro.min_cutoff_hz' cannot be 0.0", "legal: (0, 1000] Hz"},
        Wrong{"NotANumber", "[loss]\nhold_ms = nan\n", "x.toml:2:11", "'loss.hold_ms' cannot be nan", "legal: [0, 10000] ms"},
        Wrong{"Infinite", "[server]\nheartbeat_ms = inf\n", "x.toml:2:16", "'server.heartbeat_ms' cannot be inf", "legal: [1, 50] ms"},
        Wrong{"NegativeId", "[server]\nuids = [-1]\n", "x.toml:2:8", "'server.uids' cannot be [-1]", "legal: numbers in [0, 4294967294]"},
        Wrong{"UnknownWord", "[log]\nlevel = \"loud\"\n", "x.toml:2:9", "'log.level' cannot be \"loud\"", "legal: error, warn, info, debug"},
        Wrong{"UnknownFilter", "[filter]\nname = \"butterworth\"\n", "x.toml:2:8", "'filter.name' cannot be \"butterworth\"", "one_euro"},
        Wrong{"UnknownDriver", "[source]\ndriver = \"reply\"\n", "x.toml:2:10", "unknown driver 'reply'", "did you mean 'replay'? legal drivers: replay, synthetic"},
        Wrong{"KeyOfAnotherDriver", "[source]\ndriver = \"synthetic\"\nspeed = 1.0\n", "x.toml:3:1",
              "unknown key 'speed' in [source] of driver 'synthetic'", "legal keys: driver, wait_for_client, realtime_priority, rehearse, seed"},
        Wrong{"DriverKeyMisspelt", "[source]\npth = \"x\"\n", "x.toml:2:1", "unknown key 'pth' in [source] of driver 'replay'", "did you mean 'path'?"},
        Wrong{"DriverKeyOfWrongKind", "[source]\npath = [1]\n", "x.toml:2:8", "'source.path' must be text, a number, true or false", ""}),
    [](const auto& each) { return std::string(each.param.name); });

TEST(Config, NamesThePlaceOfASyntaxError) {
    const Result<Config> config = parse("[loss]\nhold_ms = = 3\n");
    ASSERT_FALSE(config);
    EXPECT_THAT(config.error().where, StartsWith("x.toml:2:"));
    EXPECT_THAT(config.error().what, StartsWith("this is not TOML: "));
    EXPECT_THAT(config.error().way_out, HasSubstr("--print-config"));
}

TEST(Config, RefusesAKeyThatIsGivenTwice) {
    const Result<Config> config = parse("[loss]\nhold_ms = 1.0\nhold_ms = 2.0\n");
    ASSERT_FALSE(config);
    EXPECT_THAT(config.error().where, StartsWith("x.toml:3:"));
}

TEST(Config, AnEmptyFileIsAllDefaults) {
    const Result<Config> config = parse("");
    ASSERT_TRUE(config) << config.error().message();
    const Config defaults;
    for (const ConfigKey& key : config_keys()) EXPECT_EQ(key.get(*config), key.get(defaults)) << key.section << "." << key.name;
}

TEST(Config, EveryKeyIsReadIntoItsOwnMember) {
    // A legal value that is not the default, for each key by its type; then only that key may differ.
    const Config defaults;
    for (const ConfigKey& key : config_keys()) {
        const std::string name = key.section + "." + key.name;
        std::vector<std::string> candidates;
        const KeyValue value = key.get(defaults);
        if (const bool* b = std::get_if<bool>(&value)) candidates = {*b ? "false" : "true"};
        if (const auto* i = std::get_if<std::int64_t>(&value)) candidates = {std::to_string(*i + 1), std::to_string(*i - 1)};
        if (const double* d = std::get_if<double>(&value)) candidates = {std::to_string(*d * 0.5 + 0.25), std::to_string(*d + 0.125)};
        if (std::holds_alternative<std::vector<std::int64_t>>(value)) candidates = {"[1, 65534]"};
        if (std::holds_alternative<std::string>(value))
            candidates = {"\"/some/path\"", "\"none\"", "\"hold\"", "\"debug\"", "\"synthetic\""};
        bool changed = false;
        for (const std::string& candidate : candidates) {
            const Result<Config> config = parse("[" + key.section + "]\n" + key.name + " = " + candidate + "\n");
            if (!config || key.get(*config) == key.get(defaults)) continue;
            changed = true;
            for (const ConfigKey& other : config_keys()) {
                if (&other == &key) continue;
                EXPECT_EQ(other.get(*config), other.get(defaults)) << name << " = " << candidate << " changed " << other.section << "." << other.name;
            }
            break;
        }
        EXPECT_TRUE(changed) << name << " takes none of the candidates";
    }
}

TEST(Config, ThePrintedDefaultsReadBackAsTheDefaults) {
    const std::string printed = print_default_config(kDevices);
    const Result<Config> config = parse(printed);
    ASSERT_TRUE(config) << config.error().message();
    const Config defaults;
    for (const ConfigKey& key : config_keys()) {
        EXPECT_EQ(key.get(*config), key.get(defaults)) << key.section << "." << key.name;
        EXPECT_THAT(printed, HasSubstr("\n" + key.name + " = ")) << key.section;
        EXPECT_FALSE(key.doc.empty()) << key.name;
        EXPECT_FALSE(key.legal.empty()) << key.name;
    }
    EXPECT_THAT(printed, HasSubstr("# Keys of driver \"synthetic\": a made-up eye."));
    EXPECT_THAT(printed, HasSubstr("#   seed = 1"));
}

TEST(Config, RelativePathsStartAtTheFile) {
    const Result<Config> config = parse(
        "[source]\npath = \"../a.csv\"\n[record]\npath = \"s.fovea\"\n[server]\nfocus_socket = \"/run/f\"\n");
    ASSERT_TRUE(config);
    EXPECT_EQ(config->source.device.values.at("path"), "/a.csv");
    EXPECT_EQ(config->record.path, "/folder/s.fovea");
    EXPECT_EQ(config->server.focus_socket, "/run/f");
}

TEST(Config, DriverKeysReachTheDriverWithTheirPlaces) {
    const Result<Config> config = parse("\n[source]\nspeed = 2\n");
    ASSERT_TRUE(config);
    EXPECT_EQ(config->source.device.values.at("speed"), "2");
    EXPECT_EQ(config->source.device.where_is("speed"), "x.toml:3:9");
    EXPECT_EQ(config->source.device.where_is("path"), "x.toml:2:1");
}

TEST(Config, DirectionsOfTheStaticFocalPointAreDegrees) {
    const Result<Config> config = parse("[loss]\nstatic_azimuth_deg = 90.0\n");
    ASSERT_FALSE(config);  // beyond 89
    const Result<Config> right = parse("[loss]\nstatic_azimuth_deg = 45.0\nstatic_elevation_deg = 0\n");
    ASSERT_TRUE(right);
    EXPECT_NEAR(right->pipeline.loss.static_dir_head.x, std::sqrt(0.5), 1e-12);
    EXPECT_NEAR(right->pipeline.loss.static_dir_head.z, -std::sqrt(0.5), 1e-12);
}

TEST(ConfigSet, OverridesOneKey) {
    Config config;
    ASSERT_TRUE(set_key(config, "loss.hold_ms=12.5", kDevices));
    EXPECT_EQ(config.pipeline.loss.hold, std::chrono::microseconds(12'500));
    ASSERT_TRUE(set_key(config, "log.level=warn", kDevices));  // as shells leave it, without quotes
    EXPECT_EQ(config.log.level, "warn");
    ASSERT_TRUE(set_key(config, "source.path=/tmp/a b=c.csv", kDevices));
    EXPECT_EQ(config.source.device.values.at("path"), "/tmp/a b=c.csv");
    EXPECT_EQ(config.source.device.where_is("path"), "--set source.path");
    EXPECT_EQ(config.pipeline.loss.hold, std::chrono::microseconds(12'500)) << "an earlier --set was lost";
}

TEST(ConfigSet, AnotherDriverDropsTheKeysOfTheFirst) {
    Config config;
    ASSERT_TRUE(set_key(config, "source.speed=3", kDevices));
    ASSERT_TRUE(set_key(config, "source.driver=synthetic", kDevices));
    EXPECT_TRUE(config.source.device.values.empty());
}

TEST(ConfigSet, ErrorsNameTheOption) {
    Config config;
    const Result<void> unknown = set_key(config, "loss.hld_ms=1", kDevices);
    ASSERT_FALSE(unknown);
    EXPECT_EQ(unknown.error().where, "--set loss.hld_ms=1");
    EXPECT_THAT(unknown.error().way_out, HasSubstr("did you mean 'hold_ms'?"));
    EXPECT_FALSE(set_key(config, "loss.hold_ms", kDevices));
    EXPECT_FALSE(set_key(config, "hold_ms=1", kDevices));
    EXPECT_FALSE(set_key(config, "loss.hold_ms=1\n[log]\nlevel='debug'", kDevices));
    EXPECT_EQ(config.log.level, "info");
}

TEST(ConfigFile, ThatIsMissingIsNamedWithAWayOut) {
    const Result<Config> config = load_config("/nonexistent/f.toml", kDevices);
    ASSERT_FALSE(config);
    EXPECT_EQ(config.error().where, "/nonexistent/f.toml");
    EXPECT_THAT(config.error().what, HasSubstr("No such file"));
    EXPECT_THAT(config.error().way_out, HasSubstr("--print-config"));
}

TEST(ConfigFile, NearestNameForgivesSlipsButNotStrangers) {
    EXPECT_EQ(nearest("min_cutof_hz", {"beta_per_deg", "min_cutoff_hz"}), "min_cutoff_hz");
    EXPECT_EQ(nearest("hold", {"hold_ms", "ease_ms"}), "hold_ms");
    EXPECT_EQ(nearest("zzzzzz", {"hold_ms", "ease_ms"}), "");
}

}  // namespace
}  // namespace fovea::service
