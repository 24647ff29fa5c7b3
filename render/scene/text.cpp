// The scene `text`: pages set with FreeType in sizes from a headline to a footnote, hung in the hall.
#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include <ft2build.h>
#include FT_FREETYPE_H

#include "render/scene/generators.hpp"
#include "render/scene/model_builder.hpp"

namespace fovea::scene {
namespace {

constexpr const char* kFont = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
constexpr int kPageWidth_px = 1434, kPageHeight_px = 2048, kMargin_px = 90;
constexpr float kPageWidth_m = 0.7f, kPageHeight_m = 1.0f;
constexpr std::array<std::uint8_t, 3> kPaper{236, 231, 219}, kInk{24, 22, 26};

constexpr std::string_view kProse[] = {
    "The eye does not see a picture. It looks at one spot after another, three or four of them in a second, and what lies "
    "between is filled in by the mind that asked for it.",
    "Sharp sight ends two degrees from where the gaze rests: the width of a thumb at arm's length. Ten degrees out, letters "
    "must be five times as large to be read.",
    "Between two rests the eye jumps. A jump over twenty degrees takes less than a tenth of a second, and while it lasts "
    "nothing new is seen; only where it will end is worth knowing early.",
    "A steady gaze is never still. It drifts by a few minutes of arc, trembles ninety times a second, and corrects itself "
    "with jumps too small for their owner to notice.",
    "So a picture need not be fine everywhere at once. It must be fine where the next glance lands, at the moment the light "
    "arrives, and there it must hide that it was ever anything else.",
};

class Page {
public:
    explicit Page(FT_Face face) : face_(face) {
        image_.width = kPageWidth_px;
        image_.height = kPageHeight_px;
        image_.rgba.resize(std::size_t{kPageWidth_px} * kPageHeight_px * 4);
        for (std::size_t i = 0; i < image_.rgba.size(); i += 4) {
            std::copy(kPaper.begin(), kPaper.end(), image_.rgba.begin() + static_cast<std::ptrdiff_t>(i));
            image_.rgba[i + 3] = 255;
        }
    }
    [[nodiscard]] bool full(int size_px) const noexcept { return y_ + size_px * 3 / 2 > kPageHeight_px - kMargin_px; }

    // One paragraph, broken at blanks; stops at the foot of the page.
    void set(std::string_view words, int size_px) {
        FT_Set_Pixel_Sizes(face_, 0, static_cast<FT_UInt>(size_px));
        int x = kMargin_px;
        y_ += size_px;
        while (!words.empty() && !full(0)) {
            const std::size_t end = std::min(words.find(' '), words.size());
            const std::string_view word = words.substr(0, end);
            words.remove_prefix(std::min(end + 1, words.size()));
            if (x > kMargin_px && x + width(word) > kPageWidth_px - kMargin_px) {
                x = kMargin_px;
                y_ += size_px * 5 / 4;
            }
            for (const char c : word) x += put(c, x);
            x += width(" ");
        }
        y_ += size_px / 2;
    }
    [[nodiscard]] Image take() { return std::move(image_); }

private:
    [[nodiscard]] int width(std::string_view word) const {
        int sum = 0;
        for (const char c : word)
            if (FT_Load_Char(face_, static_cast<FT_ULong>(c), FT_LOAD_DEFAULT) == 0) sum += static_cast<int>(face_->glyph->advance.x >> 6);
        return sum;
    }
    int put(char c, int x) {
        if (FT_Load_Char(face_, static_cast<FT_ULong>(c), FT_LOAD_RENDER) != 0) return 0;
        const FT_GlyphSlot g = face_->glyph;
        for (int j = 0; j < static_cast<int>(g->bitmap.rows); ++j)
            for (int i = 0; i < static_cast<int>(g->bitmap.width); ++i) {
                const int px = x + g->bitmap_left + i, py = y_ - g->bitmap_top + j;
                if (px < 0 || py < 0 || px >= kPageWidth_px || py >= kPageHeight_px) continue;
                const int ink = g->bitmap.buffer[j * g->bitmap.pitch + i];
                std::uint8_t* to = &image_.rgba[(static_cast<std::size_t>(py) * kPageWidth_px + static_cast<std::size_t>(px)) * 4];
                for (std::size_t k = 0; k < 3; ++k) to[k] = static_cast<std::uint8_t>((to[k] * (255 - ink) + kInk[k] * ink) / 255);
            }
        return static_cast<int>(g->advance.x >> 6);
    }
    FT_Face face_;
    Image image_;
    int y_ = kMargin_px;
};

// Headline, body that shrinks from paragraph to paragraph, until the page is full.
Image page(FT_Face face, int number) {
    Page p(face);
    constexpr std::string_view kTitles[] = {"Where the eye rests", "Where it jumps", "What it misses"};
    constexpr int kLargest[] = {48, 36, 28}, kSmallest[] = {24, 17, 12};
    p.set(kTitles[number], 84);
    int size = kLargest[number];
    for (std::size_t i = static_cast<std::size_t>(number); !p.full(size); ++i) {
        p.set(kProse[i % std::size(kProse)], size);
        size = std::max(kSmallest[number], size - 3);
    }
    return p.take();
}

}  // namespace

Result<Model> text_model() {
    FT_Library library = nullptr;
    if (FT_Init_FreeType(&library) != 0) return fail("FreeType does not start", "scene text");
    FT_Face face = nullptr;
    if (FT_New_Face(library, kFont, 0, &face) != 0) {
        FT_Done_FreeType(library);
        return fail("no font for the scene 'text'", kFont, "apt install fonts-dejavu-core");
    }
    ModelBuilder b;
    for (int i = 0; i < 3; ++i) {
        b.material({.base_color = {0.75f, 0.75f, 0.75f, 1}, .roughness = 0.9f, .color_image = b.image(page(face, i)), .repeat = false});
        const float w = kPageWidth_m / 2, h = kPageHeight_m / 2;
        b.quad({-w, -h, 0}, {w, -h, 0}, {w, h, 0}, {-w, h, 0});
        const int mesh = b.end_mesh();
        const double turn = 0.45 * (1 - i);   // left, middle, right, facing the reader
        b.node(mesh, {.translation = {(i - 1) * 0.78, 1.5, -0.2 + (i == 1 ? 0.0 : 0.17)}, .rotation = {0, std::sin(turn / 2), 0, std::cos(turn / 2)}});
    }
    FT_Done_Face(face);
    FT_Done_FreeType(library);
    return b.take();
}

}  // namespace fovea::scene
