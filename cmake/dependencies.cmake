# Everything comes from the distribution; tools/setup installs it on Debian 12.
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(SQLite3 3.40 REQUIRED)
find_package(ZLIB REQUIRED)
find_package(EXPAT MODULE REQUIRED)  # the package file that Debian has gives the target another name
find_package(TBB REQUIRED)
find_package(hwy 1.0 REQUIRED)

# dlib's optimisers are header-only templates: its headers are used, its library (BLAS, image and GUI code) is not linked.
find_path(SILA_DLIB_INCLUDE_DIR dlib/optimization.h REQUIRED)
add_library(sila_dlib INTERFACE)
target_include_directories(sila_dlib SYSTEM INTERFACE $<BUILD_INTERFACE:${SILA_DLIB_INCLUDE_DIR}>)
# Asio and Beast are header-only.
find_package(Boost 1.74 REQUIRED)
find_package(Threads REQUIRED)
# Linked by its name, as it has no CMake package; found here for a clear message.
find_library(SILA_MOSQUITTO_LIBRARY mosquitto REQUIRED)
