// Programs under the layer, for the sanitizers: ./check builds this, the programs and the layer with the address, leak and
// undefined-behaviour sanitizers, and again with the thread sanitizer. Nothing is suppressed; but the driver is not built
// with the thread sanitizer, and orders its memory by futexes and atomics that it does not see: what modules without it read and
// write through memcpy and the like is left out (ignore_noninstrumented_modules), their locks are seen. In a build without
// sanitizers this tests the pictures.
#include <gtest/gtest.h>

#include <fstream>

#include "tests/layer/shell.hpp"

using namespace fovea::layer_test;

namespace {

const std::string kAutoEvery = "layer_auto_program scene no_clear frag_coord overlay depth_after_overlay next_frame visit full_screen_pass small blit swap scene";

// Without `fovea layer run`, so that nothing but the program and the layer has to be built with the sanitizer.
Ran sanitized(const std::string& program, const std::string& environment = "") {
    const std::string vendor = temporary("vendor.json"), errors = temporary("sanitizer");
    std::ofstream(vendor) << R"({"file_format_version": "1.0.0", "ICD": {"library_path": ")" << FOVEA_LAYER_LIBRARY << "\"}}\n";
    const std::string options = "ASAN_OPTIONS=detect_leaks=1:intercept_tls_get_addr=0:exitcode=66 UBSAN_OPTIONS=print_stacktrace=1:exitcode=66 "
                                "TSAN_OPTIONS=exitcode=66:second_deadlock_stack=1:ignore_noninstrumented_modules=1 ";
    const Ran ran = shell("__EGL_VENDOR_LIBRARY_FILENAMES=" + vendor + " " + options + environment + " " + kBin + "/" + program, errors);
    EXPECT_EQ(ran.exit_code, 0) << program << "\n" << file_text(errors);
    std::remove(vendor.c_str());
    std::remove(errors.c_str());
    return ran;
}

}  // namespace

TEST(LayerSanitized, ExamplesOfTheSpecifications) {
    EXPECT_NE(sanitized("layer_framebuffer_examples").out.find("5 left 1 right 1 middle 4"), std::string::npos);
    EXPECT_NE(sanitized("layer_texture_examples").out.find("3 left 1 right 1 corner 4"), std::string::npos);
}

TEST(LayerSanitized, ThreadsOfOneShareGroupDrawAtTheSameTime) {
    EXPECT_EQ(sanitized("layer_threads_program 4 6").out, "4 threads, 0 of 76 pictures wrong\n");
}

TEST(LayerSanitized, AutoModeInEveryCase) {
    EXPECT_NE(sanitized(kAutoEvery, "FOVEA_LAYER_AUTO='gain_x=4;gain_y=4;focus=0,0;always=1'").out.find("scene: middle 1 corner 4"),
              std::string::npos);
}

TEST(LayerSanitized, SeveralViews) {
    EXPECT_FALSE(sanitized("layer_multiview_program").out.empty());
}

TEST(LayerSanitized, IdleWithManyCalls) {
    EXPECT_EQ(sanitized("layer_calls_program").out.size(), 17u);
}
