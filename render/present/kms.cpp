#include "render/present/kms.hpp"

#include <fcntl.h>
#include <gbm.h>
#include <poll.h>
#include <xf86drm.h>
#include <xf86drmMode.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

#include "protocol/unique_fd.hpp"
#include "render/present/vblank_clock.hpp"

namespace fovea::present {
namespace {

constexpr std::size_t kKnown = 64;
constexpr int kCards = 16;
constexpr const char* kWhere = "KMS";
constexpr const char* kElsewhere = "run it from a text console where no window system holds the screen, as a user of the group video, or choose another display with --present";

template <class T, void (*Free)(T*)>
struct Delete {
    void operator()(T* p) const noexcept { Free(p); }
};
using Resources = std::unique_ptr<drmModeRes, Delete<drmModeRes, drmModeFreeResources>>;
using Connector = std::unique_ptr<drmModeConnector, Delete<drmModeConnector, drmModeFreeConnector>>;
using Encoder = std::unique_ptr<drmModeEncoder, Delete<drmModeEncoder, drmModeFreeEncoder>>;
using Crtc = std::unique_ptr<drmModeCrtc, Delete<drmModeCrtc, drmModeFreeCrtc>>;

class Kms final : public Presenter {
public:
    explicit Kms(const TimeSource& time) : time_(time) { known_.reserve(kKnown), handed_.reserve(kKnown); }
    ~Kms() override {
        if (flipping_) static_cast<void>(wait_for_event(std::chrono::milliseconds(200)));   // its buffer is in use until then
        surface_gl_ = {};
        context_.reset();
        if (before_ && crtc_ != 0)
            drmModeSetCrtc(card_.get(), crtc_, before_->buffer_id, before_->x, before_->y, &connector_, before_->mode_valid != 0 ? 1 : 0, &before_->mode);
        if (surface_ != nullptr) {
            if (shown_ != nullptr) gbm_surface_release_buffer(surface_, shown_);
            if (next_ != nullptr) gbm_surface_release_buffer(surface_, next_);
            gbm_surface_destroy(surface_);
        }
        if (device_ != nullptr) gbm_device_destroy(device_);
    }
    Kms(const Kms&) = delete;
    Kms& operator=(const Kms&) = delete;

    Result<void> open() {
        if (auto r = find_screen(); !r) return r;
        std::uint64_t monotonic = 0;
        monotonic_ = drmGetCap(card_.get(), DRM_CAP_TIMESTAMP_MONOTONIC, &monotonic) == 0 && monotonic != 0;
        const double lines = mode_.vtotal, columns = mode_.htotal;
        if (mode_.clock > 0 && lines > 0 && columns > 0) {
            clock_.set_period(seconds(columns * lines / (mode_.clock * 1e3)));
            scanout_ = seconds(to_seconds(clock_.period()) * mode_.vdisplay / lines);
        }
        device_ = gbm_create_device(card_.get());
        if (device_ == nullptr) return fail("no buffers can be had for this card (GBM)", path_, "install a driver: apt-get install libgbm1 libgl1-mesa-dri");
        auto context = gl::Context::create({gl::Platform::gbm, device_});
        if (!context) return std::unexpected(context.error());
        context_.emplace(*std::move(context));
        surface_ = gbm_surface_create(device_, mode_.hdisplay, mode_.vdisplay, GBM_FORMAT_XRGB8888, GBM_BO_USE_SCANOUT | GBM_BO_USE_RENDERING);
        if (surface_ == nullptr) return fail_errno("no buffers of this screen's size can be had", errno, path_, kElsewhere);
        auto surface = gl::WindowSurface::create(*context_, surface_, GBM_FORMAT_XRGB8888);
        if (!surface) return std::unexpected(surface.error());
        surface_gl_ = *std::move(surface);
        return {};
    }

    [[nodiscard]] std::string_view name() const noexcept override { return "kms"; }
    [[nodiscard]] std::string description() const override {
        std::array<char, 128> text{};
        std::snprintf(text.data(), text.size(), "screen of %s, %d x %d pixels, %.4g Hz, page flips", path_.c_str(), mode_.hdisplay, mode_.vdisplay, 1 / to_seconds(clock_.period()));
        return text.data();
    }
    [[nodiscard]] const gl::Context& context() const noexcept override { return *context_; }
    [[nodiscard]] Duration refresh_period() const noexcept override { return clock_.period(); }
    [[nodiscard]] Surface surface() const noexcept override { return {0, mode_.hdisplay, mode_.vdisplay, std::max(1.0, mode_.vdisplay / 1080.0)}; }

    [[nodiscard]] Result<bool> begin_frame(Duration cost, Duration patience) override {
        const Instant until = time_.now() + patience;
        for (;;) {
            const Instant now = time_.now(), begin = flipping_ ? until : clock_.begin_no_sooner(cost);
            if (!flipping_ && begin <= now) return true;
            if (now >= until) return false;
            if (auto r = wait_for_event(std::min(begin, until) - now); !r) return std::unexpected(r.error());
        }
    }
    [[nodiscard]] Instant photon_of(Instant gpu_done) const noexcept override { return clock_.predict(gpu_done) + scanout_ / 2; }

    [[nodiscard]] Result<void> present(std::uint64_t frame, Instant gpu_done) override {
        while (flipping_)
            if (auto r = wait_for_event(std::chrono::seconds(1)); !r) return r;
        if (!surface_gl_.swap()) return taken_away(errno);
        next_ = gbm_surface_lock_front_buffer(surface_);
        if (next_ == nullptr) return fail("the drawn buffer cannot be had", path_, kElsewhere);
        const auto id = framebuffer_of(next_);
        if (!id) return std::unexpected(id.error());
        if (!started_) {
            before_.reset(drmModeGetCrtc(card_.get(), crtc_));
            if (drmModeSetCrtc(card_.get(), crtc_, *id, 0, 0, &connector_, 1, &mode_) != 0) return taken_away(errno);
            started_ = true;
        }
        frame_ = frame;
        done_ = gpu_done;
        if (drmModePageFlip(card_.get(), crtc_, *id, DRM_MODE_PAGE_FLIP_EVENT, this) != 0) return taken_away(errno);
        flipping_ = true;
        return {};
    }

    [[nodiscard]] Result<std::span<const Feedback>> collect() override {
        if (auto r = wait_for_event(Duration{0}); !r) return std::unexpected(r.error());
        handed_.swap(known_);
        known_.clear();
        return std::span<const Feedback>(handed_);
    }

private:
    [[nodiscard]] std::unexpected<Error> taken_away(int code) const { return fail_errno("the screen cannot be used, or has been taken away", code, path_, kElsewhere); }

    Result<void> find_screen() {
        const char* named = std::getenv("FOVEA_KMS_CARD");
        std::string found_at;
        for (int i = 0; i < (named != nullptr ? 1 : kCards); ++i) {
            path_ = named != nullptr ? named : "/dev/dri/card" + std::to_string(i);
            card_ = UniqueFd(::open(path_.c_str(), O_RDWR | O_CLOEXEC));
            if (card_.get() < 0) {
                if (errno != ENOENT || named != nullptr) return fail_errno("the card cannot be opened", errno, path_, kElsewhere);
                continue;
            }
            const Resources all(drmModeGetResources(card_.get()));
            if (all == nullptr) continue;   // a card that only computes
            found_at += (found_at.empty() ? "" : ", ") + path_;
            for (int k = 0; k < all->count_connectors; ++k) {
                const Connector c(drmModeGetConnector(card_.get(), all->connectors[k]));
                if (c == nullptr || c->connection != DRM_MODE_CONNECTED || c->count_modes == 0 || !choose_crtc(*all, *c)) continue;
                connector_ = c->connector_id;
                mode_ = c->modes[0];
                for (int m = 0; m < c->count_modes; ++m)
                    if ((c->modes[m].type & DRM_MODE_TYPE_PREFERRED) != 0) {
                        mode_ = c->modes[m];
                        break;
                    }
                return named_mode(*c);
            }
        }
        if (found_at.empty()) return fail("there is no card with screens", "/dev/dri", "choose another display with --present");
        return fail("no screen is connected", found_at, "connect one, or choose another display with --present");
    }

    // $FOVEA_KMS_MODE, e.g. 640x480.
    Result<void> named_mode(const drmModeConnector& c) {
        const char* wanted = std::getenv("FOVEA_KMS_MODE");
        if (wanted == nullptr || *wanted == 0) return {};
        std::string known;
        for (int m = 0; m < c.count_modes; ++m) {
            const std::string size = std::to_string(c.modes[m].hdisplay) + "x" + std::to_string(c.modes[m].vdisplay);
            if (size == wanted) {
                mode_ = c.modes[m];
                return {};
            }
            if (known.find(size) == std::string::npos) known += (known.empty() ? "" : ", ") + size;
        }
        return fail("the screen has no mode " + std::string(wanted), "FOVEA_KMS_MODE", "modes: " + known);
    }

    bool choose_crtc(const drmModeRes& all, const drmModeConnector& c) {
        if (const Encoder e(drmModeGetEncoder(card_.get(), c.encoder_id)); e != nullptr && e->crtc_id != 0) {
            crtc_ = e->crtc_id;
            return true;
        }
        for (int k = 0; k < c.count_encoders; ++k) {
            const Encoder e(drmModeGetEncoder(card_.get(), c.encoders[k]));
            for (int i = 0; e != nullptr && i < all.count_crtcs; ++i)
                if ((e->possible_crtcs & (1u << i)) != 0) {
                    crtc_ = all.crtcs[i];
                    return true;
                }
        }
        return false;
    }

    // Made once for each of the surface's few buffers; goes with the buffer.
    struct Framebuffer {
        int card = -1;
        std::uint32_t id = 0;
    };
    Result<std::uint32_t> framebuffer_of(gbm_bo* buffer) {
        if (const auto* known = static_cast<const Framebuffer*>(gbm_bo_get_user_data(buffer))) return known->id;
        auto made = std::make_unique<Framebuffer>(card_.get(), 0u);
        const std::array<std::uint32_t, 4> handles{gbm_bo_get_handle(buffer).u32}, strides{gbm_bo_get_stride(buffer)}, offsets{};
        if (drmModeAddFB2(card_.get(), gbm_bo_get_width(buffer), gbm_bo_get_height(buffer), GBM_FORMAT_XRGB8888, handles.data(), strides.data(), offsets.data(), &made->id, 0) != 0)
            return taken_away(errno);
        gbm_bo_set_user_data(buffer, made.get(), [](gbm_bo*, void* data) {
            const std::unique_ptr<Framebuffer> gone(static_cast<Framebuffer*>(data));
            drmModeRmFB(gone->card, gone->id);
        });
        return made.release()->id;
    }

    // Handles flips that have happened, waiting at most so long for one.
    [[nodiscard]] Result<void> wait_for_event(Duration wait) {
        pollfd fd{card_.get(), POLLIN, 0};
        const timespec timeout{std::max<std::int64_t>(wait.count(), 0) / 1'000'000'000, static_cast<long>(std::max<std::int64_t>(wait.count(), 0) % 1'000'000'000)};
        const int ready = ppoll(&fd, 1, &timeout, nullptr);
        if (ready <= 0) return {};   // nothing yet, or a signal
        drmEventContext context{};
        context.version = 3;
        context.page_flip_handler2 = [](int, unsigned sequence, unsigned s, unsigned us, unsigned, void* data) { static_cast<Kms*>(data)->flipped(sequence, s, us); };
        if ((fd.revents & POLLIN) == 0 || drmHandleEvent(card_.get(), &context) != 0) return taken_away(errno);
        return {};
    }

    void flipped(unsigned sequence, unsigned s, unsigned us) {
        flipping_ = false;
        if (shown_ != nullptr) gbm_surface_release_buffer(surface_, shown_);
        shown_ = std::exchange(next_, nullptr);
        const bool measured = monotonic_ && sequence != 0;
        const Instant start = measured ? instant_from_ns(std::int64_t{s} * 1'000'000'000 + std::int64_t{us} * 1000) : time_.now();
        clock_.observe(done_, start, measured);
        if (known_.size() < kKnown) known_.push_back({frame_, true, start + scanout_ / 2, measured ? PhotonSource::measured : PhotonSource::estimated});
    }

    const TimeSource& time_;
    UniqueFd card_;
    std::string path_;
    std::uint32_t connector_ = 0, crtc_ = 0;
    drmModeModeInfo mode_{};
    Crtc before_;
    bool monotonic_ = false, started_ = false;
    gbm_device* device_ = nullptr;
    gbm_surface* surface_ = nullptr;
    gbm_bo *shown_ = nullptr, *next_ = nullptr;
    std::optional<gl::Context> context_;
    gl::WindowSurface surface_gl_;
    VblankClock clock_{std::chrono::nanoseconds(16'666'667)};
    Duration scanout_{std::chrono::nanoseconds(16'000'000)};
    bool flipping_ = false;
    std::uint64_t frame_ = 0;
    Instant done_;
    std::vector<Feedback> known_, handed_;
};

}  // namespace

bool kms_offered() { return false; }

Result<std::unique_ptr<Presenter>> create_kms(const PresenterSettings&, const TimeSource& time) {
    auto made = std::make_unique<Kms>(time);
    if (auto r = made->open(); !r) return std::unexpected(r.error());
    return made;
}

}  // namespace fovea::present
