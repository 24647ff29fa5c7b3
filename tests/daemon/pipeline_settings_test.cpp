#include <cmath>
#include <limits>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "daemon/pipeline/settings_table.hpp"

namespace fovea::pipeline {
namespace {

TEST(SettingsTable, HasEachKeyOnceAndFindsIt) {
    std::set<std::string> seen;
    for (const SettingRow& row : settings_table()) {
        EXPECT_TRUE(seen.insert(row.key).second) << row.key;
        EXPECT_EQ(find_setting(row.key), &row);
        EXPECT_FALSE(legal_values(row).empty()) << row.key;
    }
    EXPECT_EQ(find_setting("filter.one_euro.min_cutof_hz"), nullptr);
}

TEST(SettingsTable, AcceptsItsOwnDefaultsAndWritesThemBackUnchanged) {
    const PipelineSettings defaults;
    ASSERT_TRUE(check_settings(defaults)) << check_settings(defaults).error().message();
    PipelineSettings copy;
    copy.filter = "none";
    copy.loss.static_radius_rad = 1;
    for (const SettingRow& row : settings_table()) {
        ASSERT_TRUE(apply_setting(copy, row, row.get(defaults))) << row.key;
        EXPECT_EQ(toml_value(row.get(copy)), toml_value(row.get(defaults))) << row.key;
    }
}

TEST(SettingsTable, EachNumberSetsAMemberOfItsOwn) {
    for (const SettingRow& row : settings_table()) {
        if (row.kind != SettingKind::number) continue;
        PipelineSettings changed;
        ASSERT_TRUE(apply_setting(changed, row, row.max)) << row.key;
        for (const SettingRow& other : settings_table()) {
            const bool same = toml_value(other.get(changed)) == toml_value(other.get(PipelineSettings{}));
            // damping = 1 and end_ratio = 1 are not the defaults either: exactly the row itself differs.
            EXPECT_EQ(same, &other != &row) << "setting " << row.key << " and reading " << other.key;
        }
    }
}

TEST(SettingsTable, RefusesWhatLiesOutsideWithTheLegalRange) {
    PipelineSettings s;
    const SettingRow* cutoff = find_setting("filter.one_euro.min_cutoff_hz");
    ASSERT_NE(cutoff, nullptr);
    for (double bad : {0.0, -1.0, 1000.1, std::nan(""), std::numeric_limits<double>::infinity()}) {
        const auto r = apply_setting(s, *cutoff, bad);
        ASSERT_FALSE(r) << bad;
        EXPECT_NE(r.error().way_out.find("(0, 1000] Hz"), std::string::npos) << r.error().way_out;
    }
    EXPECT_EQ(s.one_euro.min_cutoff_hz, PipelineSettings{}.one_euro.min_cutoff_hz);
    EXPECT_FALSE(apply_setting(s, *cutoff, std::string("five")));
    const SettingRow* filter = find_setting("filter.name");
    ASSERT_NE(filter, nullptr);
    EXPECT_FALSE(apply_setting(s, *filter, std::string("two_euro")));
    s.predictor.name = "crystal_ball";
    EXPECT_FALSE(check_settings(s));
}

}  // namespace
}  // namespace fovea::pipeline
