#include "drivers/hid/report_stream.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <thread>

using namespace fovea;
using namespace fovea::drivers;
using namespace fovea::drivers::hid;
using namespace std::chrono_literals;

namespace {

// A FIFO in packet mode stands in for the node: as with hidraw, one read gives one report.
class Node {
public:
    Node() {
        std::string name = (std::filesystem::temp_directory_path() / "fovea-node-XXXXXX").string();
        folder_ = ::mkdtemp(name.data());
        EXPECT_EQ(::mkfifo(path().c_str(), 0600), 0);
        EXPECT_EQ(stream.open(path()), 0);
        writer_ = UniqueFd(::open(path().c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC));
        EXPECT_EQ(::fcntl(writer_.get(), F_SETFL, O_DIRECT | O_NONBLOCK), 0);
    }
    ~Node() { std::filesystem::remove_all(folder_); }
    std::string path() const { return folder_ + "/hidraw"; }
    void send(std::vector<std::uint8_t> data) {
        EXPECT_EQ(::write(writer_.get(), data.data(), data.size()), static_cast<ssize_t>(data.size()));
    }
    ReportEvent next(Duration wait) { return stream.next(report, received, time.now() + wait, time); }
    std::vector<std::uint8_t> bytes() const { return {report.begin(), report.end()}; }

    SystemTime time;
    ReportStream stream{64};
    std::span<const std::uint8_t> report;
    Instant received;

private:
    std::string folder_;
    UniqueFd writer_;
};

}  // namespace

TEST(ReportStream, GivesReportsOneByOneWithTheirBounds) {
    Node n;
    n.send({1, 2, 3});
    n.send({4});
    const Instant before = n.time.now();
    ASSERT_EQ(n.next(10s), ReportEvent::report);
    EXPECT_EQ(n.bytes(), (std::vector<std::uint8_t>{1, 2, 3}));
    EXPECT_GE(n.received, before);
    ASSERT_EQ(n.next(-1s), ReportEvent::report) << "what is there already needs no time";
    EXPECT_EQ(n.bytes(), std::vector<std::uint8_t>{4});
    EXPECT_EQ(n.next(0s), ReportEvent::nothing);
}

TEST(ReportStream, SleepsUntilTheDeadlineOrAReport) {
    Node n;
    const Instant end = n.time.now() + 20ms;
    EXPECT_EQ(n.stream.next(n.report, n.received, end, n.time), ReportEvent::nothing);
    EXPECT_GE(n.time.now(), end);
    std::jthread later([&] { n.send({7}); });
    EXPECT_EQ(n.next(60s), ReportEvent::report);
}

TEST(ReportStream, AWakeUpEndsOneWaitEvenWhenItCameBefore) {
    Node n;
    n.stream.wake();
    n.stream.wake();
    EXPECT_EQ(n.next(60s), ReportEvent::nothing);
    EXPECT_EQ(n.next(1ms), ReportEvent::nothing) << "two at once count as one";
    std::jthread later([&] { n.stream.wake(); });
    EXPECT_EQ(n.next(60s), ReportEvent::nothing);
}

TEST(ReportStream, IsLostWhenTheNodeEndsOrIsClosed) {
    Node n;
    const std::string file = n.path() + ".empty";   // its end is all there is to read, as with a node that went away
    UniqueFd(::open(file.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600)).reset();
    ASSERT_EQ(n.stream.open(file), 0);
    EXPECT_EQ(n.next(60s), ReportEvent::lost);
    n.stream.close();
    EXPECT_EQ(n.next(60s), ReportEvent::lost);
    EXPECT_EQ(n.stream.open(n.path() + "/none"), ENOTDIR);
}
