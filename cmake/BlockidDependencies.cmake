# Third parties: found, never downloaded.
#
#   Eigen3::Eigen  Ceres::ceres  nlohmann_json::nlohmann_json  FastFloat::fast_float  CLI11::CLI11
#   PkgConfig::MATIO  Threads::Threads  GTest::gtest GTest::gmock GTest::gmock_main  benchmark::benchmark

include_guard(GLOBAL)

find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(Ceres 2.1 REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(FastFloat REQUIRED)

# Optional, a second solver of the closed-loop programme and the oracle of its tests.
find_package(CSDP QUIET)

find_package(PkgConfig REQUIRED)
pkg_check_modules(MATIO REQUIRED IMPORTED_TARGET matio>=1.5)

if(BLOCKID_BUILD_CLI)
  find_package(CLI11 2.1 REQUIRED)
endif()
if(BLOCKID_BUILD_TESTS)
  find_package(GTest 1.12 REQUIRED)
endif()
if(BLOCKID_BUILD_BENCH)
  find_package(benchmark 1.7 REQUIRED)
endif()
