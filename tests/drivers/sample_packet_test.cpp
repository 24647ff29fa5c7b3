#include "drivers/sample/sample_packet.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

using namespace fovea;
using namespace fovea::drivers::sample;

namespace {

std::array<std::uint8_t, kPacketBytes> packet() {
    // 10.00 degrees right, 5.00 down, valid, open, 3.5 mm; counter 258, time 1.0 s
    return {'F', 'S', 2, 1, 0x10, 0x27, 0, 0, 0xE8, 0x03, 0x0C, 0xFE, 3, 70, 0, 0, 0, 0, 0, 0};
}

}  // namespace

TEST(SamplePacket, IsTurnedIntoTheHeadFrame) {
    const auto p = decode(packet());
    ASSERT_TRUE(p);
    EXPECT_EQ(p->counter, 258);
    EXPECT_EQ(p->time_ticks, 10'000u);
    EXPECT_TRUE(p->gaze.valid);
    EXPECT_NEAR(std::atan2(p->gaze.gaze_dir_head.x, -p->gaze.gaze_dir_head.z) * 57.29577951308232, 10, 1e-9);
    EXPECT_LT(p->gaze.gaze_dir_head.y, 0);
    EXPECT_EQ(p->gaze.openness, 1);
    EXPECT_NEAR(p->gaze.pupil_mm, 3.5, 1e-12);
}

TEST(SamplePacket, IsNothingWithAnotherLengthOrMagicAndInvalidBeyondARightAngle) {
    auto b = packet();
    EXPECT_FALSE(decode({b.data(), b.size() - 1}));
    b[8] = 0x28, b[9] = 0x23;   // 90 degrees
    EXPECT_FALSE(decode(b)->gaze.valid);
    b[1] = 'T';
    EXPECT_FALSE(decode(b));
}

TEST(TickClock, GoesOnOverAWrapAndBackForAPacketOutOfOrder) {
    TickClock c;
    EXPECT_EQ(c.extend(0xFFFFFFFE).ns, 0xFFFFFFFEll * 100'000);
    EXPECT_EQ(c.extend(3).ns, (0xFFFFFFFEll + 5) * 100'000);
    EXPECT_EQ(c.extend(1).ns, (0xFFFFFFFEll + 3) * 100'000);
}
