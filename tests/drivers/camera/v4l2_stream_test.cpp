#include "drivers/camera/v4l2_stream.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/drivers/camera/fake_camera.hpp"

using namespace fovea;
using namespace fovea::drivers::camera;
using fovea::tests::FakeCamera;
using fovea::tests::FakeCameras;

namespace {

struct OneCamera {
    FakeCameras calls;
    FakeCamera& camera = calls.at("/dev/video0");
    V4l2Stream stream{calls};
    Frame frame;
    std::uint32_t sequence = 0;

    Result<void> open(StreamSettings s = {}) {
        s.path = "/dev/video0";
        return stream.open(s);
    }
    FakeCamera::Picture picture(std::uint8_t level, std::size_t bytes = 64 * 48) {
        return {std::vector<std::uint8_t>(bytes, level), sequence++, 1'000'000'000};
    }
    void show(FakeCamera::Picture p) { calls.show("/dev/video0", std::move(p)); }
    FrameEvent next() { return stream.next(frame, instant_from_ns(2'000'000'000)); }
};

}  // namespace

TEST(V4l2Stream, TakesTheFirstKindOfMemoryThatTheCameraReallyGives) {
    struct Case {
        bool mapping, maps, pointers, dma;
        BufferMemory wanted;
    };
    for (const Case& k : {Case{true, true, true, true, BufferMemory::mapped}, Case{false, true, true, true, BufferMemory::user_pointer},
                          Case{true, false, true, true, BufferMemory::user_pointer}, Case{true, false, false, true, BufferMemory::dma_buffer}}) {
        OneCamera c;
        c.camera.offers_mapping = k.mapping;
        c.camera.maps = k.maps;
        c.camera.offers_user_pointers = k.pointers;
        c.camera.offers_dma_buffers = k.dma;
        ASSERT_TRUE(c.open()) << to_string(k.wanted);
        EXPECT_EQ(c.stream.memory(), k.wanted);
        for (int i = 0; i < 20; ++i) {   // round all buffers more than once
            c.show(c.picture(static_cast<std::uint8_t>(10 + i)));
            ASSERT_EQ(c.next(), FrameEvent::frame) << to_string(k.wanted);
            ASSERT_EQ(c.frame.bytes.size(), 64u * 48u);
            EXPECT_EQ(c.frame.bytes[100], 10 + i);
        }
        EXPECT_EQ(c.calls.syncs(), k.wanted == BufferMemory::dma_buffer ? 39 : 0) << "a begin and an end per frame but the last";
        c.stream.close();
        EXPECT_EQ(c.calls.held(), 0) << to_string(k.wanted);
    }
}

TEST(V4l2Stream, SaysWhatWasTriedWhenNoMemoryServes) {
    OneCamera c;
    c.camera.maps = c.camera.offers_user_pointers = false;
    c.calls.has_dma_heap = false;
    const auto opened = c.open();
    ASSERT_FALSE(opened);
    EXPECT_THAT(opened.error().message(), testing::AllOf(testing::HasSubstr("memory mapping: no memory"),
                                                         testing::HasSubstr("user pointers: not offered"), testing::HasSubstr("/dev/dma_heap/system")));
    EXPECT_EQ(c.calls.held(), 0);
}

TEST(V4l2Stream, WorksOutSizesThatADriverLeavesAtZero) {
    for (const bool pointers : {false, true}) {
        OneCamera c;
        c.camera.tells_sizes = false;
        c.camera.offers_mapping = !pointers;
        c.camera.formats = {V4L2_PIX_FMT_YUYV};
        ASSERT_TRUE(c.open());
        EXPECT_EQ(c.stream.stride(), 128u);
        auto p = c.picture(7, 64 * 48 * 2);
        p.tells_bytes = false;
        c.show(p);
        ASSERT_EQ(c.next(), FrameEvent::frame);
        EXPECT_EQ(c.frame.bytes.size(), 64u * 48u * 2u);
    }
}

TEST(V4l2Stream, OfTwoFramesInOneBufferTheNewerCounts) {
    OneCamera c;
    ASSERT_TRUE(c.open());
    auto p = c.picture(1);
    p.bytes.resize(2 * 64 * 48, 2);
    c.show(p);
    ASSERT_EQ(c.next(), FrameEvent::frame);
    EXPECT_EQ(c.frame.bytes.size(), 64u * 48u);
    EXPECT_EQ(c.frame.bytes[0], 2);
    EXPECT_EQ(c.stream.counters().dropped, 1u);
}

TEST(V4l2Stream, OfFramesThatWaitTheNewestCountsAndTheOthersAreDropped) {
    OneCamera c;
    ASSERT_TRUE(c.open());
    for (std::uint8_t i = 0; i < 3; ++i) c.show(c.picture(i));
    ASSERT_EQ(c.next(), FrameEvent::frame);
    EXPECT_EQ(c.frame.bytes[0], 2);
    EXPECT_EQ(c.stream.counters().dropped, 2u);
    EXPECT_EQ(c.next(), FrameEvent::nothing);
}

TEST(V4l2Stream, CountsGapsOfTheSequenceAlsoOverItsWrap) {
    OneCamera c;
    ASSERT_TRUE(c.open());
    c.sequence = 0xFFFFFFFD;
    for (const std::uint32_t skip : {0u, 4u, 0u}) {
        c.sequence += skip;
        c.show(c.picture(1));
        ASSERT_EQ(c.next(), FrameEvent::frame);
    }
    EXPECT_EQ(c.stream.counters().dropped, 4u);
    c.sequence = 5;   // a driver that begins to count anew is no loss of four thousand million
    c.show(c.picture(1));
    ASSERT_EQ(c.next(), FrameEvent::frame);
    EXPECT_LE(c.stream.counters().dropped, 4u + 10u);
}

TEST(V4l2Stream, PutsUpWithSomeBrokenFramesButNotForEver) {
    OneCamera c;
    ASSERT_TRUE(c.open());
    auto broken = c.picture(1);
    broken.flags = V4L2_BUF_FLAG_ERROR;
    c.show(broken);
    EXPECT_EQ(c.next(), FrameEvent::nothing);
    c.show(c.picture(3));
    EXPECT_EQ(c.next(), FrameEvent::frame);
    EXPECT_EQ(c.stream.counters().broken, 1u);
    FrameEvent event = FrameEvent::nothing;
    int n = 0;
    for (; event != FrameEvent::lost && n < 100; ++n) {
        c.show(broken);
        event = c.next();
    }
    EXPECT_EQ(event, FrameEvent::lost);
    EXPECT_GT(n, 16);
}

TEST(V4l2Stream, ClampsStampsOfTheFutureAndMarksThoseOfAnotherClock) {
    OneCamera c;
    ASSERT_TRUE(c.open());
    auto p = c.picture(1);
    p.captured_ns = 9'000'000'000;   // vivid does so
    c.show(p);
    ASSERT_EQ(c.next(), FrameEvent::frame);
    EXPECT_TRUE(c.frame.captured_known);
    EXPECT_EQ(to_ns(c.frame.captured), 2'000'000'000);
    c.camera.stamp_flag = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
    c.show(c.picture(1));
    ASSERT_EQ(c.next(), FrameEvent::frame);
    EXPECT_FALSE(c.frame.captured_known);
    EXPECT_EQ(to_ns(c.frame.captured), 2'000'000'000);
}

TEST(V4l2Stream, IsLostWhenUnpluggedAndOpensAgain) {
    OneCamera c;
    ASSERT_TRUE(c.open());
    c.calls.unplug("/dev/video0");
    EXPECT_EQ(c.next(), FrameEvent::lost);
    c.stream.close();
    EXPECT_EQ(c.calls.held(), 0);
    EXPECT_FALSE(c.open());
    c.calls.plug_in("/dev/video0");
    EXPECT_TRUE(c.open());
}

TEST(V4l2Stream, SetsExposureAndGainOnlyWhenAsked) {
    OneCamera c;
    ASSERT_TRUE(c.open());
    EXPECT_TRUE(c.camera.controls.empty());
    StreamSettings asked;
    asked.exposure_us = 2000;
    asked.gain = 3;
    ASSERT_TRUE(c.open(asked));
    EXPECT_EQ(c.camera.controls.at(V4L2_CID_EXPOSURE_ABSOLUTE), 20);
    EXPECT_EQ(c.camera.controls.at(V4L2_CID_GAIN), 3);
}
