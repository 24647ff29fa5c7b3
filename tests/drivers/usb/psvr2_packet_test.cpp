#include "drivers/usb/psvr2_packet.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "protocol/sphere.hpp"
#include "tests/drivers/usb/psvr2_encode.hpp"

using namespace fovea;
using namespace fovea::drivers::usb;
using fovea::tests::encode_psvr2;
using fovea::tests::Psvr2Truth;

namespace {

Psvr2Truth truth() {
    Psvr2Truth t;
    t.timestamp_us = 1'234'567'890'123;
    t.frame = 77;
    t.left = from_azimuth_elevation<HeadFrame>({0.30, 0.1});
    t.right = from_azimuth_elevation<HeadFrame>({0.26, 0.1});
    t.combined = from_azimuth_elevation<HeadFrame>({0.28, 0.1});
    return t;
}

}  // namespace

TEST(Psvr2Packet, IsTurnedIntoTheHeadFrame) {
    GazeSample s;
    std::uint32_t frame = 0;
    ASSERT_EQ(decode_psvr2(encode_psvr2(truth()), s, frame), Psvr2Packet::gaze);
    EXPECT_EQ(frame, 77u);
    EXPECT_EQ(s.device_time.ns, 1'234'567'890'123'000);
    EXPECT_LT(angle_between(s.eye(Eye::left).gaze_dir_head, truth().left), 1e-6);
    EXPECT_LT(angle_between(s.eye(Eye::right).gaze_dir_head, truth().right), 1e-6);
    EXPECT_LT(angle_between(s.eye(Eye::combined).gaze_dir_head, truth().combined), 1e-6);
    EXPECT_NEAR(s.eye(Eye::left).pupil_mm, 3.5, 1e-6);
    EXPECT_EQ(s.eye(Eye::combined).openness, 1.0);
}

TEST(Psvr2Packet, TellsABlinkAndWhatIsNotValid) {
    Psvr2Truth t = truth();
    t.valid = false;
    t.blink = true;
    GazeSample s;
    std::uint32_t frame = 0;
    ASSERT_EQ(decode_psvr2(encode_psvr2(t), s, frame), Psvr2Packet::gaze);
    for (const EyeState& e : s.eyes) EXPECT_FALSE(e.valid);
    EXPECT_EQ(s.eye(Eye::combined).openness, 0.0);
    EXPECT_TRUE(std::isnan(s.eye(Eye::left).pupil_mm));
}

TEST(Psvr2Packet, IsMalformedWhenShortOverlongOrOfAnotherMagic) {
    GazeSample s;
    std::uint32_t frame = 0;
    const auto b = encode_psvr2(truth());
    std::vector<std::uint8_t> bytes(b.begin(), b.end());
    bytes.push_back(0);
    EXPECT_EQ(decode_psvr2(bytes, s, frame), Psvr2Packet::malformed);
    for (std::size_t n = 0; n < b.size(); ++n) EXPECT_EQ(decode_psvr2({b.data(), n}, s, frame), Psvr2Packet::malformed);
    bytes = {b.begin(), b.end()};
    bytes[1] = 'C';
    EXPECT_EQ(decode_psvr2(bytes, s, frame), Psvr2Packet::other);
    bytes[1] = 'X';
    EXPECT_EQ(decode_psvr2(bytes, s, frame), Psvr2Packet::malformed);
}

TEST(Psvr2Packet, RefusesDirectionsThatAreNone) {
    for (const double scale : {0.0, 0.5, 1.5, std::nan(""), 1e30}) {
        Psvr2Truth t = truth();
        t.combined = {0, 0, -scale};
        GazeSample s;
        std::uint32_t frame = 0;
        ASSERT_EQ(decode_psvr2(encode_psvr2(t), s, frame), Psvr2Packet::gaze);
        EXPECT_FALSE(s.eye(Eye::combined).valid);
        EXPECT_TRUE(s.eye(Eye::left).valid);
    }
}

TEST(PacketJoiner, JoinsTornPacketsAtEveryByte) {
    const auto b = encode_psvr2(truth());
    for (std::size_t cut = 2; cut < b.size(); ++cut) {
        PacketJoiner j;
        EXPECT_TRUE(j.take({b.data(), cut}).empty());
        const auto whole = j.take({b.data() + cut, b.size() - cut});
        ASSERT_EQ(whole.size(), b.size()) << cut;
        EXPECT_TRUE(std::equal(whole.begin(), whole.end(), b.begin()));
        EXPECT_EQ(j.malformed(), 0u);
    }
}

TEST(PacketJoiner, FindsTheNextPacketAfterALostPiece) {
    const auto b = encode_psvr2(truth());
    PacketJoiner j;
    EXPECT_TRUE(j.take({b.data() + 100, 100}).empty());   // the end of a packet whose beginning is lost
    EXPECT_EQ(j.malformed(), 1u);
    EXPECT_TRUE(j.take({b.data(), 200}).empty());          // cut off by ...
    EXPECT_EQ(j.take(b).size(), b.size());                 // ... the next
    EXPECT_EQ(j.malformed(), 2u);
    EXPECT_TRUE(j.take({b.data(), 200}).empty());
    std::vector<std::uint8_t> too_long(200, 1);
    EXPECT_TRUE(j.take(too_long).empty());
    EXPECT_EQ(j.malformed(), 3u);
    EXPECT_EQ(j.take(b).size(), b.size());
}

TEST(PacketJoiner, AndTheDecoderSurviveAMillionHostileTransfers) {
    std::mt19937_64 rng(11);
    PacketJoiner j;
    GazeSample s;
    std::uint32_t frame = 0;
    std::uint64_t gazes = 0;
    std::vector<std::uint8_t> bytes;
    for (int i = 0; i < 1'000'000; ++i) {
        if (rng() % 2 == 0) {
            const auto b = encode_psvr2(truth());
            bytes.assign(b.begin(), b.end());
            for (std::size_t n = rng() % 6; n > 0; --n) bytes[rng() % bytes.size()] = static_cast<std::uint8_t>(rng());
            if (rng() % 2 == 0) bytes.resize(rng() % bytes.size());
        } else {
            bytes.resize(rng() % 400);
            if (!bytes.empty()) bytes[rng() % bytes.size()] = static_cast<std::uint8_t>(rng());
        }
        const auto packet = j.take(bytes);
        if (packet.empty() || decode_psvr2(packet, s, frame) != Psvr2Packet::gaze) continue;
        ++gazes;
        for (const EyeState& e : s.eyes)
            ASSERT_NEAR(std::hypot(e.gaze_dir_head.x, e.gaze_dir_head.y, e.gaze_dir_head.z), 1, 1e-9);
    }
    EXPECT_GT(gazes, 100'000u);
    EXPECT_GT(j.malformed(), 100'000u);
}
