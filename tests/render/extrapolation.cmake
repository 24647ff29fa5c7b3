# The tests of frame extrapolation, included by CMakeLists.txt of this folder.
fovea_test(fovea_extrapolation_test SOURCES
  allocation_count.cpp
  extrapolation_cases.cpp
  extrapolation_gaze_test.cpp
  extrapolation_known_paths_test.cpp
  extrapolation_known_test.cpp
  extrapolation_never_test.cpp
  extrapolation_search_test.cpp
  extrapolation_steps_test.cpp
  extrapolation_test.cpp
  extrapolation_window_test.cpp
  threads_test.cpp
  LINK fovea_extrapolation
  LABELS render asan tsan)
fovea_test(fovea_extrapolation_gl_test SOURCES
  ../../tools/extrapolation_scenes.cpp
  extrapolation_gl_quality_test.cpp
  extrapolation_gl_random_pictures_test.cpp
  extrapolation_gl_random_state_test.cpp
  extrapolation_gl_state_test.cpp
  extrapolation_gl_steps_test.cpp
  extrapolation_gl_test.cpp
  extrapolation_gl_version30_test.cpp
  extrapolation_gl_window_test.cpp
  extrapolation_gl_work_test.cpp
  LINK fovea_extrapolation fovea_gl PkgConfig::egl
  LABELS render asan)
# The fragment backend on Mesa's second software driver, whose compute shaders do nothing.
add_test(NAME fovea_extrapolation_gl_softpipe COMMAND fovea_extrapolation_gl_test --gtest_filter=*TruthAsThe*:*FineDetail*)
set_tests_properties(fovea_extrapolation_gl_softpipe PROPERTIES ENVIRONMENT "GALLIUM_DRIVER=softpipe" TIMEOUT 300 LABELS render)
# A context of OpenGL ES 3.0: Mesa gives none unless it is told to.
add_test(NAME fovea_extrapolation_gl_version30 COMMAND fovea_extrapolation_gl_test --gtest_filter=ExtrapolationGlVersion30.*)
set_tests_properties(fovea_extrapolation_gl_version30 PROPERTIES ENVIRONMENT "MESA_GLES_VERSION_OVERRIDE=3.0" TIMEOUT 300 LABELS render)
