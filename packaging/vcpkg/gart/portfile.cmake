# Not tried. REF and SHA512 are those of a release.
vcpkg_from_github(OUT_SOURCE_PATH SOURCE_PATH REPO gart/gart REF "v${VERSION}" SHA512 0)
vcpkg_check_features(OUT_FEATURE_OPTIONS FEATURES FEATURES
  cuda GART_CUDA
  embree GART_EMBREE
  program GART_BUILD_PROGRAM)
vcpkg_cmake_configure(SOURCE_PATH "${SOURCE_PATH}" OPTIONS ${FEATURES}
  -DGART_NATIVE=OFF -DGART_BUILD_TESTS=OFF -DGART_BUILD_EXAMPLES=OFF -DGART_DISTRIBUTED=OFF
  -DGART_PYTHON=OFF)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/gart)
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
if("program" IN_LIST FEATURES)
  vcpkg_copy_tools(TOOL_NAMES gart AUTO_CLEAN)
endif()
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
