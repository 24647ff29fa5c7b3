#include "drivers/priority_device.hpp"

#include <algorithm>
#include <atomic>
#include <deque>
#include <sstream>

#include "drivers/setting_values.hpp"

namespace fovea::drivers {

namespace {

// How long the active device may keep a better one that is being watched waiting.
constexpr Duration kWatchSlice = std::chrono::milliseconds(4);

class PriorityDevice final : public Device {
public:
    PriorityDevice(std::vector<std::unique_ptr<Device>> devices, const PrioritySettings& settings, const TimeSource& time)
        : settings_{settings}, time_{time} {
        for (auto& d : devices) {
            members_.emplace_back();
            members_.back().device = std::move(d);
        }
    }
    ~PriorityDevice() override { close(); }

    DeviceInfo info() const override {
        if (active_ < members_.size()) return members_[active_].device->info();
        return {"auto", "no tracker", "", 0, false};
    }

    Result<void> open() override {
        close();
        next_id_ = 1;
        return open_best();
    }

    PollStatus poll(GazeSample& out, Instant deadline) noexcept override {
        if (active_ >= members_.size()) return PollStatus::lost;
        for (;;) {
            const Instant now = time_.now();
            if (woken_.exchange(false, std::memory_order_relaxed)) return PollStatus::nothing;
            const bool watching = watch_better(now, out);
            Instant until = deadline;
            if (watching) until = std::min(until, now + kWatchSlice);
            for (std::size_t i = 0; i < active_; ++i)
                if (!members_[i].open) until = std::min(until, std::max(members_[i].try_at, now));
            switch (members_[active_].device->poll(out, until)) {
                case PollStatus::sample:
                    out.id = next_id_++;
                    return PollStatus::sample;
                case PollStatus::ended: return PollStatus::ended;
                case PollStatus::nothing:
                    if (time_.now() >= deadline) return PollStatus::nothing;
                    break;
                case PollStatus::lost: {
                    Member& m = members_[active_];
                    m.device->close();
                    m.open = false;
                    m.try_at = time_.now() + settings_.retry;
                    if (!fall_back()) return PollStatus::lost;
                    break;
                }
            }
        }
    }

    void wake() noexcept override {
        woken_.store(true, std::memory_order_relaxed);   // a flag alone: nothing to order
        for (auto& m : members_) m.device->wake();
    }

    void close() noexcept override {
        for (auto& m : members_) {
            if (m.open) m.device->close();
            m.open = m.proving = false;
        }
        active_ = members_.size();
    }

    DeviceCounters counters() const noexcept override {
        DeviceCounters sum;
        for (const auto& m : members_) {
            const DeviceCounters c = m.device->counters();
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
        bool open = false;
        Instant try_at;        // when an open() may be tried again
        Instant valid_since;   // of the unbroken run of valid samples, while proving
        Instant last_seen;
        bool proving = false;
    };

    Result<void> open_best() {
        std::string tried;
        for (std::size_t i = 0; i < members_.size(); ++i) {
            auto opened = members_[i].device->open();
            if (opened) {
                members_[i].open = true;
                active_ = i;
                return {};
            }
            members_[i].try_at = time_.now() + settings_.retry;
            tried += (i == 0 ? "" : "; ") + opened.error().message();
        }
        return fail("no tracker can be opened: " + tried);
    }

    // Opens what is better than the active device and due, and looks at what it says. `scratch` is overwritten.
    bool watch_better(Instant now, GazeSample& scratch) noexcept {
        bool watching = false;
        for (std::size_t i = 0; i < active_; ++i) {
            Member& m = members_[i];
            if (!m.open) {
                if (now < m.try_at) continue;
                m.try_at = now + settings_.retry;
                m.open = try_open(m);
                m.proving = false;
                m.last_seen = now;
                if (!m.open) continue;
            }
            watching = true;
            for (;;) {   // all that is waiting: its newest sample counts
                const PollStatus status = m.device->poll(scratch, now);
                if (status == PollStatus::lost || status == PollStatus::ended) {
                    m.device->close();
                    m.open = m.proving = false;
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
            if (i != index && members_[i].open) {
                members_[i].device->close();
                members_[i].open = false;
                members_[i].try_at = time_.now() + settings_.retry;
            }
        active_ = index;
        ++switches_;
    }

    bool fall_back() noexcept {
        for (std::size_t i = 0; i < members_.size(); ++i) {
            if (i == active_) continue;
            if (!members_[i].open) members_[i].open = try_open(members_[i]);
            if (members_[i].open) {
                change_to(i);
                return true;
            }
        }
        active_ = members_.size();
        return false;
    }

    PrioritySettings settings_;
    const TimeSource& time_;
    std::vector<Member> members_;
    std::size_t active_ = static_cast<std::size_t>(-1);
    std::uint64_t next_id_ = 1, switches_ = 0;
    std::atomic<bool> woken_{false};
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
