# The test of `fovea tradeoff extrapolation`, included by CMakeLists.txt of this folder.
fovea_test(fovea_tradeoff_extrapolation_test SOURCES
  ../../tools/image_quality.cpp
  tradeoff_extrapolation_test.cpp
  LINK nlohmann_json::nlohmann_json)
add_dependencies(fovea_tradeoff_extrapolation_test fovea)
