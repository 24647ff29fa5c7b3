#include "render/foveation/native_rates.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <limits>
#include <string>

#include "render/foveation/bin_resolve.hpp"
#include "render/foveation/driver_traits.hpp"
#include "render/foveation/full.hpp"
#include "render/gl/context.hpp"

namespace fovea::foveation {
namespace {

// Newer than the headers that come with libepoxy 1.5.
constexpr GLenum kRateAttachment = 0x96D1, kCombinerKeep = 0x96D2, kCombinerReplace = 0x96D3;   // GL_..._EXT
constexpr GLenum kRate1x1 = 0x96A6, kRate2x2 = 0x96A9, kRate4x4 = 0x96AE;                       // GL_SHADING_RATE_..._PIXELS_{EXT,QCOM}
constexpr std::array kRates{kRate1x1, kRate2x2, kRate4x4};                                       // by level of the plan

}  // namespace

Result<std::unique_ptr<Method>> NativeRates::create(const MethodSettings& settings, const NativeCalls& calls) {
    FOVEA_REQUIRE(calls.rate_attachment || calls.rate_per_draw);
    std::unique_ptr<NativeRates> m(new NativeRates(settings, calls));
    int& tile = m->settings_.shading_rate.tile_px;
    if (calls.rate_attachment) tile = std::clamp(tile, calls.least_texel_px, calls.most_texel_px);   // the device's
    auto mask = gl::build_program("rate mask", kRectVertex, "#version 310 es\nprecision mediump float;\nvoid main() {}\n");
    if (!mask) return std::unexpected(mask.error());
    m->mask_ = *std::move(mask);
    return std::unique_ptr<Method>(std::move(m));
}

NativeRates::~NativeRates() { detach(); }

void NativeRates::detach() noexcept {
    for (const Attachment& a : attachments_) {
        if (glIsFramebuffer(a.framebuffer) == GL_FALSE) continue;
        glBindFramebuffer(GL_FRAMEBUFFER, a.framebuffer);
        calls_.attach_rates(GL_FRAMEBUFFER, kRateAttachment, 0, 0, 0, 0, 0);
    }
    attachments_.clear();
}

Result<void> NativeRates::make_attachment(View& v, const ViewTarget& t, const gl::FramebufferShape& shape) {
    const int tile = settings_.shading_rate.tile_px;
    const std::string where = "framebuffer " + std::to_string(t.framebuffer);
    if (t.framebuffer == 0 || shape.width_px == 0) return fail("a surface has no shading-rate attachment", where, "draw into a framebuffer object, or set `emulate`");
    if (t.x_px % tile != 0 || t.y_px % tile != 0)
        return fail("a view that does not begin on a tile of " + std::to_string(tile) + " pixels", where, "place it at a multiple of that, or set `emulate`");
    const auto known = std::ranges::find(attachments_, t.framebuffer, &Attachment::framebuffer);
    v.attachment = static_cast<std::size_t>(known - attachments_.begin());
    if (known != attachments_.end()) return {};
    static_cast<void>(gl::pending_error());
    gl::Name name = 0;
    glGenTextures(1, &name);
    attachments_.push_back({t.framebuffer, gl::Texture(name)});
    glBindTexture(GL_TEXTURE_2D, name);
    glTexStorage2D(GL_TEXTURE_2D, 1, GL_R8UI, (shape.width_px + tile - 1) / tile, (shape.height_px + tile - 1) / tile);
    glBindTexture(GL_TEXTURE_2D, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, t.framebuffer);
    calls_.attach_rates(GL_FRAMEBUFFER, kRateAttachment, name, 0, 1, tile, tile);
    const std::string error = gl::pending_error();
    if (error.empty() && glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return {};
    return fail("the driver refuses the shading-rate attachment" + (error.empty() ? std::string() : " (" + error + ")"), where, "set `emulate` to apply the rates by passes");
}

Result<void> NativeRates::make_mask(View& v, const ViewTarget& t, const gl::FramebufferShape& shape) {
    if (!shape.stencil) return fail("the framebuffer has no stencil", "framebuffer " + std::to_string(t.framebuffer), "attach GL_DEPTH24_STENCIL8: the rates are masked by it");
    density::PlanSettings s = settings_.plan;
    s.width_px = t.width_px;
    s.height_px = t.height_px;
    s.bin_px = settings_.shading_rate.tile_px;
    s.levels = density::standard_levels();
    s.level_count = static_cast<int>(kRates.size());
    auto plan = density::Plan::create(s);
    if (!plan) return std::unexpected(plan.error());
    v.tiles = *std::move(plan);
    const auto bins = static_cast<std::size_t>(v.tiles->columns()) * static_cast<std::size_t>(v.tiles->rows());
    staging_.resize(std::max(staging_.size(), bins));
    v.rectangles = gl::create_dynamic_buffer(bins * sizeof(std::array<float, 4>));
    v.arrays = gl::create_vertex_array();
    glBindVertexArray(v.arrays.name());
    glBindBuffer(GL_ARRAY_BUFFER, v.rectangles.name());
    glEnableVertexAttribArray(0);
    glVertexAttribDivisor(0, 1);
    glVertexAttribPointer(0, 4, GL_FLOAT, GL_FALSE, 0, nullptr);
    return {};
}

Result<void> NativeRates::make_views(std::span<const ViewTarget> targets) {
    views_.clear();
    detach();
    for (std::size_t i = 0; i < targets.size(); ++i) {
        const ViewTarget& t = targets[i];
        View v;
        const density::RateInput size = density::rate_input(settings_.shading_rate, t.width_px, t.height_px, {0, 0});
        const auto tiles = static_cast<std::size_t>(size.columns()) * static_cast<std::size_t>(size.rows());
        v.rates.resize(tiles);
        // Only an attachment takes the map from the shader without the processor.
        const RateMaker maker = settings_.rate_maker;
        if (maker == RateMaker::gpu || (maker == RateMaker::automatic && driver_traits().gpu_rate_map)) {
            auto map = RateMap::create(tiles);
            if (!map) return std::unexpected(map.error());
            v.map.emplace(*std::move(map));
        }
        auto made = calls_.rate_attachment ? make_attachment(v, t, prepared_.shape(i)) : make_mask(v, t, prepared_.shape(i));
        if (!made) return made;
        views_.push_back(std::move(v));
    }
    return {};
}

Result<void> NativeRates::prepare(std::span<const ViewTarget> targets) {
    const auto same = prepared_.same(targets);
    if (!same) return std::unexpected(same.error());
    return *same ? Result<void>{} : prepared_.settle(make_views(targets));
}

void NativeRates::make_map(View& v, const ViewTarget& t, const ViewFocus& focus) noexcept {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    const density::FocalPoint* p = focus.count > 0 ? &focus.points[0] : nullptr;
    const density::RateInput input = density::rate_input(settings_.shading_rate, t.width_px, t.height_px, p != nullptr ? NdcPoint{p->x_ndc, p->y_ndc} : NdcPoint{kNone, kNone});
    if (input == v.input) return;
    v.input = input;
    const int columns = input.columns(), rows = input.rows();
    const bool straight = calls_.rate_attachment && v.map;   // from the shader's buffer into the attachment
    if (v.map) {
        v.map->set_input(input);
        v.map->dispatch(columns, rows);
        if (!straight) v.map->read(columns, rows, v.rates);
    } else {
        density::fill_rate_map(input, v.rates);
    }
    if (calls_.rate_attachment) {
        glBindTexture(GL_TEXTURE_2D, attachments_[v.attachment].rates.name());
        glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
        glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
        if (straight) v.map->bind_for_unpacking();
        else glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
        glTexSubImage2D(GL_TEXTURE_2D, 0, t.x_px / input.tile, t.y_px / input.tile, columns, rows, GL_RED_INTEGER, GL_UNSIGNED_BYTE,
                        straight ? nullptr : v.rates.data());
        glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
        glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
        glBindTexture(GL_TEXTURE_2D, 0);
    } else {
        for (std::uint8_t& r : v.rates) r &= 3;   // 0x0, 0x5, 0xa: level 0, 1, 2
        v.tiles->assign_levels(v.rates);
        std::size_t n = 0;
        const float w = 2.0f / static_cast<float>(t.width_px), h = 2.0f / static_cast<float>(t.height_px);
        for (int level = 0; level < v.tiles->settings().level_count; ++level)
            for (const density::BinRect& r : v.tiles->rectangles(level)) {
                const density::PixelRect q = v.tiles->pixels(r);
                staging_[n++] = {static_cast<float>(q.x0) * w - 1, static_cast<float>(q.y0) * h - 1, static_cast<float>(q.x1) * w - 1, static_cast<float>(q.y1) * h - 1};
            }
        gl::update_buffer(v.rectangles, 0, std::as_bytes(std::span(staging_).first(n)));
    }
    v.pixels = 0;
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c) {
            const int across = std::min(input.tile, t.width_px - c * input.tile), up = std::min(input.tile, t.height_px - r * input.tile);
            const int shift = static_cast<int>(density::tile_rate(input, c, r)) & 3;
            v.pixels += static_cast<std::uint64_t>((across + (1 << shift) - 1) >> shift) * static_cast<std::uint64_t>((up + (1 << shift) - 1) >> shift);
        }
    v.region = {};
    if ((input.flags & density::kRateGaze) != 0)
        v.region = {p->x_ndc, p->y_ndc, 2.0 * input.inner / t.width_px, 2.0 * input.inner / t.height_px};
}

void NativeRates::draw_by_attachment(const View& v, std::uint32_t index, const ViewTarget& t, const gl::FramebufferShape& shape, const gl::CommandList& draws, FrameCost& cost) noexcept {
    FrameCost one;
    calls_.rate(kRate1x1);
    calls_.rate_combiners(kCombinerKeep, kCombinerReplace);   // the attachment's rate is the one that counts
    submit_full_view(draws, index, t, counter_.enabled(), one, &shape);
    calls_.rate_combiners(kCombinerKeep, kCombinerKeep);
    cost.draws += one.draws;
    cost.submissions += one.submissions;
    cost.pixels_full += one.pixels_full;
    cost.pixels_shaded += v.pixels;
}

void NativeRates::draw_by_rates(View& v, std::uint32_t index, const ViewTarget& t, const gl::FramebufferShape& shape, const gl::CommandList& draws, FrameCost& cost) noexcept {
    glBindFramebuffer(GL_FRAMEBUFFER, t.framebuffer);
    glViewport(t.x_px, t.y_px, t.width_px, t.height_px);
    glEnable(GL_SCISSOR_TEST);
    glScissor(t.x_px, t.y_px, t.width_px, t.height_px);
    clear_bound(draws.clear(), &shape, true, true);
    // The stencil holds the level of every tile.
    glUseProgram(mask_.name());
    glUniform1f(1, 0.5f);
    glBindVertexArray(v.arrays.name());
    glBindBuffer(GL_ARRAY_BUFFER, v.rectangles.name());
    glDisable(GL_CULL_FACE);
    glDisable(GL_DEPTH_TEST);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    glEnable(GL_STENCIL_TEST);
    glStencilOp(GL_REPLACE, GL_REPLACE, GL_REPLACE);
    std::size_t first = v.tiles->rectangles(0).size();   // those of level 0 keep the cleared 0
    const int levels = v.tiles->settings().level_count;
    for (int level = 1; level < levels; ++level) {
        const std::size_t count = v.tiles->rectangles(level).size();
        glStencilFunc(GL_ALWAYS, level, 0xff);
        if (count > 0) {
            glVertexAttribPointer(0, 4, GL_FLOAT, GL_FALSE, 0, reinterpret_cast<const void*>(first * sizeof(std::array<float, 4>)));
            glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(count));
        }
        first += count;
    }
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
    for (int level = levels - 1; level >= 0; --level) {
        if (!v.tiles->uses(level)) continue;
        const density::PixelRect box = v.tiles->pixels(v.tiles->bounds(level));
        glScissor(t.x_px + box.x0, t.y_px + box.y0, box.x1 - box.x0, box.y1 - box.y0);
        glStencilFunc(GL_EQUAL, level, 0xff);
        calls_.rate(kRates[static_cast<std::size_t>(level)]);
        cost.draws += static_cast<std::uint32_t>(draws.submit({.view = index, .count_fragments = counter_.enabled()}));
        ++cost.submissions;
    }
    calls_.rate(kRate1x1);
    glDisable(GL_STENCIL_TEST);
    cost.pixels_full += static_cast<std::uint64_t>(t.width_px) * static_cast<std::uint64_t>(t.height_px);
    cost.pixels_shaded += v.pixels;
}

FrameCost NativeRates::submit(const gl::CommandList& draws, std::span<const ViewTarget> targets, std::span<const ViewFocus> focus) noexcept {
    FOVEA_REQUIRE(focus.size() >= targets.size());
    FrameCost cost;
    counter_.begin();
    const bool ready = prepared_.ready(targets);
    for (std::size_t i = 0; i < targets.size(); ++i) {
        const auto index = static_cast<std::uint32_t>(i);
        if (!ready || draws.empty()) {
            submit_full_view(draws, index, targets[i], counter_.enabled(), cost, ready ? &prepared_.shape(i) : nullptr);
            if (ready || draws.empty()) continue;
            cost.fell_back = true;
            cost.note = prepared_.note();
            continue;
        }
        make_map(views_[i], targets[i], focus[i]);
        if (calls_.rate_attachment) draw_by_attachment(views_[i], index, targets[i], prepared_.shape(i), draws, cost);
        else draw_by_rates(views_[i], index, targets[i], prepared_.shape(i), draws, cost);
    }
    return cost;
}

}  // namespace fovea::foveation
