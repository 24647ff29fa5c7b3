# The test of `fovea tradeoff extrapolation`, included by CMakeLists.txt of this folder.
fovea_test(fovea_tradeoff_extrapolation_test SOURCES
  ../../tools/extrapolation_scenes.cpp
  ../../tools/extrapolation_targets.cpp
  ../../tools/image_quality.cpp
  tradeoff_extrapolation_test.cpp
  LINK nlohmann_json::nlohmann_json fmt::fmt ${FOVEA_OPENCV_QUALITY} ${FOVEA_OPENCV_IMGPROC} ${FOVEA_OPENCV_CORE})
target_include_directories(fovea_tradeoff_extrapolation_test SYSTEM PRIVATE ${FOVEA_OPENCV_INCLUDE})
target_link_libraries(fovea_tradeoff_extrapolation_test PRIVATE fovea_protocol)
add_dependencies(fovea_tradeoff_extrapolation_test fovea)
