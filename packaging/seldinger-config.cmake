# find_package(seldinger) -> seldinger::seldinger. The library brings what it needs itself.
include(${CMAKE_CURRENT_LIST_DIR}/seldinger-targets.cmake)
