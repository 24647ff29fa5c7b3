#include "drivers/priority_device.hpp"

#include <algorithm>
#include <atomic>
#include <deque>
#include <semaphore>
#include <sstream>
#include <thread>
#include <utility>

#include "drivers/setting_values.hpp"

namespace fovea::drivers {

namespace {

// How long the active device may keep a better one that is being watched waiting.
constexpr Duration kWatchSlice = std::chrono::milliseconds(4);

enum class Hold : std::uint8_t {
    closed, open,         // the poller's
    wanted, unwanted,     // the opener's
};

class PriorityDevice final : public Device {
public:
    PriorityDevice(std::vector<std::unique_ptr<Device>> devices, const PrioritySettings& settings, const TimeSource& time)
        : settings_{settings}, time_{time} {
        for (auto& d : devices) members_.emplace_back().device = std::move(d);
        if (settings_.own_thread)
            opener_ = std::thread([this] {
                for (;;) {
                    work_.acquire();
                    if (ending_.load(std::memory_order_relaxed)) return;   // the semaphore orders it
                    for (Member& m : members_) serve(m);
                }
            });
    }
    ~PriorityDevice() override {
        close();
        ending_.store(true, std::memory_order_relaxed);
        work_.release();
        if (opener_.joinable()) opener_.join();
    }

    DeviceInfo info() const override {
        if (active_ < members_.size()) return members_[active_].device->info();
        return {"auto", "no tracker", "", 0, false};
    }

    Result<void> open() override {
        close();
        next_id_ = 1;
        std::string tried;
        for (std::size_t i = 0; i < members_.size(); ++i) {
            Member& m = members_[i];
            auto opened = m.device->open();
            if (opened) {
                m.hold.store(Hold::open, std::memory_order_relaxed);
                active_ = i;
                return {};
            }
            m.try_at = time_.now() + settings_.retry;
            tried += (i == 0 ? "" : "; ") + opened.error().message();
        }
        return fail("no tracker can be opened: " + tried);
    }

    PollStatus poll(GazeSample& out, Instant deadline) noexcept override {
        for (;;) {
            const Instant now = time_.now();
            if (woken_.exchange(false, std::memory_order_relaxed)) return PollStatus::nothing;
            if (active_ >= members_.size()) {
                if (!falling_back_) return PollStatus::lost;
                switch (take_fall_back()) {
                    case PollStatus::sample: continue;   // there is an active device again
                    case PollStatus::lost: return PollStatus::lost;
                    default: break;
                }
                if (now >= deadline) return PollStatus::nothing;
                static_cast<void>(done_.try_acquire_for(std::min<Duration>(deadline - now, std::chrono::milliseconds(100))));
                continue;
            }
            const bool watching = watch_better(now, out);
            Instant until = deadline;
            if (watching) until = std::min(until, now + kWatchSlice);
            for (std::size_t i = 0; i < active_; ++i)
                if (held(members_[i]) == Hold::closed) until = std::min(until, std::max(members_[i].try_at, now));
            switch (members_[active_].device->poll(out, until)) {
                case PollStatus::sample:
                    out.id = next_id_++;
                    return PollStatus::sample;
                case PollStatus::ended: return PollStatus::ended;
                case PollStatus::nothing:
                    if (time_.now() >= deadline) return PollStatus::nothing;
                    break;
                case PollStatus::lost:
                    let_go(members_[active_]);
                    begin_fall_back();
                    break;
            }
        }
    }

    void wake() noexcept override {
        woken_.store(true, std::memory_order_relaxed);   // a flag alone: nothing to order
        for (auto& m : members_) m.device->wake();
        done_.release();
    }

    void rehearse() noexcept override {
        if (active_ < members_.size()) members_[active_].device->rehearse();
    }

    void close() noexcept override {
        for (auto& m : members_) {
            for (Hold h = held(m); h == Hold::wanted || h == Hold::unwanted; h = held(m)) m.hold.wait(h, std::memory_order_acquire);
            if (held(m) == Hold::open) m.device->close();
            m.hold.store(Hold::closed, std::memory_order_relaxed);
            m.proving = false;
        }
        active_ = members_.size();
        falling_back_ = false;
    }

    DeviceCounters counters() const noexcept override {
        DeviceCounters sum;
        for (const auto& m : members_) {
            const Hold h = held(m);
            if (h == Hold::open || h == Hold::closed) m.last_seen_counters = m.device->counters();
            const DeviceCounters& c = m.last_seen_counters;
            sum.samples += c.samples;
            sum.malformed += c.malformed;
            sum.dropped += c.dropped;
            sum.losses += c.losses;
            if (*c.last_loss != '\0') sum.last_loss = c.last_loss;
        }
        sum.switches = switches_;
        return sum;
    }

private:
    struct Member {
        std::unique_ptr<Device> device;
        // Whose the device is just now. Release by who hands it over, acquire by who takes it.
        std::atomic<Hold> hold{Hold::closed};
        Instant try_at;        // when an open() may be tried again
        Instant valid_since;   // of the unbroken run of valid samples, while proving
        Instant last_seen;
        bool proving = false, watched = false;
        mutable DeviceCounters last_seen_counters;
    };

    static Hold held(const Member& m) noexcept { return m.hold.load(std::memory_order_acquire); }

    // On the opener's thread: does what is wanted of this device.
    void serve(Member& m) noexcept {
        const Hold h = held(m);
        if (h != Hold::wanted && h != Hold::unwanted) return;
        bool is_open = false;
        if (h == Hold::unwanted) m.device->close();
        else is_open = try_open(m);
        m.hold.store(is_open ? Hold::open : Hold::closed, std::memory_order_release);
        m.hold.notify_all();
        done_.release();
    }

    void hand_over(Member& m, Hold to) noexcept {
        m.try_at = time_.now() + settings_.retry;
        m.proving = m.watched = false;
        m.hold.store(to, std::memory_order_release);
        if (settings_.own_thread) work_.release();
        else serve(m);
    }

    void let_go(Member& m) noexcept { hand_over(m, Hold::unwanted); }

    // Asks for what is better than the active device and due, and looks at what is open of it. `scratch` is overwritten.
    bool watch_better(Instant now, GazeSample& scratch) noexcept {
        bool watching = false;
        for (std::size_t i = 0; i < active_; ++i) {
            Member& m = members_[i];
            if (held(m) == Hold::closed && now >= m.try_at) hand_over(m, Hold::wanted);
            if (held(m) != Hold::open) continue;
            if (!std::exchange(m.watched, true)) m.last_seen = now;
            watching = true;
            for (;;) {   // all that is waiting: its newest sample counts
                const PollStatus status = m.device->poll(scratch, now);
                if (status == PollStatus::lost || status == PollStatus::ended) {
                    let_go(m);
                    break;
                }
                if (status == PollStatus::nothing) {
                    // Silence is no proof either.
                    if (m.proving && now - m.last_seen > settings_.return_after / 2) m.proving = false;
                    break;
                }
                m.last_seen = now;
                const bool valid = scratch.eye(Eye::combined).valid;
                if (valid && !m.proving) m.valid_since = now;
                m.proving = valid;
                if (m.proving && now - m.valid_since >= settings_.return_after) {
                    change_to(i);
                    return false;
                }
            }
        }
        return watching;
    }

    static bool try_open(Member& m) noexcept {
        try {
            return m.device->open().has_value();
        } catch (const std::exception&) {   // no memory for an error's text, say: the device is not there for now
            return false;
        }
    }

    void change_to(std::size_t index) noexcept {
        for (std::size_t i = 0; i < members_.size(); ++i)
            if (i != index && held(members_[i]) == Hold::open) let_go(members_[i]);
        active_ = index;
        falling_back_ = false;
        ++switches_;
    }

    // The active device is gone: all others are asked for, but the one that was lost.
    void begin_fall_back() noexcept {
        const std::size_t lost = std::exchange(active_, members_.size());
        falling_back_ = true;
        for (std::size_t i = 0; i < members_.size(); ++i)
            if (i != lost && held(members_[i]) == Hold::closed) hand_over(members_[i], Hold::wanted);
    }

    // `sample`: one has been taken; `nothing`: not known yet; `lost`: none opens.
    PollStatus take_fall_back() noexcept {
        bool pending = false;
        for (std::size_t i = 0; i < members_.size(); ++i) {
            const Hold h = held(members_[i]);
            if (h == Hold::wanted) pending = true;   // a better one may still come
            if (h != Hold::open || pending) continue;
            change_to(i);
            return PollStatus::sample;
        }
        if (pending) return PollStatus::nothing;
        falling_back_ = false;
        return PollStatus::lost;
    }

    PrioritySettings settings_;
    const TimeSource& time_;
    std::deque<Member> members_;   // a deque never moves what it holds
    std::size_t active_ = static_cast<std::size_t>(-1);
    std::uint64_t next_id_ = 1, switches_ = 0;
    bool falling_back_ = false;
    std::atomic<bool> woken_{false}, ending_{false};
    std::counting_semaphore<> work_{0}, done_{0};
    std::thread opener_;
};

}  // namespace

std::unique_ptr<Device> make_priority_device(std::vector<std::unique_ptr<Device>> devices, const PrioritySettings& settings,
                                             const TimeSource& time) {
    return std::make_unique<PriorityDevice>(std::move(devices), settings, time);
}

DeviceRow priority_row(std::vector<DeviceRow> rows) {
    static std::deque<std::string> names;   // DeviceKey points at its name; a deque never moves what it holds
    DeviceRow row;
    row.driver = "auto";
    row.one_line = "the best tracker that is there, the next best when it is lost";
    row.keys = {
        {"order", "\"hid psvr2 camera\"", "drivers in order of preference, separated by spaces"},
        {"return_after_ms", "1000", "a better tracker that is back takes over after so much valid gaze; milliseconds, 0 to 60000"},
        {"retry_ms", "2000", "how often a missing better tracker is looked for; milliseconds, 100 to 60000"},
    };
    for (const DeviceRow& r : rows)
        for (const DeviceKey& k : r.keys) row.keys.push_back({names.emplace_back(std::string(r.driver) + "_" + k.name).c_str(), k.default_toml, k.doc});
    row.create = [rows = std::move(rows)](const DeviceSettings& settings, const TimeSource& time) -> Result<std::unique_ptr<Device>> {
        SettingValues v(settings);
        PrioritySettings s;
        s.return_after = std::chrono::milliseconds(v.integer("return_after_ms", 1000, 0, 60000));
        s.retry = std::chrono::milliseconds(v.integer("retry_ms", 2000, 100, 60000));
        std::istringstream order(v.text("order", "hid psvr2 camera"));
        if (auto bad = v.failure(); !bad) return std::unexpected(bad.error());
        std::vector<std::unique_ptr<Device>> devices;
        std::string legal;
        for (const DeviceRow& r : rows) legal += std::string(legal.empty() ? "" : " ") + r.driver;
        for (std::string word; order >> word;) {
            const auto r = std::ranges::find_if(rows, [&](const DeviceRow& x) { return word == x.driver; });
            if (r == rows.end()) return fail("source.order names '" + word + "'", settings.where_is("order"), "legal: " + legal);
            DeviceSettings own;
            own.where = settings.where;
            const std::string prefix = word + "_";
            for (const auto& [key, value] : settings.values)
                if (key.starts_with(prefix)) {
                    own.values[key.substr(prefix.size())] = value;
                    own.where_of[key.substr(prefix.size())] = settings.where_is(key);
                }
            auto device = r->create(own, time);
            if (!device) return device;
            devices.push_back(std::move(*device));
        }
        if (devices.empty()) return fail("source.order names no driver", settings.where_is("order"), "legal: " + legal);
        return make_priority_device(std::move(devices), s, time);
    };
    return row;
}

}  // namespace fovea::drivers
