# How every target of the project is compiled, and the two helpers that declare them.

find_program(FOVEA_CCACHE ccache)
if(FOVEA_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_C_COMPILER_LAUNCHER ${FOVEA_CCACHE})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${FOVEA_CCACHE})
endif()
find_program(FOVEA_LLD ld.lld)
if(FOVEA_LLD)
  add_link_options(-fuse-ld=lld)
endif()

add_library(fovea_options INTERFACE)
target_include_directories(fovea_options INTERFACE ${PROJECT_SOURCE_DIR})
# -ffp-contract=off: a fused multiply-add would make debug and release builds publish different bits.
target_compile_options(fovea_options INTERFACE -Wall -Wextra -Wconversion -Wshadow -ffp-contract=off -fno-math-errno)
target_compile_definitions(fovea_options INTERFACE FOVEA_VERSION="${PROJECT_VERSION}")
if(FOVEA_SANITIZE)
  add_compile_options(-fsanitize=${FOVEA_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${FOVEA_SANITIZE})
endif()

# fovea_library(NAME SOURCES a.cpp ... [LINK lib ...]): a static library of one folder.
function(fovea_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK;PRIVATE_LINK" ${ARGN})
  add_library(${name} STATIC ${arg_SOURCES})
  target_link_libraries(${name} PUBLIC fovea_options ${arg_LINK} PRIVATE ${arg_PRIVATE_LINK})
endfunction()

# fovea_test(NAME SOURCES a.cpp ... [LINK lib ...] [LABELS l ...] [TIMEOUT s] [WRAPPER program]): one GoogleTest binary,
# its cases known to CTest. LABELS asan and tsan: ./check also builds and runs it under that sanitizer (target
# fovea_asan_tests, fovea_tsan_tests). WRAPPER: the program that starts it, except under a sanitizer.
function(fovea_test name)
  cmake_parse_arguments(arg "" "TIMEOUT;WRAPPER" "SOURCES;LINK;LABELS" ${ARGN})
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 300)
  endif()
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE fovea_options ${arg_LINK} GTest::gmock GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE
    FOVEA_SOURCE_DIR="${PROJECT_SOURCE_DIR}" FOVEA_BIN_DIR="${CMAKE_RUNTIME_OUTPUT_DIRECTORY}")
  # One precompiled GoogleTest for all of them, built with the flags that they share.
  if(NOT TARGET fovea_test_headers)
    file(WRITE ${PROJECT_BINARY_DIR}/fovea_test_headers.cpp "int main() {}\n")
    add_executable(fovea_test_headers EXCLUDE_FROM_ALL ${PROJECT_BINARY_DIR}/fovea_test_headers.cpp)
    target_link_libraries(fovea_test_headers PRIVATE fovea_options GTest::gmock GTest::gtest_main)
    target_compile_definitions(fovea_test_headers PRIVATE
      FOVEA_SOURCE_DIR="${PROJECT_SOURCE_DIR}" FOVEA_BIN_DIR="${CMAKE_RUNTIME_OUTPUT_DIRECTORY}")
    target_precompile_headers(fovea_test_headers PRIVATE <gmock/gmock.h> <gtest/gtest.h>)
  endif()
  target_precompile_headers(${name} REUSE_FROM fovea_test_headers)
  if(arg_WRAPPER AND NOT FOVEA_SANITIZE)
    find_program(FOVEA_TEST_WRAPPER_${arg_WRAPPER} ${arg_WRAPPER})
    if(FOVEA_TEST_WRAPPER_${arg_WRAPPER})
      set_target_properties(${name} PROPERTIES CROSSCOMPILING_EMULATOR ${FOVEA_TEST_WRAPPER_${arg_WRAPPER}})
    endif()
  endif()
  include(GoogleTest)
  string(REPLACE ";" "," labels "${arg_LABELS}")   # discovery loses all but the first of a list; ctest -L takes a regex
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60
    PROPERTIES TIMEOUT ${arg_TIMEOUT} LABELS "${labels}")
  foreach(sanitizer asan tsan)
    if(sanitizer IN_LIST arg_LABELS)
      if(NOT TARGET fovea_${sanitizer}_tests)
        add_custom_target(fovea_${sanitizer}_tests)
      endif()
      add_dependencies(fovea_${sanitizer}_tests ${name})
    endif()
  endforeach()
endfunction()
