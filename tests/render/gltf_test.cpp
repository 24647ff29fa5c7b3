// A user's own scene: what is read from it, and what a broken or hostile file does (an error that helps, within bounds).
#include "render/scene/gltf.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "render/scene/source.hpp"
#include "tests/allocation/allocation_count.hpp"

using namespace fovea;
using nlohmann::json;

namespace {

const std::filesystem::path kFolder = FOVEA_SOURCE_DIR "/configs/scenes";

std::string sample_text() {
    std::ifstream in(kFolder / "lantern.gltf");
    return {std::istreambuf_iterator<char>(in), {}};
}

Result<scene::Model> read(const std::string& bytes, const scene::GltfLimits& limits = scene::kLimits) {
    return scene::read_gltf({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, kFolder, "a.gltf", limits);
}
Result<scene::Model> read(const json& j) { return read(j.dump()); }

void put(std::string& s, std::uint32_t word) { s.append(reinterpret_cast<const char*>(&word), 4); }

// The sample as a .glb, its buffer in the binary chunk.
std::string sample_glb() {
    json j = json::parse(sample_text());
    const std::string uri = j["buffers"][0]["uri"];
    const std::string coded = uri.substr(uri.find(',') + 1);
    std::string data;
    unsigned bits = 0;
    int have = 0;
    for (const char c : coded) {
        static const std::string kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        const auto at = kAlphabet.find(c);
        if (at == kAlphabet.npos) break;
        bits = bits << 6 | static_cast<unsigned>(at);
        if ((have += 6) >= 8) data.push_back(static_cast<char>(bits >> (have -= 8) & 255u));
    }
    j["buffers"][0].erase("uri");
    std::string text = j.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    data.resize((data.size() + 3) / 4 * 4);
    std::string glb = "glTF";
    put(glb, 2);
    put(glb, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + data.size()));
    put(glb, static_cast<std::uint32_t>(text.size()));
    put(glb, 0x4e4f534a);
    glb += text;
    put(glb, static_cast<std::uint32_t>(data.size()));
    put(glb, 0x004e4942);
    return glb + data;
}

void expect_error(const Result<scene::Model>& r, const std::string& what, const std::string& way_out = "") {
    ASSERT_FALSE(r.has_value()) << "wanted: " << what;
    EXPECT_NE(r.error().what.find(what), std::string::npos) << r.error().message();
    EXPECT_NE(r.error().where.find("a.gltf"), std::string::npos) << r.error().message();
    EXPECT_NE(r.error().way_out.find(way_out), std::string::npos) << r.error().message();
    EXPECT_FALSE(r.error().way_out.empty()) << r.error().message();
}

TEST(Gltf, ReadsTheSample) {
    const auto m = scene::load_gltf(kFolder / "lantern.gltf");
    ASSERT_TRUE(m.has_value()) << m.error().message();
    EXPECT_EQ(m->indices.size() / 3, 12u + 48 + 12 + 2 + 2) << "indexed by 8 and 16 bits, a strip without indices, a fan";
    EXPECT_EQ(m->nodes.size(), 6u);
    EXPECT_EQ(m->materials.size(), 5u) << "the file's and the default";
    ASSERT_EQ(m->images.size(), 2u) << "one in the text, one in the buffer";
    for (const auto& i : m->images) EXPECT_EQ(i.rgba.size(), 32u * 32 * 4);
    EXPECT_TRUE(m->materials[3].blend);
    EXPECT_TRUE(m->materials[1].double_sided);
    EXPECT_EQ(m->materials[0].color_image, 0);
    EXPECT_DOUBLE_EQ(m->duration_s, 4);
    EXPECT_NE(m->declared.find("lens_radius"), std::string::npos);
    // The strip came without normals: flat ones were made, along z.
    const scene::Part& strip = m->parts[1];
    for (std::uint32_t i = strip.first_index; i < strip.first_index + strip.index_count; ++i)
        EXPECT_EQ(std::abs(m->vertices[m->indices[i]].normal[2]), 32767) << i;
}

TEST(Gltf, TextAndBinaryFormGiveTheSameModel) {
    const auto a = read(sample_text()), b = read(sample_glb());
    ASSERT_TRUE(a.has_value() && b.has_value()) << b.error().message();
    EXPECT_EQ(a->indices, b->indices);
    ASSERT_EQ(a->vertices.size(), b->vertices.size());
    EXPECT_EQ(std::memcmp(a->vertices.data(), b->vertices.data(), a->vertices.size() * sizeof(scene::ModelVertex)), 0);
    EXPECT_EQ(a->images[1].rgba, b->images[1].rgba);
}

TEST(Gltf, AnimationMovesItsNodeAndWhatHangsOnIt) {
    const auto m = scene::load_gltf(kFolder / "lantern.gltf");
    const auto moving = scene::moving_nodes(*m);
    EXPECT_EQ(std::count(moving.begin(), moving.end(), true), 3) << "the hook, the lantern and the pane";
    std::vector<scene::Mat4> rest(m->nodes.size()), swung(m->nodes.size()), later(m->nodes.size());
    scene::place_nodes(*m, 0, rest);
    scene::place_nodes(*m, 1, swung);
    scene::place_nodes(*m, 5, later);
    EXPECT_EQ(swung, later) << "it repeats after 4 s";
    for (std::size_t i = 0; i < moving.size(); ++i) EXPECT_EQ(rest[i] != swung[i], moving[i]) << i;
    const auto hook = static_cast<std::size_t>(m->tracks[0].node);
    EXPECT_NEAR(std::atan2(swung[hook][1], swung[hook][0]), 0.35, 1e-6) << "a quarter of the way: the whole swing";
}

TEST(Gltf, SaysWhatIsWrongAndTheWayOut) {
    const json good = json::parse(sample_text());
    json j = good;
    j["buffers"][0]["uri"] = "lost.bin";
    expect_error(read(j), "lost.bin is missing", "folder");
    j = good;
    j["buffers"][0]["uri"] = "../../LICENSE";
    expect_error(read(j), "missing");   // it exists, but is outside the scene's folder
    j = good;
    j["images"][0] = {{"uri", "lost.png"}};
    expect_error(read(j), "cannot be read", "beside");
    j = good;
    j["extensionsRequired"] = {"KHR_draco_mesh_compression"};
    expect_error(read(j), "KHR_draco_mesh_compression", "without mesh compression");
    j["extensionsRequired"] = {"KHR_texture_basisu"};
    expect_error(read(j), "KHR_texture_basisu", "PNG");
    j = good;
    j["asset"]["version"] = "1.0";
    expect_error(read(j), "version 1.0", "2.0");
    j = good;
    j["accessors"][0]["count"] = 25000;
    expect_error(read(j), "accessor 0 reaches beyond");
    j = good;
    j["accessors"][0]["byteOffset"] = 18446744073709551615u;
    expect_error(read(j), "");
    j = good;
    j["accessors"][0].erase("bufferView");
    expect_error(read(j), "no buffer view", "Draco");
    j = good;
    j["accessors"][0]["type"] = "VEC2";
    expect_error(read(j), "wrong type");
    j = good;
    j["meshes"][0]["primitives"][0]["indices"] = 99;
    expect_error(read(j), "out of bounds");
    j = good;
    j["bufferViews"][0]["byteLength"] = 1000000;
    expect_error(read(j), "reaches beyond its buffer");
    j = good;
    j["nodes"][1]["children"] = {1};
    expect_error(read(j), "two parents", "tree");
    j = good;
    j["nodes"][0]["mesh"] = 44;
    expect_error(read(j), "");
    j = good;
    j["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 7;
    expect_error(read(j), "texture 7");
    j = good;
    j["animations"][0]["channels"][0]["sampler"] = 3;
    expect_error(read(j), "sampler");
    j = good;
    j["meshes"] = json::array();
    j.erase("nodes");
    j["scenes"][0]["nodes"] = json::array();
    j.erase("animations");
    expect_error(read(j), "no triangles");
    j = good;
    j["buffers"][0]["byteLength"] = 9e18;
    expect_error(read(j), "claim");
    expect_error(read(std::string("hello")), "no JSON");
    expect_error(read(std::string("{}")), "asset.version");
    const auto nowhere = scene::load_gltf("/nowhere/a.glb");
    ASSERT_FALSE(nowhere.has_value());
    EXPECT_EQ(nowhere.error().where, "/nowhere/a.glb");
}

TEST(Gltf, LimitsHoldBeforeMemoryIsTaken) {
    std::string deep = R"({"asset":{"version":"2.0","extras":)";
    for (int i = 0; i < 200'000; ++i) deep += '[';
    expect_error(read(deep), "nests");
    std::string many = R"({"asset":{"version":"2.0"},"nodes":[)";
    for (int i = 0; i < 300'000; ++i) many += "{},";
    expect_error(read(many + "{}]}"), "objects");
    json j = json::parse(sample_text());
    for (int i = 0; i < 900; ++i) j["nodes"][0]["children"].push_back(j["nodes"].size()), j["nodes"].push_back({{"mesh", 0}});
    scene::GltfLimits few;
    few.draws = 1000;
    expect_error(read(j.dump(), few), "more than 1000 objects", "join");
    few = {};
    few.vertices = 30;
    expect_error(read(sample_text(), few), "elements", "reduce");
    few = {};
    few.pixels = 1500;
    expect_error(read(sample_text(), few), "32x32", "scale it down");
    // A picture that claims to be huge: its header is believed enough to refuse it.
    std::string png("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x27\x10\0\0\x27\x10\x08\x06\0\0\0", 29);
    std::uint32_t crc = 0xffffffffu;   // of type and data
    for (std::size_t i = 12; i < png.size(); ++i) {
        crc ^= static_cast<std::uint8_t>(png[i]);
        for (int k = 0; k < 8; ++k) crc = crc >> 1 ^ (0xedb88320u & (0u - (crc & 1)));
    }
    crc = ~crc;
    for (int shift = 24; shift >= 0; shift -= 8) png.push_back(static_cast<char>(crc >> shift & 255u));
    const auto before = test::allocated_bytes();
    std::string uri = "data:image/png;base64,";
    static const std::string kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (std::size_t i = 0; i + 2 < png.size(); i += 3) {
        const unsigned w = static_cast<std::uint8_t>(png[i]) << 16 | static_cast<std::uint8_t>(png[i + 1]) << 8 | static_cast<std::uint8_t>(png[i + 2]);
        for (int k = 18; k >= 0; k -= 6) uri += kAlphabet[w >> k & 63u];
    }
    j = json::parse(sample_text());
    j["images"][0]["uri"] = uri;
    expect_error(read(j), "10000x10000", "8192");
    EXPECT_LT(test::allocated_bytes() - before, 8u << 20);
}

// Every file that can result from cutting or flipping bytes is a model or an error, within bounds.
class Hostile : public testing::TestWithParam<const char*> {};

TEST_P(Hostile, CutAndFlippedFilesNeitherCrashNorGrow) {
    const std::string whole = std::string(GetParam()) == "text" ? sample_text() : sample_glb();
    ASSERT_TRUE(read(whole).has_value());
    const auto survives = [&](const std::string& bytes, const std::string& how) {
        const auto before = test::allocated_bytes();
        const auto r = read(bytes);
        if (!r) {
            EXPECT_FALSE(r.error().what.empty()) << how;
            EXPECT_FALSE(r.error().way_out.empty()) << how << ": " << r.error().message();
        }
        EXPECT_LT(test::allocated_bytes() - before, 32u << 20) << how;
        return r.has_value();
    };
    for (std::size_t n = 0; n < whole.size(); n += 1 + whole.size() / 150) EXPECT_FALSE(survives(whole.substr(0, n), "cut to " + std::to_string(n)));
    std::mt19937 dice(41);
    int read_all_the_same = 0;
    for (int i = 0; i < 600; ++i) {
        std::string bytes = whole;
        for (unsigned k = 0; k <= dice() % 4; ++k) bytes[dice() % bytes.size()] = static_cast<char>(dice());
        read_all_the_same += survives(bytes, "flip " + std::to_string(i));
    }
    EXPECT_GT(read_all_the_same, 10) << "else the flips never get past the header";
    // Numbers where they hurt most.
    for (int i = 0; i < 400; ++i) {
        std::string bytes = sample_text();
        std::vector<std::size_t> digits;
        const std::size_t end = bytes.find("\"buffers\"");
        for (std::size_t k = 0; k < end; ++k)
            if (std::isdigit(static_cast<unsigned char>(bytes[k])) != 0 && (bytes[k - 1] == ' ' || bytes[k - 1] == '[')) digits.push_back(k);
        const char* kNasty[] = {"-1", "4294967295", "2147483648", "1e300", "18446744073709551616", "null", "\"x\"", "{}", "[[1]]", "0"};
        const std::size_t at = digits[dice() % digits.size()];
        std::size_t length = 1;
        while (std::isdigit(static_cast<unsigned char>(bytes[at + length])) != 0) ++length;
        bytes.replace(at, length, kNasty[dice() % std::size(kNasty)]);
        survives(bytes, "number " + std::to_string(i));
    }
}

INSTANTIATE_TEST_SUITE_P(Gltf, Hostile, testing::Values("text", "binary"), [](const auto& i) { return std::string(i.param); });

TEST(Sources, KnowBuiltInsAndFilesAndNothingElse) {
    for (const auto& e : scene::scenes()) {
        const auto s = scene::load_source(e.name);
        ASSERT_TRUE(s.has_value()) << s.error().message();
        EXPECT_GT(s->triangles(), 0u) << e.name;
    }
    EXPECT_EQ(scene::load_source("vert")->triangles(), 2'000'000u);
    const auto file = scene::load_source((kFolder / "lantern.gltf").string());
    ASSERT_TRUE(file.has_value());
    const auto box = scene::bounds_of(*file->model);
    double radius = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const double half = 0.5 * static_cast<double>(box.high[i] - box.low[i]);
        radius += half * half;
    }
    EXPECT_NEAR(std::sqrt(radius), 2.5, 0.01) << "brought to size, hanging objects and all";
    const auto none = scene::load_source("nowhere");
    ASSERT_FALSE(none.has_value());
    EXPECT_NE(none.error().way_out.find("specular"), std::string::npos);
}

}  // namespace
