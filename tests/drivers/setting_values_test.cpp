#include "drivers/setting_values.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

using namespace fovea;
using namespace fovea::drivers;

namespace {

DeviceSettings settings(std::map<std::string, std::string> values) {
    DeviceSettings s{std::move(values), "f.toml:1", {}};
    for (const auto& [key, value] : s.values) s.where_of[key] = "f.toml:7:" + std::to_string(key.size());
    return s;
}

}  // namespace

TEST(SettingValues, ReadsNumbersFlagsAndWords) {
    const auto s = settings({{"a", "0x1F"}, {"b", "2.5"}, {"c", "true"}, {"d", "GREY"}, {"e", "-1"}});
    SettingValues v(s);
    EXPECT_EQ(v.integer("a", 0, 0, 100), 31);
    EXPECT_EQ(v.number("b", 0, 0, 10), 2.5);
    EXPECT_TRUE(v.flag("c", false));
    EXPECT_EQ(v.choice("d", "auto", "auto GREY"), "GREY");
    EXPECT_EQ(v.integer("e", 0, -1, 1), -1);
    EXPECT_EQ(v.integer("missing", 7, 0, 9), 7);
    EXPECT_TRUE(v.failure());
}

TEST(SettingValues, KeepsTheFirstErrorWithItsPlaceAndTheLegalRange) {
    for (const char* bad : {"11", "-1", "x", "", "3.5", "5 ", "0x", "99999999999999999999"}) {
        const auto s = settings({{"key", bad}, {"other", "nope"}});
        SettingValues v(s);
        EXPECT_EQ(v.integer("key", 4, 0, 10), 4) << bad;
        EXPECT_FALSE(v.flag("other", false));
        ASSERT_FALSE(v.failure()) << bad;
        EXPECT_THAT(v.failure().error().message(), testing::HasSubstr("f.toml:7:3: source.key is '" + std::string(bad) + "'"));
        EXPECT_THAT(v.failure().error().message(), testing::HasSubstr("0 to 10"));
    }
    for (const char* bad : {"nan", "inf", "-0.1", "1.1", "1,0"}) {
        const auto s = settings({{"key", bad}});
        SettingValues v(s);
        EXPECT_EQ(v.number("key", 0.5, 0, 1), 0.5) << bad;
        EXPECT_FALSE(v.failure()) << bad;
    }
}

TEST(DeviceTable, NamesEachDriverAndEachKeyOnceAndStartsNoneFromNonsense) {
    const SystemTime time;
    for (const DeviceRow& row : device_table()) {
        std::map<std::string, int> seen;
        for (const DeviceKey& key : row.keys) EXPECT_EQ(++seen[key.name], 1) << row.driver << "." << key.name;
        if (std::string(row.driver) == "synthetic") continue;   // it plays a file, which has no default
        EXPECT_TRUE(row.create(settings({}), time)) << row.driver << ": the defaults are legal";
        for (const DeviceKey& key : row.keys) {
            if (std::string(key.default_toml).starts_with('"')) continue;   // text may be anything
            const auto made = row.create(settings({{key.name, "nonsense"}}), time);
            // A key of a driver that "auto" does not name by default is not looked at.
            if (made && std::string(row.driver) == "auto") continue;
            ASSERT_FALSE(made) << row.driver << "." << key.name;
            EXPECT_THAT(made.error().message(), testing::HasSubstr("f.toml:7:"));
        }
    }
}
